/// Trajectories for other programs: extended XYZ, which OVITO and ASE read, and VTK XML for
/// ParaView.
#pragma once

#include <jfpx/body.hpp>

#include <cstdint>
#include <memory>
#include <span>
#include <string>

namespace jfpx {
inline namespace JFPX_ABI {

struct Scene;
class World;

/// Writes frames of a run to a file whose extension selects the format:
///
/// - `.xyz`, `.extxyz`: extended XYZ, a text file with all frames. Numbers have the fewest digits
///   that parse to the same bits. Quaternions are (x, y, z, w), as in OVITO.
/// - `.pvd`: an index of VTK files (PolyData, binary), one per frame, in a folder beside it:
///   `run.pvd` has `run/run_000000.vtp`, `run/run_000001.vtp` and so on. Quaternions are (w, x, y,
///   z), as in VTK.
///
/// A frame has a point for each body, in the order of the bodies, with the precision of the
/// library: position [m], id (BodyId::index, or the index in the scene), radius [m], shape (index
/// of the type in `Shape`: 0 sphere, 1 box, 2 half-space, 3 plane, 4 compound, 5 capsule, 6
/// triangle mesh, 7 hull, 8 heightfield, 9 cylinder, 10 cone), orientation, velocity [m/s] and
/// angular velocity [rad/s] in world axes. The radius of a sphere is its own. That of another body
/// is the largest distance of its surface from the origin of its axes, or a bound of it; that of a
/// half-space or plane, which is infinite and whose position has no meaning, is 0. No format has
/// the geometry of other shapes than spheres.
///
/// Equal states give equal bytes. The memory that is needed does not depend on the number of
/// frames.
///
/// finish() creates the complete file under its name; until then, the data are in NAME.part in the
/// same folder, which the destructor removes. It replaces the frames of an earlier run, and leaves
/// other files in the folder of the frames. If the frames of a `.pvd` cannot be moved, those of
/// both runs may remain. Not thread-safe.
class JFPX_API TrajectoryWriter {
 public:
  /// @throws InvalidArgument for another extension; FileError if the file cannot be created
  explicit TrajectoryWriter(const std::string& path);
  ~TrajectoryWriter();
  TrajectoryWriter(TrajectoryWriter&&) noexcept;
  TrajectoryWriter& operator=(TrajectoryWriter&&) noexcept;

  /// Appends a frame with the current states of a world, whose bodies may differ from frame to
  /// frame.
  /// @throws FileError, for example if the disk is full: the trajectory cannot be finished then;
  ///   OutOfMemory, DeviceError
  void append(const World& world);
  /// Appends a frame of another engine.
  /// @param scene its bodies have the shapes; its dt is the length of a step
  /// @param step number of completed steps
  /// @param states in the order of the bodies
  /// @throws InvalidArgument for another number of states than bodies; FileError
  void append(const Scene& scene, std::uint64_t step, std::span<const BodyState> states);
  /// Completes the files. @throws FileError
  void finish();

 private:
  struct Format;
  struct ExtendedXyz;
  struct Vtk;
  std::unique_ptr<Format> format_;
};

/// Writes the states of all bodies of a world to a file in NumPy's format (.npy): an array of
/// records, in the order of World::bodies(), which `numpy.load(path, mmap_mode="r")` maps into
/// memory. The fields of a record are index and generation (BodyId, unsigned 32 bits), position
/// [m], orientation (w, x, y, z), velocity [m/s] and angular_velocity [rad/s] in world axes, in the
/// precision of the library. Equal states give equal bytes. The file appears under its name when it
/// is complete; until then, the data are in NAME.part in the same folder.
///
/// With several ranks, all call the function, with a path on a file system that they share. Each
/// rank writes a share of the rows, and none collects the states of all bodies.
/// @throws FileError, for example if the disk is full, on all ranks; DeviceError, OutOfMemory
JFPX_API void write_states(const World& world, const std::string& path);

}  // namespace JFPX_ABI
}  // namespace jfpx

/// Tests of trajectories: their numbers are those of the states, and files are complete or absent.
#include <jfpx/error.hpp>
#include <jfpx/trajectory.hpp>
#include <jfpx/world.hpp>

#include "src/base/file.hpp"
#include "src/scenes/scenes.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/support/thread_ranks.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <charconv>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

#if !defined(_WIN32)
#include "tests/support/full_disk.hpp"
#endif

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::StartsWith;

/// Numbers of a body in a frame.
struct Row {
  std::uint32_t id = 0;
  Real radius = 0;
  std::uint32_t shape = 0;
  BodyState state;
  friend bool operator==(const Row&, const Row&) = default;
};

std::vector<Row> rows_of(const World& world, const std::vector<Real>& radii) {
  std::vector<Row> rows;
  for (std::size_t i = 0; i < world.bodies().size(); ++i) {
    const BodyId id = world.bodies()[i];
    rows.push_back(
        {id.index, radii[i], static_cast<std::uint32_t>(world.shape(id).index()), world.state(id)});
  }
  return rows;
}

Scene scene_of_shapes() {
  BodyDef ground, ball, box, capsule;
  ground.shape = HalfSpace{};
  ground.mass = 0;
  ball.shape = Sphere{Real(0.3)};
  ball.position = {0, 1, 0};
  ball.velocity = {1, 2, 3};
  box.shape = Box{{Real(0.3), Real(0.4), Real(1.2)}};
  box.position = {5, 2, 0};
  box.angular_velocity = {1, Real(0.1), -3};
  capsule.shape = Capsule{Real(0.25), Real(0.5)};
  capsule.position = {9, Real(0.7), 1};
  Scene scene;
  scene.bodies = {ground, ball, box, capsule};
  return scene;
}
const std::vector<Real> kRadii = {0, Real(0.3), length(Vec3{Real(0.3), Real(0.4), Real(1.2)}),
                                  Real(0.75)};

template <class Number>
Number read_number(std::istringstream& line) {
  std::string word;
  line >> word;
  Number value{};
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  EXPECT_TRUE(error == std::errc() && end == word.data() + word.size()) << word;
  return value;
}

/// The bodies of the next frame of extended XYZ. @param properties receives its second line
std::vector<Row> read_xyz_frame(std::istream& file, std::string* properties) {
  std::string line;
  std::getline(file, line);
  std::vector<Row> rows(std::stoul(line));
  std::getline(file, *properties);
  for (Row& row : rows) {
    std::getline(file, line);
    std::istringstream words(line);
    std::string species;
    words >> species;
    EXPECT_EQ(species, "X");
    const auto next = [&] { return read_number<Real>(words); };
    const auto next_vector = [&] {
      Vec3 v;
      for (int k = 0; k < 3; ++k) v[k] = next();
      return v;
    };
    row.state.position = next_vector();
    row.id = read_number<std::uint32_t>(words);
    row.radius = next();
    row.shape = read_number<std::uint32_t>(words);
    Quat& q = row.state.orientation;
    for (Real* part : {&q.x, &q.y, &q.z, &q.w}) *part = next();
    row.state.velocity = next_vector();
    row.state.angular_velocity = next_vector();
    EXPECT_FALSE(words >> species);
  }
  return rows;
}

/// The values of an array in the appended bytes of a VTK file.
template <class Item>
std::vector<Item> read_vtk_array(const std::string& file, const std::string& name) {
  const std::string declared = " Name=\"" + name + "\" ";
  const std::size_t at = file.find(declared);
  EXPECT_NE(at, std::string::npos) << name;
  constexpr const char* kOffset = "offset=\"";
  const std::size_t offset = std::stoul(file.substr(file.find(kOffset, at) + strlen(kOffset)));
  constexpr const char* kAppended = "<AppendedData encoding=\"raw\">\n_";
  const char* const array = file.data() + file.find(kAppended) + strlen(kAppended) + offset;
  std::uint64_t size = 0;
  std::memcpy(&size, array, sizeof size);
  std::vector<Item> items(size / sizeof(Item));
  std::memcpy(items.data(), array + sizeof size, size);
  return items;
}

std::vector<Row> read_vtk_frame(const std::string& path) {
  const std::string file = read_file(path);
  const auto ids = read_vtk_array<std::uint32_t>(file, "id");
  const auto radii = read_vtk_array<Real>(file, "radius");
  const auto shapes = read_vtk_array<std::uint8_t>(file, "shape");
  const auto orientations = read_vtk_array<Real>(file, "orientation");
  const auto velocities = read_vtk_array<Real>(file, "velocity");
  const auto spins = read_vtk_array<Real>(file, "angular_velocity");
  const auto positions = read_vtk_array<Real>(file, "position");
  std::vector<std::int64_t> vertices, ends;
  std::vector<Row> rows;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const auto vector = [i](const std::vector<Real>& from) {
      return Vec3{from.at(3 * i), from.at(3 * i + 1), from.at(3 * i + 2)};
    };
    const Real* const q = &orientations.at(4 * i);
    rows.push_back(
        {ids[i],
         radii.at(i),
         shapes.at(i),
         {vector(positions), {q[0], q[1], q[2], q[3]}, vector(velocities), vector(spins)}});
    vertices.push_back(static_cast<std::int64_t>(i));
    ends.push_back(static_cast<std::int64_t>(i + 1));
  }
  EXPECT_EQ(read_vtk_array<std::int64_t>(file, "connectivity"), vertices);
  EXPECT_EQ(read_vtk_array<std::int64_t>(file, "offsets"), ends);
  EXPECT_TRUE(file.ends_with("\n  </AppendedData>\n</VTKFile>\n"));
  return rows;
}

TEST(Trajectory, HasTheBitsOfTheStatesInBothFormats) {
  const TemporaryFolder folder;
  World world(scene_of_shapes());
  std::vector<Real> radii = kRadii;
  TrajectoryWriter xyz(folder.file("run.extxyz")), vtk(folder.file("run.pvd"));
  std::vector<std::vector<Row>> expected;
  std::vector<double> times;
  for (int frame = 0; frame < 4; ++frame) {
    if (frame == 2) {
      world.remove(world.bodies()[1]);
      radii.erase(radii.begin() + 1);
    }
    xyz.append(world);
    vtk.append(world);
    expected.push_back(rows_of(world, radii));
    times.push_back(world.time());
    for (int i = 0; i < 7; ++i) world.step();
  }
  xyz.finish();
  vtk.finish();
  std::istringstream file(read_file(folder.file("run.extxyz")));
  const std::string index = read_file(folder.file("run.pvd"));
  EXPECT_THAT(index, StartsWith("<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\""));
  for (std::size_t i = 0; i < expected.size(); ++i) {
    char time[32] = {};
    std::to_chars(time, time + sizeof time, times[i]);
    std::string properties;
    EXPECT_EQ(read_xyz_frame(file, &properties), expected[i]);
    EXPECT_THAT(properties,
                HasSubstr(std::string(" Time=") + time + " Step=" + std::to_string(7 * i) + " "));
    const std::string name = "run/run_00000" + std::to_string(i) + ".vtp";
    EXPECT_EQ(read_vtk_frame(folder.file(name)), expected[i]);
    EXPECT_THAT(index, HasSubstr(std::string("<DataSet timestep=\"") + time + "\" file=\"" + name +
                                 "\"/>\n"));
  }
  EXPECT_EQ(file.peek(), EOF);
}

TEST(Trajectory, OfAnotherEngineHasTheStatesThatAreGiven) {
  const TemporaryFolder folder;
  const Scene scene = scene_of_shapes();
  const World world(scene);
  TrajectoryWriter writer(folder.file("run.xyz"));
  writer.append(scene, 30, world.states());
  EXPECT_THROW(writer.append(scene, 31, std::vector<BodyState>(3)), InvalidArgument);
  writer.finish();
  std::istringstream file(read_file(folder.file("run.xyz")));
  std::string properties;
  EXPECT_EQ(read_xyz_frame(file, &properties), rows_of(world, kRadii));
  EXPECT_THAT(properties, HasSubstr(" Time=0.5"));
  EXPECT_THAT(properties, HasSubstr(" Step=30 "));
}

TEST(Trajectory, OfEqualRunsHasEqualBytes) {
  const TemporaryFolder folder;
  for (const unsigned threads : {1u, 3u}) {
    World world(scenes::make("mixed", {.spheres = 50}), {.threads = threads});
    const std::string name = folder.file(std::to_string(threads));
    TrajectoryWriter xyz(name + ".xyz"), vtk(name + ".pvd");
    for (int step = 0; step < 20; ++step) {
      world.step();
      xyz.append(world);
      vtk.append(world);
    }
    xyz.finish();
    vtk.finish();
  }
  EXPECT_EQ(read_file(folder.file("1.xyz")), read_file(folder.file("3.xyz")));
  EXPECT_EQ(read_file(folder.file("1/1_000019.vtp")), read_file(folder.file("3/3_000019.vtp")));
}

TEST(Trajectory, AppearsWhenItIsFinished) {
  for (const std::string extension : {"xyz", "pvd"}) {
    const TemporaryFolder folder;
    const World world(scene_of_shapes());
    const std::string path = folder.file("run." + extension);
    {
      TrajectoryWriter writer(path);
      writer.append(world);
      EXPECT_FALSE(fs::exists(path));
      EXPECT_FALSE(fs::exists(folder.file("run")));
    }
    EXPECT_EQ(folder.entries(), 0u) << extension;
    TrajectoryWriter writer(path);
    writer.append(world);
    writer.finish();
    EXPECT_EQ(folder.entries(), extension == "xyz" ? 1u : 2u);
    EXPECT_THROW(writer.append(world), FileError);
    EXPECT_THROW(writer.finish(), FileError);
  }
}

TEST(Trajectory, ReplacesTheFramesOfAnEarlierRunAndNoOtherFile) {
  const TemporaryFolder folder;
  const World world(scene_of_shapes());
  for (const int frames : {5, 2}) {
    TrajectoryWriter writer(folder.file("run.pvd"));
    for (int i = 0; i < frames; ++i) writer.append(world);
    writer.finish();
    write_file(folder.file("run/notes.txt"), "mine");
    EXPECT_EQ(std::distance(fs::directory_iterator(folder.file("run")), fs::directory_iterator()),
              frames + 1);
  }
  EXPECT_EQ(folder.entries(), 2u);
}

TEST(Trajectory, RemovesTheFramesOfAKilledRun) {
  const TemporaryFolder folder;
  fs::create_directory(folder.file("run.part"));
  for (const char* frame : {"run.part/run_000001.vtp", "run.part/run_000007.vtp"}) {
    write_file(folder.file(frame), "part");
  }
  TrajectoryWriter writer(folder.file("run.pvd"));
  writer.append(World(scene_of_shapes()));
  writer.finish();
  EXPECT_EQ(folder.entries(), 2u);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.file("run")), fs::directory_iterator()), 1);
}

TEST(Trajectory, IsNotFinishedAfterAFailedAttempt) {
  const TemporaryFolder folder;
  {
    TrajectoryWriter writer(folder.file("run.pvd"));
    writer.append(World(scene_of_shapes()));
    std::ofstream(folder.file("run")) << "mine";  // run.part is a folder
    EXPECT_THROW(writer.finish(), FileError);
    fs::remove(folder.file("run"));
    EXPECT_THROW(writer.finish(), FileError) << "the index would have two ends";
  }
  EXPECT_EQ(folder.entries(), 0u);
}

TEST(Trajectory, WithoutBodiesHasEmptyFrames) {
  const TemporaryFolder folder;
  const World world{Scene{}};
  TrajectoryWriter xyz(folder.file("run.xyz")), vtk(folder.file("run.pvd"));
  xyz.append(world);
  vtk.append(world);
  xyz.finish();
  vtk.finish();
  std::istringstream file(read_file(folder.file("run.xyz")));
  std::string properties;
  EXPECT_TRUE(read_xyz_frame(file, &properties).empty());
  EXPECT_TRUE(read_vtk_frame(folder.file("run/run_000000.vtp")).empty());
}

std::string error_of(const std::string& path) {
  try {
    const TrajectoryWriter writer(path);
  } catch (const Error& error) {
    return error.what();
  }
  return "none";
}

TEST(Trajectory, ErrorsNameTheFile) {
  const TemporaryFolder folder;
  for (const std::string name : {"run.dump", "run", ".xyz", "run.vtp"}) {
    EXPECT_THROW(TrajectoryWriter{folder.file(name)}, InvalidArgument) << name;
    EXPECT_THAT(error_of(folder.file(name)),
                HasSubstr(folder.file(name) + " has the extension \""));
  }
  EXPECT_THAT(error_of(folder.file("run.dump")),
              HasSubstr("\".dump\"; it must be .xyz or .extxyz (extended XYZ), or .pvd (VTK)"));
  for (const std::string extension : {"xyz", "pvd"}) {
    const std::string path = folder.file("nowhere/run." + extension);
    EXPECT_THAT(error_of(path), StartsWith(path + ": can't be written: No such file"));
  }
  EXPECT_EQ(folder.entries(), 0u);
  write_file(folder.file("run"), "mine");
  EXPECT_THAT(error_of(folder.file("run.pvd")),
              StartsWith(folder.file("run") + ": can't be written: Not a directory"));
  EXPECT_EQ(folder.entries(), 1u);
}

TEST(StatesFile, IsAnArrayOfNumPy) {
  const TemporaryFolder folder;
  World world(scene_of_shapes());
  world.remove(world.bodies()[1]);
  for (int i = 0; i < 10; ++i) world.step();
  write_states(world, folder.file("states.npy"));
  const std::string bytes = read_file(folder.file("states.npy"));
  const std::string real = sizeof(Real) == 4 ? "'<f4'" : "'<f8'";
  const std::string text = "{'descr': [('index', '<u4'), ('generation', '<u4'), ('position', " +
                           real + ", (3,)), ('orientation', " + real + ", (4,)), ('velocity', " +
                           real + ", (3,)), ('angular_velocity', " + real +
                           ", (3,))], 'fortran_order': False, 'shape': (" +
                           std::to_string(world.bodies().size()) + ",), }";
  ASSERT_GT(bytes.size(), text.size() + 10);
  EXPECT_EQ(bytes.substr(0, 8), std::string("\x93NUMPY\x01\0", 8));
  EXPECT_EQ(bytes.substr(10, text.size()), text);
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(bytes[i]); };
  const std::size_t header = 10u + byte(8) + 256u * byte(9), record = 8 + 13 * sizeof(Real);
  EXPECT_EQ(header % 4096, 0u);
  EXPECT_EQ(bytes[header - 1], '\n');
  ASSERT_EQ(bytes.size(), header + world.bodies().size() * record);
  for (std::size_t i = 0; i < world.bodies().size(); ++i) {
    BodyId id;
    BodyState s;
    const char* at = bytes.data() + header + i * record;
    const auto read = [&](auto*... values) {
      ((std::memcpy(values, at, sizeof *values), at += sizeof *values), ...);
    };
    read(&id.index, &id.generation, &s.position.x, &s.position.y, &s.position.z, &s.orientation.w,
         &s.orientation.x, &s.orientation.y, &s.orientation.z, &s.velocity.x, &s.velocity.y,
         &s.velocity.z, &s.angular_velocity.x, &s.angular_velocity.y, &s.angular_velocity.z);
    EXPECT_EQ(id, world.bodies()[i]);
    EXPECT_EQ(s, world.states()[i]);
  }
  EXPECT_EQ(folder.entries(), 1u);
  try {
    write_states(world, folder.file("none/states.npy"));
    ADD_FAILURE();
  } catch (const FileError& error) {
    EXPECT_THAT(error.what(), StartsWith(folder.file("none/states.npy") + ": can't be written"));
  }
}

#if !defined(_WIN32)
TEST(StatesFile, OnAFullDiskIsAnErrorOnAllRanksAndLeavesNoFile) {
  const TemporaryFolder folder;
  const Scene scene = scenes::make("pile", {.spheres = 1000});
  const FullDisk full;
  EXPECT_THROW(write_states(World(scene), folder.file("states.npy")), FileError);
  ThreadRanks::run(3, [&](const std::shared_ptr<Communicator>& communicator) {
    World world(scene, {.communicator = communicator});
    world.step();
    EXPECT_THROW(write_states(world, folder.file("states.npy")), FileError);
  });
  EXPECT_EQ(folder.entries(), 0u);
}

TEST(Trajectory, OnAFullDiskIsAnErrorAndLeavesNoFile) {
  for (const std::string extension : {"xyz", "pvd"}) {
    const TemporaryFolder folder;
    const World world(scenes::make("pile", {.spheres = 1000}));
    {
      TrajectoryWriter writer(folder.file("run." + extension));
      {
        const FullDisk full;
        EXPECT_THROW(for (int i = 0; i < 9; ++i) writer.append(world), FileError) << extension;
      }
      EXPECT_THROW(writer.append(world), FileError)
          << "there is room again, but a frame is cut off";
      EXPECT_THROW(writer.finish(), FileError) << extension;
    }
    EXPECT_EQ(folder.entries(), 0u) << extension;
  }
}
#endif

}  // namespace
}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx

/// Motion of a body during a step on a device. The rows of its contacts update it one after the
/// other.
#pragma once

#include "src/contact_solver/cell.hpp"
#include "src/contact_solver/soft_step/colors.hpp"
#include "src/contact_solver/soft_step/step_constants.hpp"

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace device {

/// Tickets: sequence numbers of the updates of a body in a world of one block. Each sweep has
/// kPerSweep tickets: one before the colors, and one for the row of each color. A row waits for the
/// ticket of the previous row of the body, then publishes its own ticket. Colors without a row of
/// the body have no tickets. Overflow rows do not change the ticket, because barriers enclose them.
struct Tickets {
  static constexpr std::uint32_t kPerSweep = soft_step::kColorsPerClass + 1u;

  std::uint64_t colors = 0;  ///< of the body's rows
  std::uint32_t first = 0;   ///< the ticket before the colors

  JFPX_HD Tickets(std::uint32_t sweep, std::uint64_t row_colors)
      : colors(row_colors), first(sweep * kPerSweep) {}

  /// The ticket after the row of a color.
  JFPX_HD std::uint32_t after(std::uint32_t color) const { return first + 1 + color; }
  /// The ticket that the row of a color waits for.
  JFPX_HD std::uint32_t before(std::uint32_t color) const {
    return after_all(colors & ((std::uint64_t{1} << color) - 1));
  }
  /// The last ticket of the sweep.
  JFPX_HD std::uint32_t last() const { return after_all(colors); }

 private:
  JFPX_HD std::uint32_t after_all(std::uint64_t set) const {
#if defined(__CUDA_ARCH__)
    return first + 64 - static_cast<std::uint32_t>(__clzll(static_cast<long long>(set)));
#else
    return first + static_cast<std::uint32_t>(std::bit_width(set));
#endif
  }
};

/// A vector in cells of numbers and a word. All cells hold the same word. In double, a cell holds
/// one number and half of the third one.
class VectorCells {
 public:
  static constexpr std::uint32_t kMixed = ~0u;  ///< the cells differ; above all tickets

  VectorCells() = default;
  JFPX_HD VectorCells(const Vec3& vector, std::uint32_t word) {
    const Words x = words_of(vector.x), y = words_of(vector.y), z = words_of(vector.z);
    if constexpr (kCells == 1) {
      cells_[0] = {{x[0], y[0], z[0], word}};
    } else {
      cells_[0] = {{x[0], x[1], z[0], word}};
      cells_[1] = {{y[0], y[1], z[1], word}};
    }
  }

  JFPX_HD Vec3 vector() const {
    const auto& first = cells_[0].words;
    if constexpr (kCells == 1) {
      return {number(first[0]), number(first[1]), number(first[2])};
    } else {
      const auto& second = cells_[1].words;
      return {number(first[0], first[1]), number(second[0], second[1]),
              number(first[2], second[2])};
    }
  }
  /// The word of all cells, or kMixed.
  JFPX_HD std::uint32_t word() const {
    const std::uint32_t word = cells_[0].words[3];
    return cells_[kCells - 1].words[3] == word ? word : kMixed;
  }

  JFPX_HD void load(const VectorCells* at) {
    for (int c = 0; c < kCells; ++c) cells_[c] = load_memory_cell(&at->cells_[c]);
  }
  JFPX_HD void store(VectorCells* at) const {
    for (int c = 0; c < kCells; ++c) store_memory_cell(&at->cells_[c], cells_[c]);
  }

 private:
  static constexpr int kCells = sizeof(Real) / 4;
  using Words = std::array<std::uint32_t, sizeof(Real) / 4>;
  JFPX_HD static Words words_of(Real x) { return std::bit_cast<Words>(x); }
  template <class... Word>
  JFPX_HD static Real number(Word... words) {
    return std::bit_cast<Real>(Words{words...});
  }

  MemoryCell cells_[kCells];
};

/// The motion of all bodies as cells, one array for each vector: consecutive threads that complete
/// consecutive bodies access consecutive addresses.
struct CellColumns {
  /// Only rebounding rows read the free velocities.
  enum Column {
    kVelocity,
    kAngularVelocity,
    kShift,
    kRotation,
    kFreeVelocity,
    kFreeSpin,
    kColumns
  };

  VectorCells* cells = nullptr;  ///< kColumns arrays
  std::size_t size = 0;          ///< number of bodies of an array

  JFPX_HD VectorCells* at(Column column, std::uint32_t body) const {
    return cells + column * size + body;
  }
};

/// Orientation of a body with joints, and its number of moves in the step. A move stores the cells
/// before the velocities, so a row that has read the velocities waits only for a short time.
class OrientationCells {
 public:
  JFPX_HD void store(const Quat& orientation, std::uint32_t moves) {
    const auto [w, x, y, z] = orientation;
    VectorCells({x, y, z}, moves).store(&vector_);
    VectorCells({w, 0, 0}, moves).store(&scalar_);
  }
  JFPX_HD Quat load(std::uint32_t moves) const {
    VectorCells vector, scalar;
    do {
      vector.load(&vector_);
      scalar.load(&scalar_);
    } while (vector.word() != moves || scalar.word() != moves);
    const Vec3 v = vector.vector();
    return {scalar.vector().x, v.x, v.y, v.z};
  }

 private:
  VectorCells vector_, scalar_;
};

/// Access to the motion of a body as cells. Every ticket writes the cells of the velocities, and
/// writes other cells only if they may have changed. The words of the velocities contain the
/// versions of the matching other cells.
class BodyCells {
 public:
  static constexpr bool kHasMasses = false;  ///< RowBody has them
  static constexpr std::uint32_t kTicketBits = 14, kVersionBits = 6;
  static constexpr std::uint32_t kVersionMask = (1u << kVersionBits) - 1;

  /// Versions of the other vectors.
  struct Version {
    std::uint32_t shift = 0, rotation = 0, free = 0;

    Version() = default;
    /// @param word of the cells of velocities
    JFPX_HD explicit Version(std::uint32_t word)
        : shift(word >> kTicketBits & kVersionMask),
          rotation(word >> (kTicketBits + kVersionBits) & kVersionMask),
          free(word >> (kTicketBits + 2 * kVersionBits) & kVersionMask) {}
    JFPX_HD std::uint32_t word(std::uint32_t ticket) const {
      return ticket | shift << kTicketBits | rotation << (kTicketBits + kVersionBits) |
             free << (kTicketBits + 2 * kVersionBits);
    }
  };

  /// @param i index of the body in the columns
  JFPX_HD BodyCells(const CellColumns& columns, std::uint32_t i) : columns_(columns), i_(i) {}

  /// The motion before the first ticket.
  JFPX_HD void start(const soft_step::SolverBody& body, const soft_step::FreeMotion& free) const {
    Version version;
    write_shift(body, &version);
    write_rotation(body, &version);
    write_free(free, &version);
    write(Tickets(0, 0).first, body, version);
  }

  /// Reads the motion after a ticket.
  /// @tparam kRotation whether to read the rotation
  /// @returns whether the ticket is published and all cells are visible
  template <bool kRotation>
  JFPX_HD bool read(std::uint32_t ticket, soft_step::SolverBody* body, Version* version) const {
    VectorCells v, w, s, r;
    v.load(at(CellColumns::kVelocity));
    w.load(at(CellColumns::kAngularVelocity));
    s.load(at(CellColumns::kShift));
    if constexpr (kRotation) r.load(at(CellColumns::kRotation));
    body->velocity = v.vector();
    body->angular_velocity = w.vector();
    body->shift = s.vector();
    if constexpr (kRotation) body->rotation = r.vector();
    const std::uint32_t word = v.word();
    *version = Version(word);
    bool is_complete =
        (word & kTicketMask) == ticket && w.word() == word && s.word() == version->shift;
    if constexpr (kRotation) is_complete = r.word() == version->rotation && is_complete;
    return is_complete;
  }

  /// Writes the velocities after a ticket. @param version of the other vectors
  JFPX_HD void write(std::uint32_t ticket, const soft_step::SolverBody& body,
                     const Version& version) const {
    const std::uint32_t word = version.word(ticket);
    VectorCells(body.velocity, word).store(at(CellColumns::kVelocity));
    VectorCells(body.angular_velocity, word).store(at(CellColumns::kAngularVelocity));
  }
  /// Write a new version, before the velocities.
  JFPX_HD void write_shift(const soft_step::SolverBody& body, Version* version) const {
    version->shift = (version->shift + 1) & kVersionMask;
    VectorCells(body.shift, version->shift).store(at(CellColumns::kShift));
  }
  JFPX_HD void write_rotation(const soft_step::SolverBody& body, Version* version) const {
    version->rotation = (version->rotation + 1) & kVersionMask;
    VectorCells(body.rotation, version->rotation).store(at(CellColumns::kRotation));
  }
  JFPX_HD void write_free(const soft_step::FreeMotion& free, Version* version) const {
    version->free = (version->free + 1) & kVersionMask;
    VectorCells(free.velocity, version->free).store(at(CellColumns::kFreeVelocity));
    VectorCells(free.angular_velocity, version->free).store(at(CellColumns::kFreeSpin));
  }
  /// Reads the free motion of a version that read() has returned. It is stored before the
  /// velocities, so the wait is short.
  JFPX_HD soft_step::FreeMotion read_free(const Version& version) const {
    VectorCells v, w;
    do {
      v.load(at(CellColumns::kFreeVelocity));
      w.load(at(CellColumns::kFreeSpin));
    } while (v.word() != version.free || w.word() != version.free);
    return {v.vector(), w.vector()};
  }

 private:
  static constexpr std::uint32_t kTicketMask = (1u << kTicketBits) - 1;
  // Versions restart at 0 after 64 changes. A thread loads all cells of a body in immediate
  // succession, and each change takes at least a round trip to L2, so a loaded cell is less than 64
  // changes older than another.
  // All tickets are below VectorCells::kMixed. The sweeps of a step are the warm start, the sweeps
  // of the substeps, and the restitution.
  static_assert((soft_step::kMostSweeps + 2) * Tickets::kPerSweep < kTicketMask);

  JFPX_HD VectorCells* at(CellColumns::Column column) const { return columns_.at(column, i_); }

  CellColumns columns_;
  std::uint32_t i_;
};

/// Access to the motion of a body in a world with blocks, where barriers separate all accesses. It
/// has the interface and the memory of BodyCells, without tickets and versions. The velocities and
/// the masses of a body are consecutive in memory, because crossing rows access bodies in any
/// order.
class BodyMotion {
 public:
  static constexpr bool kHasMasses = true;
  struct Version {};

  /// @param i index of the body in the columns
  JFPX_HD BodyMotion(const CellColumns& columns, std::uint32_t i)
      : velocities_(reinterpret_cast<Velocities*>(columns.cells) + i),
        shift_(vector(columns, CellColumns::kShift, i)),
        rotation_(vector(columns, CellColumns::kRotation, i)),
        free_velocity_(vector(columns, CellColumns::kFreeVelocity, i)),
        free_spin_(vector(columns, CellColumns::kFreeSpin, i)) {}

  /// The motion before the first row.
  JFPX_HD void start(const soft_step::SolverBody& body, const soft_step::FreeMotion& free) const {
    write(0, body);
    write_shift(body);
    write_rotation(body);
    write_free(free);
  }
  /// Reads the motion. @tparam kRotation whether to read the rotation @returns true
  template <bool kRotation>
  JFPX_HD bool read(std::uint32_t, soft_step::SolverBody* body, Version*) const {
    const Velocities v = *velocities_;
    const Vector s = *shift_;
    body->velocity = v.velocity;
    body->inverse_mass = v.inverse_mass;
    body->angular_velocity = v.angular_velocity;
    body->inverse_inertia = v.inverse_inertia;
    body->shift = s.vector;
    if constexpr (kRotation) body->rotation = Vector(*rotation_).vector;
    return true;
  }
  JFPX_HD void write(std::uint32_t, const soft_step::SolverBody& body, const Version& = {}) const {
    *velocities_ = {body.velocity, body.inverse_mass, body.angular_velocity, body.inverse_inertia};
  }
  JFPX_HD void write_shift(const soft_step::SolverBody& body, Version* = nullptr) const {
    *shift_ = {body.shift, 0};
  }
  JFPX_HD void write_rotation(const soft_step::SolverBody& body, Version* = nullptr) const {
    *rotation_ = {body.rotation, 0};
  }
  JFPX_HD void write_free(const soft_step::FreeMotion& free, Version* = nullptr) const {
    *free_velocity_ = {free.velocity, 0};
    *free_spin_ = {free.angular_velocity, 0};
  }
  JFPX_HD soft_step::FreeMotion read_free(const Version&) const {
    return {Vector(*free_velocity_).vector, Vector(*free_spin_).vector};
  }

 private:
  struct alignas(8 * sizeof(Real)) Velocities {
    Vec3 velocity;
    Real inverse_mass;
    Vec3 angular_velocity;
    Real inverse_inertia;
  };
  struct alignas(4 * sizeof(Real)) Vector {
    Vec3 vector;
    Real unused;
  };
  static_assert(sizeof(Velocities) == 2 * sizeof(VectorCells));
  static_assert(sizeof(Vector) == sizeof(VectorCells));
  static_assert(CellColumns::kVelocity == 0 && CellColumns::kAngularVelocity == 1);
  JFPX_HD static Vector* vector(const CellColumns& columns, CellColumns::Column column,
                                std::uint32_t i) {
    return reinterpret_cast<Vector*>(columns.at(column, i));
  }

  Velocities* velocities_;
  Vector *shift_, *rotation_, *free_velocity_, *free_spin_;
};

/// Constants of a body during a step, for its rows.
struct alignas(16) RowBody {
  Real inverse_mass = 0;     ///< as SolverBody; 0: not a movable awake body
  Real inverse_inertia = 0;  ///< as SolverBody
  std::uint64_t colors = 0;  ///< of its rows
};

}  // namespace device
}  // namespace JFPX_ABI
}  // namespace jfpx

/// Motion of a body during a step on a device, which the rows of its contacts change one after the
/// other.
#pragma once

#include "src/contact_solver/cell.hpp"
#include "src/contact_solver/greedy_coloring.hpp"
#include "src/contact_solver/step_constants.hpp"

#include <bit>
#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace device {

/// Order of the changes of a body: in each sweep over the rows, first the rows of its contacts by
/// color, then the body itself. A turn is the sequence number of the last change that was made.
struct Turns {
  static constexpr std::uint32_t kPerSweep = soft_step::kColors + 2u;

  std::uint64_t colors = 0;  ///< of the body's rows
  std::uint32_t first = 0;   ///< the turn before the sweep

  JFPX_HD Turns(std::uint32_t sweep, std::uint64_t row_colors)
      : colors(row_colors), first(sweep * kPerSweep) {}

  /// The turn after the row of a color.
  JFPX_HD std::uint32_t after(std::uint32_t color) const { return first + 1 + color; }
  /// The turn that the row of a color waits for.
  JFPX_HD std::uint32_t before(std::uint32_t color) const {
    return after_all(colors & ((std::uint64_t{1} << color) - 1));
  }
  /// The turn that the body waits for.
  JFPX_HD std::uint32_t before_body() const { return after_all(colors); }
  JFPX_HD std::uint32_t after_body() const { return first + kPerSweep; }

 private:
  JFPX_HD std::uint32_t after_all(std::uint64_t set) const {
#if defined(__CUDA_ARCH__)
    return first + 64 - static_cast<std::uint32_t>(__clzll(static_cast<long long>(set)));
#else
    return first + static_cast<std::uint32_t>(std::bit_width(set));
#endif
  }
};

/// Number of cells of a vector.
inline constexpr int kVectorCells = 3 / kCellNumbers;

/// Motion that the rows of a body read: in float, with one access of memory.
struct alignas(64) MotionCells {
  Cell velocity[kVectorCells], angular_velocity[kVectorCells], shift[kVectorCells],
      rotation[kVectorCells];
};

/// Free motion, which a row reads only if it rebounds.
struct FreeCells {
  Cell velocity[kVectorCells], angular_velocity[kVectorCells];
};

/// Access to the motion of a body as cells. The cells of the velocities are written at each turn,
/// all others only when they change: the words of the velocities contain the versions of the other
/// cells that belong to them.
class BodyCells {
 public:
  /// Versions of the other vectors.
  struct Version {
    std::uint32_t shift = 0, rotation = 0, free = 0;
  };

  JFPX_HD BodyCells(MotionCells* motion, FreeCells* free) : motion_(motion), free_(free) {}

  /// The motion before the first turn.
  JFPX_HD void start(const soft_step::SolverBody& body, const soft_step::FreeMotion& free) const {
    Version version;
    write_shift(body, &version);
    write_rotation(body, &version);
    write_free(free, &version);
    write(0, body, version);
  }

  /// Reads the motion after a turn.
  /// @tparam kRotation whether to read the rotation
  /// @returns whether the turn has been made, and all of it is visible
  template <bool kRotation>
  JFPX_HD bool read(std::uint32_t turn, soft_step::SolverBody* body, Version* version) const {
    Read v, w, s, r;
    v.load(motion_->velocity);
    w.load(motion_->angular_velocity);
    s.load(motion_->shift);
    if constexpr (kRotation) r.load(motion_->rotation);
    const std::uint32_t word = v.get(&body->velocity);
    version->shift = word >> kTurnBits & kVersionMask;
    version->rotation = word >> (kTurnBits + kVersionBits) & kVersionMask;
    version->free = word >> (kTurnBits + 2 * kVersionBits) & kVersionMask;
    bool is_complete = (word & kTurnMask) == turn;
    is_complete = w.get(&body->angular_velocity) == word && is_complete;
    is_complete = s.get(&body->shift) == version->shift && is_complete;
    if constexpr (kRotation) {
      is_complete = r.get(&body->rotation) == version->rotation && is_complete;
    }
    return is_complete;
  }

  /// Writes the velocities after a turn. @param version of the shift and the rotation
  JFPX_HD void write(std::uint32_t turn, const soft_step::SolverBody& body,
                     const Version& version) const {
    const std::uint32_t word = turn | version.shift << kTurnBits |
                               version.rotation << (kTurnBits + kVersionBits) |
                               version.free << (kTurnBits + 2 * kVersionBits);
    store(motion_->velocity, body.velocity, word);
    store(motion_->angular_velocity, body.angular_velocity, word);
  }
  /// Write a new version, before the velocities.
  JFPX_HD void write_shift(const soft_step::SolverBody& body, Version* version) const {
    version->shift = (version->shift + 1) & kVersionMask;
    store(motion_->shift, body.shift, version->shift);
  }
  JFPX_HD void write_rotation(const soft_step::SolverBody& body, Version* version) const {
    version->rotation = (version->rotation + 1) & kVersionMask;
    store(motion_->rotation, body.rotation, version->rotation);
  }
  JFPX_HD void write_free(const soft_step::FreeMotion& free, Version* version) const {
    version->free = (version->free + 1) & kVersionMask;
    store(free_->velocity, free.velocity, version->free);
    store(free_->angular_velocity, free.angular_velocity, version->free);
  }
  /// Reads the free motion of a version that read() has returned. Its stores precede those of the
  /// velocities, so the wait is short.
  JFPX_HD soft_step::FreeMotion read_free(const Version& version) const {
    soft_step::FreeMotion free;
    Read v, w;
    do {
      v.load(free_->velocity);
      w.load(free_->angular_velocity);
    } while (v.get(&free.velocity) != version.free ||
             w.get(&free.angular_velocity) != version.free);
    return free;
  }

 private:
  static constexpr std::uint32_t kTurnBits = 14, kVersionBits = 6;
  static constexpr std::uint32_t kTurnMask = (1u << kTurnBits) - 1;
  static constexpr std::uint32_t kVersionMask = (1u << kVersionBits) - 1;
  static constexpr std::uint32_t kMixed = ~0u;  ///< its turn is higher than all turns
  // Versions may start again at 0, because no store is delayed for that many turns.
  static_assert((2 * kMaxSubsteps + 2) * Turns::kPerSweep < kTurnMask);

  struct Read {
    Cell cells[kVectorCells];
    JFPX_HD void load(const Cell* from) {
      for (int c = 0; c < kVectorCells; ++c) cells[c] = load_cell(from + c);
    }
    /// @returns the word of all cells, or kMixed
    JFPX_HD std::uint32_t get(Vec3* vector) const {
      *vector = {cells[0].numbers[0], cells[1 / kCellNumbers].numbers[1 % kCellNumbers],
                 cells[2 / kCellNumbers].numbers[2 % kCellNumbers]};
      std::uint32_t word = cells[0].sequence;
      for (int c = 1; c < kVectorCells; ++c) {
        if (cells[c].sequence != word) word = kMixed;
      }
      return word;
    }
  };
  JFPX_HD static void store(Cell* to, const Vec3& vector, std::uint32_t word) {
    const Real numbers[3] = {vector.x, vector.y, vector.z};
    for (int c = 0; c < kVectorCells; ++c) {
      Cell cell;
      for (int k = 0; k < kCellNumbers; ++k) cell.numbers[k] = numbers[c * kCellNumbers + k];
      cell.sequence = word;
      store_cell(to + c, cell);
    }
  }

  MotionCells* motion_;
  FreeCells* free_;
};

/// Constants of a body during a step, which its rows read.
struct alignas(16) RowBody {
  Real inverse_mass = 0;     ///< as SolverBody
  Real inverse_inertia = 0;  ///< as SolverBody
  std::uint64_t colors = 0;  ///< of the rows of its contacts
};

}  // namespace device
}  // namespace JFPX_ABI
}  // namespace jfpx

/// Fuzzer of World::restore(): bytes with a valid header and checksum are an InvalidSnapshot, or
/// the snapshot of a world that steps without an exception.
#include <jfpx/error.hpp>

#include "src/base/hash64.hpp"
#include "tests/fuzz/fuzz.hpp"
#include "tests/fuzz/world_input.hpp"

#include <algorithm>
#include <cstring>
#include <optional>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

using fuzz::require;
using test::Bytes;

constexpr std::size_t kHeader = 24, kChecksum = 8;

/// Makes the header and the checksum fit the content.
void seal(Snapshot* snapshot) {
  std::vector<std::byte>& bytes = snapshot->bytes;
  const std::uint64_t size = bytes.size() - kHeader - kChecksum;
  std::memcpy(bytes.data() + 16, &size, sizeof size);
  Hash64 hash;
  hash.add_bytes(bytes.data(), bytes.size() - kChecksum);
  const std::uint64_t checksum = hash.value();
  std::memcpy(bytes.data() + bytes.size() - kChecksum, &checksum, sizeof checksum);
}

/// Bytes that damages often leave behind, and any others.
std::byte draw_byte(Bytes& bytes) {
  constexpr std::uint8_t kEdgeCases[] = {0, 1, 2, 0x7f, 0x80, 0xc0, 0xfe, 0xff};
  if (bytes.chance(Real(0.5))) return std::byte{kEdgeCases[bytes.below(8)]};
  return static_cast<std::byte>(bytes.below(256));
}

void damage(Bytes& bytes, Snapshot* snapshot) {
  std::vector<std::byte>& content = snapshot->bytes;
  for (std::uint64_t n = bytes.below(4); n > 0; --n) {
    const std::size_t size = content.size() - kHeader - kChecksum;
    const std::size_t at = kHeader + bytes.below(65536) % size;
    const auto place = content.begin() + static_cast<std::ptrdiff_t>(at);
    const std::uint64_t kind = bytes.below(16);
    if (kind == 0 && size > 1) {
      content.erase(place);
    } else if (kind == 1) {
      content.insert(place, draw_byte(bytes));
    } else if (kind < 8) {
      const std::byte value = draw_byte(bytes);
      const std::size_t left = content.size() - kChecksum - at;
      std::fill_n(place, std::min<std::size_t>(left, 1 + bytes.below(8)), value);
    } else {
      *place = draw_byte(bytes);
    }
  }
  seal(snapshot);
}

void use(World& world) {
  for (int n = 0; n < 3; ++n) world.step();
  world.contact_events();
  world.cast_ray_through({.origin = {0, 9, 0}, .direction = {0, -1, 0}});
  if (!world.bodies().empty()) world.remove(world.bodies()[0]);
  world.add({});
  world.step();
}

}  // namespace
}  // namespace JFPX_ABI
}  // namespace jfpx

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace jfpx;
  test::Bytes bytes({data, size});
  const WorldSettings settings = fuzz::draw_settings(bytes);
  Scene scene = fuzz::draw_scene(bytes);
  scene.solver = bytes.chance(Real(0.7)) ? Solver::soft_step : Solver::worst_first;
  std::optional<World> world;
  try {
    world.emplace(scene, settings);
  } catch (const InvalidScene&) {
    return 0;
  }
  for (std::uint64_t n = bytes.below(3); n > 0; --n) {
    try {
      fuzz::add_drawn_force(bytes, *world);
    } catch (const InvalidArgument&) {
    }
    bytes.next();  // so that the next force is another one
  }
  for (std::uint64_t n = bytes.below(5); n > 0; --n) world->step();
  const Snapshot good = world->snapshot();
  for (int attempts = 0; attempts < 16 && !bytes.used_up(); ++attempts) {
    Snapshot bad = good;
    damage(bytes, &bad);
    try {
      world->restore(bad);
    } catch (const InvalidSnapshot&) {
      continue;
    }
    require(world->snapshot() == bad, "a snapshot is that of the world that it restores");
    // A large number of iterations is valid but would slow down the fuzzer.
    const Scene& restored = world->settings();
    const bool is_slow =
        restored.solver == Solver::worst_first && restored.resolver.max_iterations > 500;
    if (!is_slow) use(*world);
    world->restore(good);
  }
  require(world->snapshot() == good, "a snapshot that is refused changes nothing");
  return 0;
}

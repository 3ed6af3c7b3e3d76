/// States of a world as an array of NumPy, written by all ranks that hold the world. The format is
/// that of NumPy Enhancement Proposal 1, version 1.0.
#include <jfpx/error.hpp>
#include <jfpx/trajectory.hpp>
#include <jfpx/world.hpp>

#include "src/base/atomic_file.hpp"
#include "src/base/file.hpp"
#include "src/base/system.hpp"
#include "src/world/impl_access.hpp"
#include "src/world/world_impl.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

namespace fs = std::filesystem;

/// A body in the file.
struct Record {
  std::uint32_t index, generation;
  Real values[13];  ///< position, orientation, velocity, angular velocity
};
static_assert(sizeof(Record) == 8 + 13 * sizeof(Real), "the file has no padding");
/// Rows that a rank writes together: a multiple of pages.
constexpr std::size_t kRowsPerPart = 16384, kPage = 4096;
static_assert(kRowsPerPart * sizeof(Record) % kPage == 0);
/// A record in a message.
struct SentRecord {
  std::uint32_t row;  ///< of the part
  Record record;
};

Record make_record(BodyId id, const BodyState& s) {
  const Vec3 &x = s.position, &v = s.velocity, &w = s.angular_velocity;
  const Quat& q = s.orientation;
  return {
      id.index, id.generation, {x.x, x.y, x.z, q.w, q.x, q.y, q.z, v.x, v.y, v.z, w.x, w.y, w.z}};
}

std::string make_header(std::size_t bodies) {
  const std::string real = sizeof(Real) == 4 ? "'<f4'" : "'<f8'";
  std::string text = "{'descr': [('index', '<u4'), ('generation', '<u4')";
  for (const char* name : {"position", "orientation", "velocity", "angular_velocity"}) {
    const bool is_quaternion = std::string_view(name) == "orientation";
    text += ", ('" + std::string(name) + "', " + real + (is_quaternion ? ", (4,))" : ", (3,))");
  }
  text += "], 'fortran_order': False, 'shape': (" + std::to_string(bodies) + ",), }";
  constexpr std::size_t kStart = 10;
  text.append(kPage - 1 - (kStart + text.size()) % kPage, ' ');
  text += '\n';
  std::string header = "\x93NUMPY\x01";
  header += '\0';
  header += static_cast<char>(text.size() & 255);
  header += static_cast<char>(text.size() >> 8);
  return header + text;
}

std::string_view bytes_of(std::span<const Record> records) {
  return {reinterpret_cast<const char*>(records.data()), records.size_bytes()};
}

void write_alone(const World& world, const std::string& path) {
  AtomicFile file(path);
  const auto states = world.states();
  const std::span<const BodyId> ids = world.bodies();
  file.write(make_header(ids.size()));
  std::vector<Record> records;
  for (std::size_t first = 0; first < ids.size(); first += kRowsPerPart) {
    const std::size_t last = std::min(first + kRowsPerPart, ids.size());
    records.clear();
    for (std::size_t i = first; i < last; ++i) records.push_back(make_record(ids[i], states[i]));
    file.write(bytes_of(records));
  }
  file.finish();
}

/// A file that several ranks write: see AtomicFile. Failures are exceptions on all ranks.
class SharedFile {
 public:
  SharedFile(Domain* ranks, const std::string& path)
      : ranks_(ranks), path_(path), target_(follow_links(to_path(path))), part_(target_) {
    part_ += ".part";
  }

  /// Creates the file, which all ranks then open.
  void open(std::string_view header) {
    // Ranks cannot share a pipe, and a device must not be replaced.
    require(is_special(to_path(path_)) ? ESPIPE : 0);
    errno = 0;
    bool is_open = true;
    if (is_first()) is_open = static_cast<bool>(std::ofstream(part_, std::ios::binary));
    if (is_first() && is_open) is_open = open_part();
    if (is_first() && is_open) write(0, header);
    require(is_first() ? failure(is_open && stream_) : 0);
    errno = 0;
    require(is_first() ? 0 : failure(open_part()));
    errno = 0;
  }
  void write(std::uint64_t at, std::string_view bytes) {
    stream_.seekp(static_cast<std::streamoff>(at));
    stream_.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  }
  /// Renames the file when all ranks have written it.
  void finish() {
    stream_.flush();
    const int error = failure(static_cast<bool>(stream_));
    stream_.close();
    require(error != 0 ? error : failure(static_cast<bool>(stream_)));
    std::error_code renamed;
    if (is_first()) fs::rename(part_, target_, renamed);
    require(renamed ? renamed.default_error_condition().value() : 0);
  }

 private:
  bool is_first() const { return ranks_->rank() == 0; }
  bool open_part() {
    stream_.open(part_, std::ios::in | std::ios::out | std::ios::binary);
    return static_cast<bool>(stream_);
  }
  static int failure(bool is_good) { return is_good ? 0 : errno != 0 ? errno : EIO; }
  /// @param error of this rank, or 0 @throws FileError on all ranks if one has failed
  void require(int error) {
    const std::vector<int> all = ranks_->gather(error);
    const auto failed = std::ranges::find_if(all, [](int number) { return number != 0; });
    if (failed == all.end()) return;
    stream_.close();
    ranks_->gather(0);  // an open file cannot be removed on each system
    std::error_code ignored;
    if (is_first()) fs::remove(part_, ignored);
    throw FileError(file_message(path_, "can't be written", *failed));
  }

  Domain* ranks_;
  std::string path_;
  fs::path target_, part_;
  std::fstream stream_;
};

/// Each rank writes parts of consecutive rows, which begin at a page of the file: on a network file
/// system, pages that several hosts write may lose data.
void write_together(const WorldAccess::Impl& world, std::span<const BodyId> ids,
                    const std::string& path) {
  Domain& domain = world.ranks->domain();
  const std::span<const Domain::Rank> owners = domain.owners();
  // Bodies without an owner, which were added since the last step, are the same on all ranks.
  const auto is_mine = [&](std::size_t row) {
    const std::uint32_t body = ids[row].index;
    const bool is_common = body >= owners.size() || owners[body] == Domain::kEveryRank;
    return is_common ? domain.rank() == 0 : owners[body] == domain.rank();
  };
  const std::string header = make_header(ids.size());
  SharedFile file(&domain, path);
  file.open(header);
  std::vector<Record> part(kRowsPerPart);
  for (std::size_t round = 0; round < ids.size(); round += kRowsPerPart * domain.ranks()) {
    const std::span<Domain::Message> messages = domain.start_messages();
    std::size_t first_of_mine = 0, rows_of_mine = 0;
    for (std::size_t rank = 0; rank < domain.ranks(); ++rank) {
      const std::size_t first = std::min(round + rank * kRowsPerPart, ids.size());
      const std::size_t last = std::min(first + kRowsPerPart, ids.size());
      if (rank == domain.rank()) first_of_mine = first, rows_of_mine = last - first;
      for (std::size_t row = first; row < last; ++row) {
        if (!is_mine(row)) continue;
        const SentRecord item{static_cast<std::uint32_t>(row - first),
                              make_record(ids[row], world.store.state(ids[row].index))};
        if (rank == domain.rank()) {
          part[item.row] = item.record;
        } else {
          const auto* bytes = reinterpret_cast<const std::byte*>(&item);
          messages[rank].insert(messages[rank].end(), bytes, bytes + sizeof item);
        }
      }
    }
    for (const Domain::Message& message : domain.send()) {
      for (std::size_t at = 0; at < message.size(); at += sizeof(SentRecord)) {
        SentRecord item;
        std::memcpy(&item, message.data() + at, sizeof item);
        part[item.row] = item.record;
      }
    }
    file.write(header.size() + first_of_mine * sizeof(Record),
               bytes_of(std::span(part).first(rows_of_mine)));
  }
  file.finish();
}

}  // namespace

void write_states(const World& world, const std::string& path) {
  const WorldAccess::Impl& impl = WorldAccess::impl(world);
  if (impl.ranks == nullptr) return write_alone(world, path);
  write_together(impl, world.bodies(), path);
}

}  // namespace JFPX_ABI
}  // namespace jfpx

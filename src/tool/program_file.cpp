/// Reads the headers of ELF files (System V ABI, chapters 4 and 5).
#include "src/tool/program_file.hpp"

#include <array>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <elf.h>
#include <fstream>
#include <link.h>
#include <optional>
#include <sstream>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <sys/xattr.h>
#include <unistd.h>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {
namespace {

std::string path_of(const std::string& name) {
  if (name.find('/') != std::string::npos) return name;
  const char* const folders = std::getenv("PATH");
  std::istringstream list(folders != nullptr ? folders : "/bin:/usr/bin");
  for (std::string folder; std::getline(list, folder, ':');) {
    std::string path = (folder.empty() ? "." : folder) + "/" + name;
    if (access(path.c_str(), X_OK) == 0) return path;
  }
  return name;
}

/// Whether the kernel gives the program rights that the user does not have (ld.so(8),
/// secure-execution mode).
bool changes_rights(const std::string& path) {
  struct stat status {};
  struct statvfs system {};
  if (stat(path.c_str(), &status) != 0 || statvfs(path.c_str(), &system) != 0) return false;
  if ((system.f_flag & ST_NOSUID) != 0) return false;
  if ((status.st_mode & S_ISUID) != 0 && status.st_uid != getuid()) return true;
  if ((status.st_mode & S_ISGID) != 0 && status.st_gid != getgid()) return true;
  return getuid() != 0 && getxattr(path.c_str(), "security.capability", nullptr, 0) > 0;
}

/// A file that may be damaged.
class ElfFile {
 public:
  explicit ElfFile(const std::string& path) : stream_(path, std::ios::binary) {}

  template <class Record>
  std::optional<Record> read(std::uint64_t offset) {
    Record record;
    seek(offset);
    if (!stream_.read(reinterpret_cast<char*>(&record), sizeof record)) return std::nullopt;
    return record;
  }
  /// The characters up to the next zero.
  std::string text(std::uint64_t offset) {
    std::string text;
    seek(offset);
    std::getline(stream_, text, '\0');
    return text;
  }

 private:
  void seek(std::uint64_t offset) {
    stream_.clear();
    stream_.seekg(static_cast<std::streamoff>(offset));
  }

  std::ifstream stream_;
};

using Segments = std::vector<ElfW(Phdr)>;

Segments segments_of(ElfFile& file, const ElfW(Ehdr) & header) {
  Segments segments;
  for (unsigned i = 0; i < header.e_phnum; ++i) {
    const auto segment = file.read<ElfW(Phdr)>(header.e_phoff + i * sizeof(ElfW(Phdr)));
    if (segment) segments.push_back(*segment);
  }
  return segments;
}

/// The offset in the file of an address of the loaded program.
std::uint64_t offset_of(const Segments& segments, std::uint64_t address) {
  for (const ElfW(Phdr) & segment : segments) {
    if (segment.p_type != PT_LOAD || address < segment.p_vaddr) continue;
    if (address - segment.p_vaddr < segment.p_filesz) {
      return segment.p_offset + (address - segment.p_vaddr);
    }
  }
  return ~std::uint64_t{0};
}

std::vector<std::string> libraries_of(ElfFile& file, const Segments& segments,
                                      const ElfW(Phdr) & dynamic) {
  std::vector<std::uint64_t> names;
  std::uint64_t table = 0;
  for (std::uint64_t at = 0; at < dynamic.p_filesz; at += sizeof(ElfW(Dyn))) {
    const auto entry = file.read<ElfW(Dyn)>(dynamic.p_offset + at);
    if (!entry || entry->d_tag == DT_NULL) break;
    if (entry->d_tag == DT_NEEDED) names.push_back(entry->d_un.d_val);
    if (entry->d_tag == DT_STRTAB) table = offset_of(segments, entry->d_un.d_ptr);
  }
  std::vector<std::string> libraries;
  for (const std::uint64_t name : names) libraries.push_back(file.text(table + name));
  return libraries;
}

std::uint16_t machine_of_this_program() {
  ElfFile self("/proc/self/exe");
  const auto header = self.read<ElfW(Ehdr)>(0);
  return header ? header->e_machine : std::uint16_t{EM_NONE};
}

}  // namespace

ProgramFile read_program_file(const std::string& name) {
  ProgramFile program;
  const std::string path = path_of(name);
  program.ignores_preload = changes_rights(path);
  ElfFile file(path);
  const auto magic = file.read<std::array<char, EI_NIDENT>>(0);
  if (!magic || std::memcmp(magic->data(), ELFMAG, SELFMAG) != 0) return program;
  const auto header = file.read<ElfW(Ehdr)>(0);
  if (!header || header->e_machine != machine_of_this_program()) {
    program.is_of_this_machine = false;
    return program;
  }
  program.loads_libraries = false;
  const Segments segments = segments_of(file, *header);
  for (const ElfW(Phdr) & segment : segments) {
    if (segment.p_type == PT_INTERP) program.loads_libraries = true;
    if (segment.p_type != PT_DYNAMIC) continue;
    program.libraries = libraries_of(file, segments, segment);
  }
  return program;
}

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx

/// Reads PLY files (Turk 1994): elements with named properties, as text or binary.
#include <jfpx/error.hpp>

#include "src/tool/mesh_readers.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <optional>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {
namespace {

enum class PlyType : std::uint8_t { int8, uint8, int16, uint16, int32, uint32, float32, float64 };
constexpr std::size_t kPlySizes[] = {1, 1, 2, 2, 4, 4, 4, 8};

std::optional<PlyType> ply_type(std::string_view name) {
  constexpr std::array<std::string_view, 8> kNames{"char", "uchar", "short", "ushort",
                                                   "int",  "uint",  "float", "double"};
  constexpr std::array<std::string_view, 8> kSizedNames{"int8",  "uint8",  "int16",   "uint16",
                                                        "int32", "uint32", "float32", "float64"};
  for (std::uint8_t i = 0; i < kNames.size(); ++i) {
    if (name == kNames[i] || name == kSizedNames[i]) return PlyType{i};
  }
  return std::nullopt;
}

struct PlyProperty {
  std::string_view name;
  PlyType type = PlyType::float32;
  std::optional<PlyType> count_type;  ///< of a list
};
struct PlyElement {
  std::string_view name;
  std::uint64_t count = 0;
  std::vector<PlyProperty> properties;
};

class PlyReader {
 public:
  PlyReader(const std::string& path, std::string_view content) : path_(path), left_(content) {}

  TriangleMeshDef read() {
    read_header();
    TriangleMeshDef def;
    for (const PlyElement& element : elements_) {
      if (element.properties.empty()) continue;  // else any count would be read from nothing
      for (std::uint64_t i = 0; i < element.count; ++i) read_item(element, &def);
    }
    for (const Triangle& triangle : def.triangles) {
      for (const std::uint32_t i : triangle) {
        if (i >= def.vertices.size()) {
          fail("a face has the vertex " + std::to_string(i) + " of " +
               std::to_string(def.vertices.size()));
        }
      }
    }
    return def;
  }

 private:
  enum class Format : std::uint8_t { text, little, big };

  [[noreturn]] void fail(const std::string& what) const { throw FileError(path_ + ": " + what); }

  std::string_view line() {
    const std::size_t end = left_.find('\n');
    if (end == std::string_view::npos) fail("the header of the PLY file has no end");
    std::string_view text = left_.substr(0, end);
    left_.remove_prefix(end + 1);
    if (text.ends_with('\r')) text.remove_suffix(1);
    return text;
  }
  /// Removes the first word of a text.
  static std::string_view word(std::string_view* text) {
    constexpr std::string_view kSpace = " \t\r\n";
    text->remove_prefix(std::min(text->find_first_not_of(kSpace), text->size()));
    const std::string_view result = text->substr(0, text->find_first_of(kSpace));
    text->remove_prefix(result.size());
    return result;
  }

  void read_header() {
    if (line() != "ply") fail("the file is no PLY file: it does not begin with ply");
    bool has_format = false;
    for (;;) {
      std::string_view text = line();
      const std::string_view keyword = word(&text);
      if (keyword == "end_header") break;
      if (keyword == "format") {
        has_format = true;
        read_format(word(&text));
      } else if (keyword == "element") {
        PlyElement& element = elements_.emplace_back();
        element.name = word(&text);
        const std::string_view count = word(&text);
        const char* const end = count.data() + count.size();
        const auto [at, error] = std::from_chars(count.data(), end, element.count);
        if (error != std::errc() || at != end) fail("an element of the PLY file has no count");
      } else if (keyword == "property") {
        if (elements_.empty()) fail("a property of the PLY file has no element");
        elements_.back().properties.push_back(read_property(text));
      } else if (keyword != "comment" && keyword != "obj_info" && !keyword.empty()) {
        fail("the header of the PLY file has an unknown line: " + std::string(keyword));
      }
    }
    if (!has_format) fail("the header of the PLY file has no format");
  }
  void read_format(std::string_view name) {
    if (name == "ascii") {
      format_ = Format::text;
    } else if (name == "binary_little_endian") {
      format_ = Format::little;
    } else if (name == "binary_big_endian") {
      format_ = Format::big;
    } else {
      fail("the PLY file has the unknown format " + std::string(name));
    }
  }
  PlyProperty read_property(std::string_view text) const {
    const auto type = [&] {
      const std::string_view name = word(&text);
      const std::optional<PlyType> found = ply_type(name);
      if (!found) fail("a property of the PLY file has the unknown type " + std::string(name));
      return *found;
    };
    PlyProperty property;
    std::string_view rest = text;
    if (word(&rest) == "list") {
      text = rest;
      property.count_type = type();
    }
    property.type = type();
    property.name = word(&text);
    return property;
  }

  void read_item(const PlyElement& element, TriangleMeshDef* def) {
    const bool is_vertex = element.name == "vertex", is_face = element.name == "face";
    Vec3 position;
    for (const PlyProperty& property : element.properties) {
      if (!property.count_type) {
        const double value = number(property.type);
        for (int axis = 0; axis < 3; ++axis) {
          if (property.name == std::string_view("xyz").substr(static_cast<std::size_t>(axis), 1)) {
            position[axis] = static_cast<Real>(value);
          }
        }
        continue;
      }
      const bool is_corners =
          is_face && (property.name == "vertex_indices" || property.name == "vertex_index");
      const std::uint32_t count = index(number(*property.count_type));
      Triangle corners{};
      for (std::uint32_t k = 0; k < count; ++k) {
        const double value = number(property.type);
        if (!is_corners) continue;
        // The polygon is a fan around its first vertex.
        if (k < 3) {
          corners[k] = index(value);
        } else {
          corners = {corners[0], corners[2], index(value)};
        }
        if (k >= 2) def->triangles.push_back(corners);
      }
    }
    if (is_vertex) def->vertices.push_back(position);
  }
  std::uint32_t index(double value) const {
    if (!(value >= 0 && value < 4294967295.0)) fail("the PLY file has an index out of range");
    return static_cast<std::uint32_t>(value);
  }

  double number(PlyType type) {
    if (format_ == Format::text) {
      const std::string_view text = word(&left_);
      double value = 0;
      const char* const end = text.data() + text.size();
      const auto [at, error] = std::from_chars(text.data(), end, value);
      if (text.empty()) fail("the PLY file ends too early");
      if (error != std::errc() || at != end) {
        fail("the PLY file has \"" + std::string(text) + "\" instead of a number");
      }
      return value;
    }
    const std::size_t size = kPlySizes[static_cast<std::size_t>(type)];
    if (left_.size() < size) fail("the PLY file ends too early");
    std::array<char, 8> bytes{};
    std::copy_n(left_.data(), size, bytes.data());
    left_.remove_prefix(size);
    if (format_ == Format::big) std::reverse(bytes.begin(), bytes.begin() + size);
    switch (type) {
      case PlyType::int8:
        return as<std::int8_t>(bytes);
      case PlyType::uint8:
        return as<std::uint8_t>(bytes);
      case PlyType::int16:
        return as<std::int16_t>(bytes);
      case PlyType::uint16:
        return as<std::uint16_t>(bytes);
      case PlyType::int32:
        return as<std::int32_t>(bytes);
      case PlyType::uint32:
        return as<std::uint32_t>(bytes);
      case PlyType::float32:
        return static_cast<double>(as<float>(bytes));
      default:
        return as<double>(bytes);
    }
  }
  template <class T>
  static T as(const std::array<char, 8>& bytes) {
    static_assert(std::endian::native == std::endian::little);
    T value;
    std::memcpy(&value, bytes.data(), sizeof value);
    return value;
  }

  const std::string& path_;
  std::string_view left_;
  Format format_ = Format::text;
  std::vector<PlyElement> elements_;
};

}  // namespace

TriangleMeshDef read_ply(const std::string& path, std::string_view content) {
  return PlyReader(path, content).read();
}

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx

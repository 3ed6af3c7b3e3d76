/// Binary archives: values as a sequence of little-endian bytes without padding.
#pragma once

#include <jfpx/error.hpp>

#include "src/base/is.hpp"

#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

static_assert(std::endian::native == std::endian::little);

template <class T>
concept Scalar = (std::is_arithmetic_v<T> ||
                  std::is_enum_v<T>)&&!std::same_as<std::remove_const_t<T>, bool>;

// A function serialize(archive, value), constrained by Is<T>, defines the bytes of a type for all
// archives. Archives call it for values other than numbers and enumerations.

/// Appends values to a sequence of bytes.
class BinaryWriter {
 public:
  template <class... T>
  void operator()(const T&... values) {
    if constexpr ((Scalar<T> && ...)) {
      grow((sizeof values + ...));
      (put(values), ...);
    } else {
      (write(values), ...);
    }
  }
  /// The bytes written so far. The writer is empty afterwards.
  std::vector<std::byte> take() {
    bytes_.resize(std::exchange(size_, 0));
    return std::exchange(bytes_, {});
  }

 private:
  template <class T>
  void write(const T& value) {
    if constexpr (std::same_as<T, bool>) {
      (*this)(static_cast<std::uint8_t>(value));
    } else if constexpr (Scalar<T>) {
      (*this)(value);
    } else {
      serialize(*this, value);
    }
  }
  void grow(std::size_t size) {
    if (bytes_.size() - size_ < size) bytes_.resize(2 * bytes_.size() + size + 1024);
  }
  template <class T>
  void put(const T& value) {
    std::memcpy(bytes_.data() + size_, &value, sizeof value);
    size_ += sizeof value;
  }

  std::vector<std::byte> bytes_;  ///< capacity; the written part is shorter
  std::size_t size_ = 0;
};

/// Number of bytes that a BinaryWriter would write.
class BinarySize {
 public:
  template <class... T>
  void operator()(const T&... values) {
    (add(values), ...);
  }
  std::size_t value() const { return size_; }

 private:
  template <class T>
  void add(const T& value) {
    if constexpr (std::same_as<T, bool> || Scalar<T>) {
      size_ += sizeof value;
    } else {
      serialize(*this, value);
    }
  }
  std::size_t size_ = 0;
};

/// Reads values of a BinaryWriter. Accepts any bytes: bytes that no BinaryWriter produces cause an
/// InvalidSnapshot.
class BinaryReader {
 public:
  explicit BinaryReader(std::span<const std::byte> bytes) : left_(bytes) {}

  template <class... T>
  void operator()(T&... values) {
    if constexpr ((Scalar<T> && ...)) {
      const std::byte* from = take((sizeof values + ...));
      ((std::memcpy(&values, from, sizeof values), from += sizeof values), ...);
    } else {
      (read(values), ...);
    }
  }
  template <class T>
  T get() {
    T value{};
    read(value);
    return value;
  }
  std::size_t left() const { return left_.size(); }
  [[noreturn]] static void fail(const std::string& what) {
    throw InvalidSnapshot("the snapshot is corrupt: " + what);
  }
  static void require(bool holds, const char* otherwise) {
    if (!holds) fail(otherwise);
  }
  /// Reads a number of values, and checks that the remaining bytes can contain them, so that memory
  /// may be allocated. @param least minimum number of bytes of a value
  std::size_t count(std::size_t least) {
    const auto count = get<std::uint64_t>();
    if (count > left() / least) fail("it ends too early");
    return static_cast<std::size_t>(count);
  }

 private:
  template <class T>
  void read(T& value) {
    if constexpr (std::same_as<T, bool>) {
      const auto byte = get<std::uint8_t>();
      require(byte <= 1, "a truth value is neither 0 nor 1");
      value = byte != 0;
    } else if constexpr (Scalar<T>) {
      (*this)(value);
    } else {
      serialize(*this, value);
    }
  }
  const std::byte* take(std::size_t size) {
    if (left() < size) fail("it ends too early");
    const std::byte* const from = left_.data();
    left_ = left_.subspan(size);
    return from;
  }

  std::span<const std::byte> left_;
};

/// Number of bytes of a default value: the minimum for types with optional parts.
template <class T>
std::size_t least_size() {
  BinarySize size;
  size(T{});
  return size.value();
}

template <class T>
void serialize(auto& archive, const std::vector<T>& values) {
  archive(static_cast<std::uint64_t>(values.size()));
  for (const T& value : values) archive(value);
}
template <class T>
void serialize(BinaryReader& reader, std::vector<T>& values) {
  values.resize(reader.count(least_size<T>()));
  for (T& value : values) reader(value);
}

void serialize(auto& archive, const std::string& text) {
  archive(static_cast<std::uint64_t>(text.size()));
  for (const char c : text) archive(c);
}
inline void serialize(BinaryReader& reader, std::string& text) {
  text.resize(reader.count(1));
  for (char& c : text) reader(c);
}

void serialize(auto&, Is<std::monostate> auto&) {}

template <class T>
void serialize(auto& archive, const std::optional<T>& value) {
  archive(value.has_value());
  if (value) archive(*value);
}
template <class T>
void serialize(BinaryReader& reader, std::optional<T>& value) {
  value.reset();
  if (reader.get<bool>()) value = reader.get<T>();
}

template <class... T>
void serialize(auto& archive, const std::variant<T...>& value) {
  archive(static_cast<std::uint8_t>(value.index()));
  std::visit([&archive](const auto& alternative) { archive(alternative); }, value);
}
template <class... T>
void serialize(BinaryReader& reader, std::variant<T...>& value) {
  const std::size_t index = reader.get<std::uint8_t>();
  BinaryReader::require(index < sizeof...(T), "a value is of an unknown kind");
  std::size_t alternative = 0;
  ((alternative++ == index ? void(value = reader.get<T>()) : void()), ...);
}

}  // namespace JFPX_ABI
}  // namespace jfpx

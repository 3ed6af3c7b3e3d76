/// Contents of messages between ranks.
#pragma once

#include <jfpx/communicator.hpp>

#include <cstddef>
#include <cstring>
#include <span>
#include <type_traits>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// Appends the bytes of items to a message.
template <class T>
void append_items(Communicator::Message* message, std::span<const T> items) {
  static_assert(std::is_trivially_copyable_v<T>);
  if (items.empty()) return;
  const std::size_t before = message->size();
  message->resize(before + items.size_bytes());
  std::memcpy(message->data() + before, items.data(), items.size_bytes());
}
/// Appends a list with its length.
template <class T>
void append_list(Communicator::Message* message, const std::vector<T>& list) {
  const std::size_t count = list.size();
  append_items(message, std::span(&count, 1));
  append_items(message, std::span(list));
}

/// Reads a message from its start.
class MessageReader {
 public:
  explicit MessageReader(std::span<const std::byte> message) : left_(message) {}
  bool at_end() const { return left_.empty(); }
  template <class T>
  T get() {
    T item;
    copy_to(&item, 1);
    return item;
  }
  /// Reads what append_list() has written, and appends it to a list.
  template <class T>
  void append_to(std::vector<T>* list) {
    const std::size_t before = list->size(), count = get<std::size_t>();
    list->resize(before + count);
    copy_to(list->data() + before, count);
  }

 private:
  template <class T>
  void copy_to(T* items, std::size_t count) {
    static_assert(std::is_trivially_copyable_v<T>);
    if (count == 0) return;
    std::memcpy(items, left_.data(), count * sizeof(T));
    left_ = left_.subspan(count * sizeof(T));
  }

  std::span<const std::byte> left_;
};

}  // namespace JFPX_ABI
}  // namespace jfpx

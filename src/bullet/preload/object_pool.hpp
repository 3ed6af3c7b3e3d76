/// Thread-safe pool of objects that are borrowed for the duration of one call.
#pragma once

#include "src/bullet/failure.hpp"
#include "src/bullet/preload/own_stack.hpp"

#include <memory>
#include <mutex>
#include <new>
#include <utility>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// Holds one object for each concurrent call. An unmodified program may use its objects in several
/// threads, and their destruction is not observable. jfpx's objects are therefore independent of
/// them. Thread-safe.
template <class Object>
class ObjectPool {
 public:
  using Maker = std::unique_ptr<Object> (*)();

  explicit ObjectPool(Maker make) : make_(make) {}

  /// Borrows an object for its lifetime, and returns it even if an exception is thrown.
  class Handle {
   public:
    explicit Handle(ObjectPool& pool) : pool_(pool), object_(pool.take()) {}
    ~Handle() {
      if (object_ != nullptr) pool_.give_back(std::move(object_));
    }
    Handle(const Handle&) = delete;
    Handle& operator=(const Handle&) = delete;
    /// Null if no object could be created: see failure(); an allocation may also have failed.
    Object* get() const { return object_.get(); }

   private:
    ObjectPool& pool_;
    std::unique_ptr<Object> object_;
  };

  /// Calls visit(object) for every object that is not borrowed.
  template <class Visit>
  void for_each_idle(Visit visit) {
    const std::lock_guard lock(mutex_);
    for (const auto& object : idle_) visit(*object);
  }
  /// Reason why the pool can permanently create no objects; otherwise empty.
  std::string failure() {
    const std::lock_guard lock(mutex_);
    return failure_;
  }

 private:
  std::unique_ptr<Object> take() noexcept {
    const std::lock_guard lock(mutex_);
    if (!idle_.empty()) {
      std::unique_ptr<Object> object = std::move(idle_.back());
      idle_.pop_back();
      return object;
    }
    if (!failure_.empty()) return nullptr;
    std::unique_ptr<Object> object;
    preload::OwnStack::call([&] { object = make_object(); });
    return object;
  }
  std::unique_ptr<Object> make_object() noexcept {
    try {
      idle_.reserve(created_ + 1);
      std::unique_ptr<Object> object = make_();
      bind_aligned_new();
      ++created_;
      return object;
    } catch (const std::exception& error) {
      if (!is_out_of_memory(error)) failure_ = message_of(error);
      return nullptr;
    }
  }
  /// The run-time linker binds the functions that operator new calls at the first call, which takes
  /// some kilobytes of stack.
  static void bind_aligned_new() {
    constexpr std::align_val_t kAlignment{64};
    ::operator delete(::operator new(64, kAlignment), kAlignment);
  }
  void give_back(std::unique_ptr<Object> object) noexcept {
    const std::lock_guard lock(mutex_);
    idle_.push_back(std::move(object));  // take() has reserved the capacity
  }

  Maker make_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<Object>> idle_;
  std::size_t created_ = 0;
  std::string failure_;
};

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx

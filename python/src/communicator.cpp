/// PythonCommunicator.
#include "python/src/communicator.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace python {
namespace {

/// Python's global lock, and the mark of a world in use, for a call of a communicator.
class CommunicatorCall {
 public:
  explicit CommunicatorCall(std::atomic<bool>* in_use)
      : in_use_(in_use), was_in_use_(in_use->exchange(true)) {}
  ~CommunicatorCall() { *in_use_ = was_in_use_; }
  CommunicatorCall(const CommunicatorCall&) = delete;
  CommunicatorCall& operator=(const CommunicatorCall&) = delete;

 private:
  nb::gil_scoped_acquire acquire_;
  std::atomic<bool>* in_use_;
  bool was_in_use_;
};

/// Objects `memoryview` of messages.
class MessageViews {
 public:
  MessageViews() = default;
  ~MessageViews() {
    for (const nb::object& view : views_) {
      if (!try_release(view)) PyErr_Clear();
    }
  }
  MessageViews(const MessageViews&) = delete;
  MessageViews& operator=(const MessageViews&) = delete;

  nb::object add(std::span<const std::byte> message) {
    return add(const_cast<std::byte*>(message.data()), message.size(), PyBUF_READ);
  }
  nb::object add_writable(std::span<std::byte> message) {
    return add(message.data(), message.size(), PyBUF_WRITE);
  }
  /// Makes the views invalid. @throws nb::python_error if one of them is in use
  void release() {
    while (!views_.empty()) {
      const nb::object view = std::move(views_.back());
      views_.pop_back();
      if (!try_release(view)) throw nb::python_error();
    }
  }

 private:
  nb::object add(std::byte* data, std::size_t size, int access) {
    static std::byte empty{};  // Python refuses null
    void* const memory = data == nullptr ? &empty : data;
    PyObject* const view =
        PyMemoryView_FromMemory(static_cast<char*>(memory), static_cast<Py_ssize_t>(size), access);
    if (view == nullptr) throw nb::python_error();
    views_.push_back(nb::steal(view));
    return views_.back();
  }
  static bool try_release(const nb::object& view) {
    PyObject* const result = PyObject_CallMethod(view.ptr(), "release", nullptr);
    Py_XDECREF(result);
    return result != nullptr;
  }

  std::vector<nb::object> views_;
};

void copy_bytes(nb::handle object, Communicator::Message* message) {
  Py_buffer buffer;
  if (PyObject_GetBuffer(object.ptr(), &buffer, PyBUF_SIMPLE) != 0) throw nb::python_error();
  struct ReleaseBuffer {
    Py_buffer* buffer;
    ~ReleaseBuffer() { PyBuffer_Release(buffer); }
  } const release{&buffer};
  const auto* const first = static_cast<const std::byte*>(buffer.buf);
  message->assign(first, first + buffer.len);
}

}  // namespace

void PythonCommunicator::exchange(std::span<const Message> sent, std::span<Message> received) {
  const CommunicatorCall call(in_use_);
  MessageViews views;
  nb::list messages;
  for (const Message& message : sent) messages.append(views.add(message));
  const nb::object result = object_.attr("exchange")(messages);
  views.release();
  if (const std::size_t count = nb::len(result); count != size_) {
    throw InvalidArgument("exchange() of the communicator returned " + std::to_string(count) +
                          " messages; there must be one from each of " + std::to_string(size_) +
                          " ranks");
  }
  for (std::uint32_t r = 0; r < size_; ++r) {
    received[r].clear();
    if (r != rank_) copy_bytes(nb::object(result[r]), &received[r]);
  }
}

void PythonCommunicator::exchange_sized(std::span<const std::span<const std::byte>> sent,
                                        std::span<const std::span<std::byte>> received) {
  const CommunicatorCall call(in_use_);
  MessageViews views;
  nb::list from, to;
  for (const std::span<const std::byte> message : sent) from.append(views.add(message));
  for (const std::span<std::byte> message : received) to.append(views.add_writable(message));
  object_.attr("exchange_sized")(from, to);
  views.release();
}

void PythonCommunicator::gather(std::span<const std::byte> own, std::span<std::byte> all) {
  const CommunicatorCall call(in_use_);
  MessageViews views;
  object_.attr("gather")(views.add(own), views.add_writable(all));
  views.release();
}

}  // namespace python
}  // namespace JFPX_ABI
}  // namespace jfpx

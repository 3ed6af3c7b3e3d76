/// Implementation of system.hpp and atomic_wait.hpp for Windows, by its functions for UTF-16.
#include <jfpx/error.hpp>

#include "src/base/atomic_wait.hpp"
#include "src/base/system.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <cwchar>
#include <fcntl.h>
#include <io.h>
#include <limits>
#include <process.h>
#include <system_error>
#include <thread>
#include <vector>

#ifndef NOMINMAX
#define NOMINMAX
#endif
#include <windows.h>
// after windows.h
#include <shellapi.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

namespace fs = std::filesystem;

std::wstring widened(const char* text) {
  std::wstring wide;
  for (; *text != '\0'; ++text) wide += static_cast<wchar_t>(*text);
  return wide;
}

/// An argument as the C run-time library of the started program parses it: quoted, with each
/// backslash before a quotation mark doubled.
std::wstring quoted(const std::wstring& argument) {
  std::wstring text = L"\"";
  std::size_t backslashes = 0;
  for (const wchar_t c : argument) {
    if (c == L'"') text.append(backslashes + 1, L'\\');
    backslashes = c == L'\\' ? backslashes + 1 : 0;
    text += c;
  }
  return text.append(backslashes, L'\\') + L'"';
}

}  // namespace

const char* const kCacheFolderVariable = "LOCALAPPDATA";

fs::path to_path(const std::string& text) {
  try {
    return std::u8string(text.begin(), text.end());
  } catch (const fs::filesystem_error&) {
    throw FileError(text + ": its name is not UTF-8");
  }
}
std::string to_text(const fs::path& path) {
  const std::u8string text = path.u8string();
  return {text.begin(), text.end()};
}

std::FILE* open_file(const std::string& path, const char* mode) {
  return ::_wfopen(to_path(path).c_str(), widened(mode).c_str());
}

fs::path cache_folder() {
  const wchar_t* const value = ::_wgetenv(L"LOCALAPPDATA");
  if (value == nullptr || !fs::path(value).is_absolute()) return {};
  return value;
}

void wait_while_equal(const std::atomic<std::uint32_t>& value, std::uint32_t old) noexcept {
  static_assert(sizeof value == sizeof old);
  while (value.load(std::memory_order_acquire) == old) {
    auto* const address = const_cast<std::atomic<std::uint32_t>*>(&value);  // for the declaration
    ::WaitOnAddress(address, &old, sizeof old, INFINITE);
  }
}
void wake_one(std::atomic<std::uint32_t>& value) noexcept { ::WakeByAddressSingle(&value); }
void wake_all(std::atomic<std::uint32_t>& value) noexcept { ::WakeByAddressAll(&value); }

// Large pages take a privilege and are locked in memory.
void advise_huge_pages(void*, std::size_t) noexcept {}

std::uint64_t physical_memory() noexcept {
  MEMORYSTATUSEX status{};
  status.dwLength = sizeof status;
  return ::GlobalMemoryStatusEx(&status) != 0 ? status.ullTotalPhys : 0;
}

unsigned usable_cores() noexcept { return std::max(1u, std::thread::hardware_concurrency()); }
unsigned cores_of_quotas(const std::string&) noexcept {
  return std::numeric_limits<unsigned>::max();
}

// _isatty() is also true of the device NUL.
bool is_terminal(std::FILE* stream) noexcept {
  DWORD mode = 0;
  const auto handle = reinterpret_cast<HANDLE>(::_get_osfhandle(::_fileno(stream)));
  return handle != INVALID_HANDLE_VALUE && ::GetConsoleMode(handle, &mode) != 0;
}

std::vector<std::string> start_program(int, char**) {
  static UINT code_page = ::GetConsoleOutputCP();  // 0 without a console
  if (code_page != 0 && ::SetConsoleOutputCP(CP_UTF8) != 0) {
    std::atexit([] { ::SetConsoleOutputCP(code_page); });
  }
  ::_setmode(::_fileno(stdout), _O_BINARY);
  int count = 0;
  wchar_t** const words = ::CommandLineToArgvW(::GetCommandLineW(), &count);
  std::vector<std::string> arguments;
  for (int i = 1; i < count; ++i) arguments.push_back(to_text(words[i]));
  ::LocalFree(words);
  return arguments;
}

fs::path program_path() {
  std::wstring path(MAX_PATH, L'\0');
  for (;;) {
    const DWORD length =
        ::GetModuleFileNameW(nullptr, path.data(), static_cast<DWORD>(path.size()));
    if (length == 0) {
      const std::error_code error(static_cast<int>(::GetLastError()), std::system_category());
      throw fs::filesystem_error("the file of the program is not known", error);
    }
    if (length < path.size()) return path.substr(0, length);
    path.resize(2 * path.size());
  }
}

// _wexecv() returns to the shell before the program ends.
std::string run_instead(const fs::path& program, const std::vector<std::string>& arguments) {
  std::vector<std::wstring> texts = {quoted(program.wstring())};
  for (const std::string& argument : arguments)
    texts.push_back(quoted(to_path(argument).wstring()));
  std::vector<const wchar_t*> pointers;
  for (const std::wstring& text : texts) pointers.push_back(text.c_str());
  pointers.push_back(nullptr);
  // Ctrl-C is for the other program, which inherits no handler. This one waits for its end.
  ::SetConsoleCtrlHandler(
      [](DWORD event) -> BOOL { return event == CTRL_C_EVENT || event == CTRL_BREAK_EVENT; }, TRUE);
  const std::intptr_t status = ::_wspawnv(_P_WAIT, program.c_str(), pointers.data());
  if (status == -1) return std::strerror(errno);
  std::exit(static_cast<int>(status));
}

}  // namespace JFPX_ABI
}  // namespace jfpx

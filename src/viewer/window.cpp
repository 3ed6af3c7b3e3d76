/// A window with an OpenGL 3.3 context, or a context without a visible window.
#include "src/viewer/window.hpp"

#include <jfpx/error.hpp>

#include "src/base/sanitizers.hpp"

#include <epoxy/gl.h>

#include <cstring>
#include <string_view>

#if defined(__linux__)
#include <dlfcn.h>
#include <link.h>
#endif

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {
namespace {

constexpr Uint32 kPause = 8;  // [ms] between pictures without vertical synchronization

[[noreturn]] void refuse(const char* what) {
  throw BackendUnavailable(std::string(what) + ": " + SDL_GetError());
}

struct Extent {
  int width = 0, height = 0;
};
/// The size of a window, in the units or pixels of `query`.
Extent size_by(void (*query)(SDL_Window*, int*, int*), SDL_Window* window) {
  Extent extent;
  query(window, &extent.width, &extent.height);
  return extent;
}

/// Keeps the driver loaded: Mesa frees its memory only when the driver is unloaded, or never. The
/// leak sanitizer then reports only leaks of this project.
void keep_driver_for_leak_sanitizer() {
#if defined(__linux__)
  if (!kAddressSanitizer) return;
  const auto keep = [](dl_phdr_info* library, std::size_t, void*) {
    for (const char* driver : {"_dri.so", "libEGL_mesa.so"}) {
      if (std::strstr(library->dlpi_name, driver) == nullptr) continue;
      dlopen(library->dlpi_name, RTLD_LAZY | RTLD_NOLOAD | RTLD_NODELETE);
    }
    return 0;
  };
  dl_iterate_phdr(keep, nullptr);
#endif
}

/// True if SDL has taken a driver that shows nothing, without being told to by SDL_VIDEODRIVER: its
/// last resort where it finds no display.
bool shows_nothing() {
  const char* driver = SDL_GetCurrentVideoDriver();
  if (driver == nullptr || SDL_GetHint(SDL_HINT_VIDEODRIVER) != nullptr) return false;
  const std::string_view name = driver;
  return name == "offscreen" || name == "dummy" || name == "evdev";
}

}  // namespace

int Window::started_ = 0;

void Window::Quit::operator()(int*) const { SDL_Quit(); }

Window::Window(const std::string& title, int width, int height, bool visible) {
  SDL_SetMainReady();
  if (SDL_Init(SDL_INIT_VIDEO) != 0) refuse("the viewer found no display");
  library_.reset(&started_);
  if (visible && shows_nothing()) {
    throw BackendUnavailable("the viewer found no display; --headless draws pictures without one");
  }
  SDL_GL_SetAttribute(SDL_GL_CONTEXT_MAJOR_VERSION, 3);
  SDL_GL_SetAttribute(SDL_GL_CONTEXT_MINOR_VERSION, 3);
  SDL_GL_SetAttribute(SDL_GL_CONTEXT_PROFILE_MASK, SDL_GL_CONTEXT_PROFILE_CORE);
  SDL_GL_SetAttribute(SDL_GL_DOUBLEBUFFER, 1);
  const Uint32 flags =
      SDL_WINDOW_OPENGL | (visible ? Uint32{SDL_WINDOW_RESIZABLE | SDL_WINDOW_ALLOW_HIGHDPI}
                                   : Uint32{SDL_WINDOW_HIDDEN});
  window_.reset(SDL_CreateWindow(title.c_str(), SDL_WINDOWPOS_CENTERED, SDL_WINDOWPOS_CENTERED,
                                 width, height, flags));
  if (window_ == nullptr) refuse("the viewer can't open a window with OpenGL");
  keep_driver_for_leak_sanitizer();
  SDL_GL_SetAttribute(SDL_GL_CONTEXT_RESET_NOTIFICATION, SDL_GL_CONTEXT_RESET_LOSE_CONTEXT);
  context_.reset(SDL_GL_CreateContext(window_.get()));
  if (context_ == nullptr) {  // some drivers can't report resets
    SDL_GL_SetAttribute(SDL_GL_CONTEXT_RESET_NOTIFICATION, SDL_GL_CONTEXT_RESET_NO_NOTIFICATION);
    context_.reset(SDL_GL_CreateContext(window_.get()));
  }
  if (context_ == nullptr) refuse("the viewer needs OpenGL 3.3");
  if (epoxy_gl_version() < 33) {
    throw BackendUnavailable("the viewer needs OpenGL 3.3; this driver has " +
                             std::to_string(epoxy_gl_version() / 10) + "." +
                             std::to_string(epoxy_gl_version() % 10));
  }
  synchronised_ = SDL_GL_SetSwapInterval(1) == 0;
}

Window Window::open(const std::string& title, int width, int height) {
  return {title, width, height, true};
}

Window Window::hidden() {
  // Requires no X server. SDL_VIDEODRIVER in the environment takes precedence.
  SDL_SetHintWithPriority(SDL_HINT_VIDEODRIVER, "offscreen", SDL_HINT_DEFAULT);
  return {"jfpx", 16, 16, false};
}

bool Window::reports_resets() const {
  return epoxy_gl_version() >= 45 || epoxy_has_gl_extension("GL_KHR_robustness");
}

void Window::check_context() const {
  if (!reports_resets() || glGetGraphicsResetStatus() == GL_NO_ERROR) return;
  throw BackendUnavailable("OpenGL lost its context: the graphics device was reset");
}

void Window::swap() {  // NOLINT(bugprone-exception-escape): buffers, not windows
  check_context();
  SDL_GL_SwapWindow(window_.get());
  if (!synchronised_) SDL_Delay(kPause);
}
void Window::set_title(const std::string& title) {
  SDL_SetWindowTitle(window_.get(), title.c_str());
}
void Window::set_fullscreen(bool on) {
  if (SDL_SetWindowFullscreen(window_.get(), on ? SDL_WINDOW_FULLSCREEN_DESKTOP : 0) == 0) {
    fullscreen_ = on;
  }
}
void Window::capture_mouse(bool on) { SDL_SetRelativeMouseMode(on ? SDL_TRUE : SDL_FALSE); }

int Window::width() const { return size_by(SDL_GetWindowSize, window_.get()).width; }
int Window::height() const { return size_by(SDL_GetWindowSize, window_.get()).height; }
bool Window::minimised() const {
  return (SDL_GetWindowFlags(window_.get()) & SDL_WINDOW_MINIMIZED) != 0 || pixel_width() == 0 ||
         pixel_height() == 0;
}
int Window::pixel_width() const { return size_by(SDL_GL_GetDrawableSize, window_.get()).width; }
int Window::pixel_height() const { return size_by(SDL_GL_GetDrawableSize, window_.get()).height; }
float Window::pixel_ratio() const {
  return width() > 0 ? static_cast<float>(pixel_width()) / static_cast<float>(width()) : 1.0f;
}
std::string Window::driver() const {
  const auto* name = reinterpret_cast<const char*>(glGetString(GL_RENDERER));
  return name != nullptr ? name : "unknown";
}

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx

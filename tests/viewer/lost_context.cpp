/// Loaded into jfpx-view: a graphics device that is reset after as many questions for its health as
/// JFPX_TEST_HEALTHY says.
#include <epoxy/gl.h>

#include <cstdlib>

namespace {

long healthy = 0;

GLenum health() { return healthy-- > 0 ? GL_NO_ERROR : GL_UNKNOWN_CONTEXT_RESET; }

[[gnu::constructor]] void stand_in() {
  if (const char* text = std::getenv("JFPX_TEST_HEALTHY")) healthy = std::atol(text);
  epoxy_glGetGraphicsResetStatus = health;
}

}  // namespace

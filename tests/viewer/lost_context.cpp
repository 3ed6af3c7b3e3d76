/// Preloaded into jfpx-view: simulates a reset of the graphics device after JFPX_TEST_HEALTHY
/// successful queries of its status.
#include <epoxy/gl.h>

#include <cstdlib>

namespace {

long healthy = 0;

GLenum health() { return healthy-- > 0 ? GL_NO_ERROR : GL_UNKNOWN_CONTEXT_RESET; }

[[gnu::constructor]] void replace_status_query() {
  if (const char* text = std::getenv("JFPX_TEST_HEALTHY")) healthy = std::atol(text);
  epoxy_glGetGraphicsResetStatus = health;
}

}  // namespace

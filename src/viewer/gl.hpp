/// RAII wrappers of OpenGL objects.
#pragma once

#include <jfpx/config.hpp>

#include <epoxy/gl.h>

#include <string_view>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

/// Owns one OpenGL name. Its context must be current on destruction.
template <void (*release)(GLuint)>
class GlName {
 public:
  GlName() = default;
  explicit GlName(GLuint name) : name_(name) {}
  GlName(GlName&& other) noexcept : name_(std::exchange(other.name_, 0)) {}
  GlName& operator=(GlName&& other) noexcept {
    std::swap(name_, other.name_);
    return *this;
  }
  ~GlName() {
    if (name_ != 0) release(name_);
  }
  GLuint name() const { return name_; }

 private:
  GLuint name_ = 0;
};

// Wrappers, because epoxy's functions are pointers that are set on the first call.
inline void release_buffer(GLuint name) { glDeleteBuffers(1, &name); }
inline void release_array(GLuint name) { glDeleteVertexArrays(1, &name); }
inline void release_texture(GLuint name) { glDeleteTextures(1, &name); }
inline void release_renderbuffer(GLuint name) { glDeleteRenderbuffers(1, &name); }
inline void release_framebuffer(GLuint name) { glDeleteFramebuffers(1, &name); }
inline void release_program(GLuint name) { glDeleteProgram(name); }

using GlBuffer = GlName<release_buffer>;
using GlVertexArray = GlName<release_array>;
using GlTexture = GlName<release_texture>;
using GlRenderbuffer = GlName<release_renderbuffer>;
using GlFramebuffer = GlName<release_framebuffer>;

GlBuffer make_buffer();
GlVertexArray make_vertex_array();
/// A texture without filtering.
GlTexture make_texture(GLenum format, int width, int height);
/// @param samples number of samples per pixel; 0 or 1: not multisampled
GlRenderbuffer make_renderbuffer(GLenum format, int width, int height, int samples);
/// A framebuffer with two textures; `colour` may be 0.
/// @throws BackendUnavailable if the driver rejects it
GlFramebuffer make_framebuffer(GLuint colour, GLuint depth);

/// A linked program. The sources follow `#version 330 core` and the declarations of frame.glsl.
class GlProgram {
 public:
  /// @param defines lines that precede the sources, for example "#define SHADOW_PASS\n"
  /// @throws BackendUnavailable with the driver's message if it does not compile or link.
  GlProgram(std::string_view vertex, std::string_view fragment, std::string_view defines = "");
  void use() const { glUseProgram(program_.name()); }
  /// Location of a uniform, or -1, which OpenGL ignores. The name must be null-terminated.
  GLint at(const char* uniform) const { return glGetUniformLocation(program_.name(), uniform); }

 private:
  GlName<release_program> program_;
};

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx

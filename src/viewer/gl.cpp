/// RAII wrappers of OpenGL objects.
#include "src/viewer/gl.hpp"

#include <jfpx/error.hpp>

#include "src/viewer/frame_block.hpp"
#include "src/viewer/shaders.hpp"

#include <array>
#include <string>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {
namespace {

std::string log_of(GLuint shader) {
  std::array<char, 2048> text{};
  glGetShaderInfoLog(shader, static_cast<GLsizei>(text.size()), nullptr, text.data());
  return text.data();
}

void attach(GLuint program, GLenum stage, std::string_view defines, std::string_view source) {
  std::string head = "#version 330 core\n#define MAX_TAPS " + std::to_string(kMaxTaps) + "\n";
  if (epoxy_has_gl_extension("GL_ARB_conservative_depth")) {
    head += "#extension GL_ARB_conservative_depth : enable\n";
  }
  const GLuint shader = glCreateShader(stage);
  const std::array<const char*, 4> parts = {head.data(), defines.data(), shaders::frame.data(),
                                            source.data()};
  const std::array<GLint, 4> sizes = {
      static_cast<GLint>(head.size()), static_cast<GLint>(defines.size()),
      static_cast<GLint>(shaders::frame.size()), static_cast<GLint>(source.size())};
  glShaderSource(shader, 4, parts.data(), sizes.data());
  glCompileShader(shader);
  glAttachShader(program, shader);
  glDeleteShader(shader);  // deleted with the program
  GLint compiled = 0;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &compiled);
  if (compiled == GL_FALSE) throw BackendUnavailable("OpenGL rejects a shader: " + log_of(shader));
}

}  // namespace

GlBuffer make_buffer() {
  GLuint name = 0;
  glGenBuffers(1, &name);
  return GlBuffer(name);
}

GlVertexArray make_vertex_array() {
  GLuint name = 0;
  glGenVertexArrays(1, &name);
  return GlVertexArray(name);
}

GlTexture make_texture(GLenum format, int width, int height) {
  GLuint name = 0;
  glGenTextures(1, &name);
  glBindTexture(GL_TEXTURE_2D, name);
  const bool depth = format == GL_DEPTH_COMPONENT32F;
  glTexImage2D(GL_TEXTURE_2D, 0, static_cast<GLint>(format), width, height, 0,
               depth ? GL_DEPTH_COMPONENT : GL_RGBA, GL_FLOAT, nullptr);
  for (const GLenum filter : {GLenum{GL_TEXTURE_MIN_FILTER}, GLenum{GL_TEXTURE_MAG_FILTER}}) {
    glTexParameteri(GL_TEXTURE_2D, filter, GL_NEAREST);
  }
  for (const GLenum wrap : {GLenum{GL_TEXTURE_WRAP_S}, GLenum{GL_TEXTURE_WRAP_T}}) {
    glTexParameteri(GL_TEXTURE_2D, wrap, GL_CLAMP_TO_EDGE);
  }
  return GlTexture(name);
}

GlRenderbuffer make_renderbuffer(GLenum format, int width, int height, int samples) {
  GLuint name = 0;
  glGenRenderbuffers(1, &name);
  glBindRenderbuffer(GL_RENDERBUFFER, name);
  glRenderbufferStorageMultisample(GL_RENDERBUFFER, samples > 1 ? samples : 0, format, width,
                                   height);
  return GlRenderbuffer(name);
}

GlFramebuffer make_framebuffer(GLuint colour, GLuint depth) {
  GLuint name = 0;
  glGenFramebuffers(1, &name);
  GlFramebuffer framebuffer(name);
  glBindFramebuffer(GL_FRAMEBUFFER, name);
  if (colour != 0) {
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, colour, 0);
  } else {
    glDrawBuffer(GL_NONE);
    glReadBuffer(GL_NONE);
  }
  if (depth != 0) {
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, depth, 0);
  }
  if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) {
    throw BackendUnavailable("OpenGL rejects a framebuffer of the viewer");
  }
  return framebuffer;
}

GlProgram::GlProgram(std::string_view vertex, std::string_view fragment, std::string_view defines)
    : program_(glCreateProgram()) {
  attach(program_.name(), GL_VERTEX_SHADER, defines, vertex);
  attach(program_.name(), GL_FRAGMENT_SHADER, defines,
         std::string(shaders::lighting) + std::string(fragment));
  glLinkProgram(program_.name());
  GLint linked = 0;
  glGetProgramiv(program_.name(), GL_LINK_STATUS, &linked);
  if (linked == GL_FALSE) {
    std::array<char, 2048> text{};
    glGetProgramInfoLog(program_.name(), static_cast<GLsizei>(text.size()), nullptr, text.data());
    throw BackendUnavailable(std::string("OpenGL rejects a program: ") + text.data());
  }
  const GLuint block = glGetUniformBlockIndex(program_.name(), "Frame");
  if (block != GL_INVALID_INDEX) glUniformBlockBinding(program_.name(), block, 0);
  use();
  glUniform1i(at("shadow_map"), 0);
  glUniform1i(at("occlusion_map"), 1);
}

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx

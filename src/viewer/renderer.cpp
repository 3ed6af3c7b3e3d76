/// OpenGL 3.3 renderer. Its passes are shadow map, depth and normals, ambient occlusion, colour,
/// and tone mapping.
#include "src/viewer/renderer.hpp"

#include <jfpx/error.hpp>

#include "src/viewer/draw_order.hpp"
#include "src/viewer/frame_block.hpp"
#include "src/viewer/instances.hpp"
#include "src/viewer/mesh_models.hpp"
#include "src/viewer/resident_spheres.hpp"
#include "src/viewer/shaders.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {
namespace {

enum Pass { kShadowPass, kGeometryPass, kColourPass, kPasses };
constexpr const char* kPassDefines[kPasses] = {"#define SHADOW_PASS\n", "#define GEOMETRY_PASS\n",
                                               "#define COLOUR_PASS\n"};

/// Render targets of one size.
struct Targets {
  int width, height;
  GlTexture normals, depth, occlusion, blurred, light;
  GlRenderbuffer many_colours, many_depths;
  GlFramebuffer geometry, occlusion_target, blur_target, light_target, many;

  Targets(int w, int h, int samples)
      : width(w),
        height(h),
        normals(make_texture(GL_RGBA16F, w, h)),
        depth(make_texture(GL_DEPTH_COMPONENT32F, w, h)),
        occlusion(make_texture(GL_R16F, w, h)),
        blurred(make_texture(GL_R16F, w, h)),
        light(make_texture(GL_RGBA16F, w, h)),
        many_colours(make_renderbuffer(GL_RGBA16F, w, h, samples)),
        many_depths(make_renderbuffer(GL_DEPTH_COMPONENT32F, w, h, samples)),
        geometry(make_framebuffer(normals.name(), depth.name())),
        occlusion_target(make_framebuffer(occlusion.name(), 0)),
        blur_target(make_framebuffer(blurred.name(), 0)),
        light_target(make_framebuffer(light.name(), 0)) {
    GLuint name = 0;
    glGenFramebuffers(1, &name);
    many = GlFramebuffer(name);
    glBindFramebuffer(GL_FRAMEBUFFER, name);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER,
                              many_colours.name());
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER,
                              many_depths.name());
    if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) {
      throw BackendUnavailable("OpenGL rejects a multisampled framebuffer of " + std::to_string(w) +
                               " x " + std::to_string(h));
    }
  }
};

struct ShadowMap {
  int size;
  GlTexture depth;
  GlFramebuffer target;
  explicit ShadowMap(int edge)
      : size(edge),
        depth(make_texture(GL_DEPTH_COMPONENT32F, edge, edge)),
        target(make_framebuffer(0, depth.name())) {}
};

GlProgram pass_program(std::string_view vertex, std::string_view fragment, Pass pass,
                       bool smooth = false) {
  return {vertex, fragment,
          std::string(kPassDefines[pass]) + (smooth ? "#define SMOOTH_EDGES\n" : "")};
}

void bind_texture(GLenum unit, const GlTexture& texture) {
  glActiveTexture(unit);
  glBindTexture(GL_TEXTURE_2D, texture.name());
}

void draw_screen() { glDrawArrays(GL_TRIANGLES, 0, 3); }

/// The view with a near plane that clips nothing at the distance `nearest` or beyond, even in the
/// corners.
View clear_of(float nearest, View view, Real aspect) {
  const Real tangent = std::tan(view.fov_y / 2);
  const Real to_corner = std::sqrt(1 + tangent * tangent * (1 + aspect * aspect));
  view.near_plane =
      std::clamp(static_cast<Real>(nearest) / (to_corner * Real(1.05)), view.far_plane * kLeastNear,
                 std::max(view.near_plane, view.far_plane * kLeastNear));
  return view;
}

}  // namespace

struct Renderer::Impl {
  Quality quality;
  GlProgram sphere[kPasses] = {
      pass_program(shaders::sphere_vert, shaders::sphere_frag, kShadowPass),
      pass_program(shaders::sphere_vert, shaders::sphere_frag, kGeometryPass),
      pass_program(shaders::sphere_vert, shaders::sphere_frag, kColourPass, true)};
  GlProgram box[kPasses] = {pass_program(shaders::box_vert, shaders::box_frag, kShadowPass),
                            pass_program(shaders::box_vert, shaders::box_frag, kGeometryPass),
                            pass_program(shaders::box_vert, shaders::box_frag, kColourPass)};
  GlProgram rounded[kPasses] = {
      pass_program(shaders::rounded_vert, shaders::rounded_frag, kShadowPass),
      pass_program(shaders::rounded_vert, shaders::rounded_frag, kGeometryPass),
      pass_program(shaders::rounded_vert, shaders::rounded_frag, kColourPass)};
  GlProgram mesh[kPasses] = {pass_program(shaders::mesh_vert, shaders::mesh_frag, kShadowPass),
                             pass_program(shaders::mesh_vert, shaders::mesh_frag, kGeometryPass),
                             pass_program(shaders::mesh_vert, shaders::mesh_frag, kColourPass)};
  GlProgram ground_geometry =
      pass_program(shaders::screen_vert, shaders::ground_frag, kGeometryPass);
  GlProgram ground_colour = pass_program(shaders::screen_vert, shaders::ground_frag, kColourPass);
  GlProgram sky{shaders::screen_vert, shaders::sky_frag};
  GlProgram occlusion{shaders::screen_vert, shaders::occlusion_frag};
  GlProgram blur{shaders::screen_vert, shaders::blur_frag};
  GlProgram tone{shaders::screen_vert, shaders::tone_frag};
  GlProgram line{shaders::line_vert, shaders::line_frag};
  GlBuffer frame = make_buffer();
  GlVertexArray empty = make_vertex_array();
  DrawOrder order;
  SphereInstances spheres, resident_spheres;
  std::unique_ptr<SharedBuffer> resident_buffer;  ///< of resident_spheres
  BoxInstances boxes, glass;
  RoundedInstances rounded_boxes;
  MeshModels meshes;
  LineInstances lines;
  std::optional<Targets> targets;
  std::optional<ShadowMap> shadow_map;

  explicit Impl(const Quality& q) : quality(q) {
    occlusion.use();
    glUniform1i(occlusion.at("depth_map"), 2);
    glUniform1i(occlusion.at("normal_map"), 3);
    blur.use();
    glUniform1i(blur.at("source"), 2);
    glUniform1i(blur.at("normal_map"), 3);
    tone.use();
    glUniform1i(tone.at("source"), 2);
  }

  void resize(int width, int height) {
    if (!targets || targets->width != width || targets->height != height) {
      targets.reset();
      targets.emplace(width, height, quality.samples);
    }
    const int size = std::max(quality.shadow_size, 1);
    if (!shadow_map || shadow_map->size != size) shadow_map.emplace(size);
  }

  void upload(const Drawing& drawing, const View& view, const Viewport& viewport) {
    const Real aspect = static_cast<Real>(viewport.width) / static_cast<Real>(viewport.height);
    spheres.upload(order.sort(drawing.spheres(), view, aspect));
    const View clear = clear_of(std::min(order.nearest(), drawing.nearest_surface()), view, aspect);
    const FrameBlock block = make_frame_block(drawing, clear, quality, viewport);
    glBindBuffer(GL_UNIFORM_BUFFER, frame.name());
    glBufferData(GL_UNIFORM_BUFFER, sizeof block, &block, GL_STREAM_DRAW);
    glBindBufferBase(GL_UNIFORM_BUFFER, 0, frame.name());
    boxes.upload(drawing.boxes());
    glass.upload(drawing.glass());
    rounded_boxes.upload(drawing.rounded());
    meshes.upload(drawing.meshes());
    lines.upload(drawing.lines());
    write_resident(drawing.resident(), drawing.eye());
  }

  void write_resident(ResidentSpheres* source, const Vec3& eye) {
    const std::size_t count = source == nullptr ? 0 : source->count();
    if (count != resident_spheres.count() || (count > 0 && resident_buffer == nullptr)) {
      resident_buffer.reset();
      const GLuint buffer = resident_spheres.reserve(count);
      if (count > 0) resident_buffer = source->share(buffer);
    }
    if (count > 0) source->write(resident_buffer.get(), eye);
  }

  void draw_bodies(Pass pass) {
    box[pass].use();
    boxes.draw();
    rounded[pass].use();
    rounded_boxes.draw();
    mesh[pass].use();
    meshes.draw();
    sphere[pass].use();
    const bool smooth = pass == kColourPass && quality.samples > 1;
    if (smooth) glEnable(GL_SAMPLE_ALPHA_TO_COVERAGE);
    spheres.draw(pass == kShadowPass ? order.all() : order.visible());
    resident_spheres.draw();
    glDisable(GL_SAMPLE_ALPHA_TO_COVERAGE);
  }

  void draw_grounds(const Drawing& drawing, const GlProgram& program) {
    program.use();
    glBindVertexArray(empty.name());
    for (const GroundItem& item : drawing.grounds()) {
      if (!(item.height > 0)) continue;  // invisible from below
      glUniform4f(program.at("plane"), item.normal[0], item.normal[1], item.normal[2], item.height);
      glUniform4f(program.at("grid_u"), item.u[0], item.u[1], item.u[2], item.eye_u);
      glUniform4f(program.at("grid_v"), item.v[0], item.v[1], item.v[2], item.eye_v);
      glUniform4f(program.at("surface"), item.paint.r / 255.0f, item.paint.g / 255.0f,
                  item.paint.b / 255.0f, item.cell);
      draw_screen();
    }
  }

  void draw_shadows() {
    glBindFramebuffer(GL_FRAMEBUFFER, shadow_map->target.name());
    glViewport(0, 0, shadow_map->size, shadow_map->size);
    glClear(GL_DEPTH_BUFFER_BIT);
    if (quality.shadow_size == 0) return;
    glEnable(GL_DEPTH_CLAMP);  // includes casters between the sun and the shadow map
    draw_bodies(kShadowPass);
    glDisable(GL_DEPTH_CLAMP);
  }

  void draw_occlusion(const Drawing& drawing) {
    if (quality.occlusion_samples == 0) return;
    glBindFramebuffer(GL_FRAMEBUFFER, targets->geometry.name());
    glViewport(0, 0, targets->width, targets->height);
    glClearColor(0, 0, 0, 0);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    draw_grounds(drawing, ground_geometry);
    draw_bodies(kGeometryPass);
    glDisable(GL_DEPTH_TEST);
    glBindVertexArray(empty.name());
    bind_texture(GL_TEXTURE2, targets->depth);
    bind_texture(GL_TEXTURE3, targets->normals);
    glBindFramebuffer(GL_FRAMEBUFFER, targets->occlusion_target.name());
    occlusion.use();
    draw_screen();
    bind_texture(GL_TEXTURE2, targets->occlusion);
    glBindFramebuffer(GL_FRAMEBUFFER, targets->blur_target.name());
    blur.use();
    draw_screen();
    glEnable(GL_DEPTH_TEST);
  }

  void draw_colours(const Drawing& drawing) {
    bind_texture(GL_TEXTURE0, shadow_map->depth);
    bind_texture(GL_TEXTURE1, targets->blurred);
    glBindFramebuffer(GL_FRAMEBUFFER, targets->many.name());
    glViewport(0, 0, targets->width, targets->height);
    glClear(GL_DEPTH_BUFFER_BIT);
    glBindVertexArray(empty.name());
    sky.use();
    glDepthMask(GL_FALSE);
    draw_screen();
    glDepthMask(GL_TRUE);
    draw_grounds(drawing, ground_colour);
    draw_bodies(kColourPass);
    draw_overlays();
  }

  void draw_overlays() {
    glEnable(GL_BLEND);
    glBlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
    glDepthMask(GL_FALSE);
    box[kColourPass].use();
    glass.draw();
    line.use();
    glUniform1f(line.at("opacity"), 1.0f);
    lines.draw();
    // Hidden lines are drawn faintly, because contacts lie inside bodies.
    glUniform1f(line.at("opacity"), 0.4f);
    glDisable(GL_DEPTH_TEST);
    lines.draw();
    glEnable(GL_DEPTH_TEST);
    glDepthMask(GL_TRUE);
    glDisable(GL_BLEND);
  }

  void resolve_to(const Viewport& viewport, GLuint framebuffer) {
    glBindFramebuffer(GL_READ_FRAMEBUFFER, targets->many.name());
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, targets->light_target.name());
    glBlitFramebuffer(0, 0, targets->width, targets->height, 0, 0, targets->width, targets->height,
                      GL_COLOR_BUFFER_BIT, GL_NEAREST);
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    glViewport(viewport.x, viewport.y, viewport.width, viewport.height);
    glDisable(GL_DEPTH_TEST);
    bind_texture(GL_TEXTURE2, targets->light);
    tone.use();
    glUniform1i(tone.at("scale"), quality.supersample);
    glUniform2i(tone.at("origin"), viewport.x, viewport.y);
    glBindVertexArray(empty.name());
    draw_screen();
  }
};

Renderer::Renderer(const Quality& quality) : impl_(std::make_unique<Impl>(quality)) {}
Renderer::~Renderer() = default;

const Quality& Renderer::quality() const { return impl_->quality; }
void Renderer::set_quality(const Quality& quality) {
  if (quality == impl_->quality) return;
  impl_->quality = quality;
  impl_->targets.reset();
}

void Renderer::draw(const Drawing& drawing, const View& view, const Viewport& viewport,
                    GLuint framebuffer) {
  if (viewport.width <= 0 || viewport.height <= 0) return;  // nothing is visible
  Impl& r = *impl_;
  r.resize(viewport.width * r.quality.supersample, viewport.height * r.quality.supersample);
  r.upload(drawing, view, viewport);
  glDisable(GL_BLEND);
  glDisable(GL_SCISSOR_TEST);
  glDisable(GL_CULL_FACE);
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LEQUAL);
  glDepthMask(GL_TRUE);
  glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  r.draw_shadows();
  r.draw_occlusion(drawing);
  r.draw_colours(drawing);
  r.resolve_to(viewport, framebuffer);
}

OffscreenFramebuffer::OffscreenFramebuffer(int width, int height)
    : width_(width),
      height_(height),
      colour_(make_texture(GL_RGBA8, width, height)),
      framebuffer_(make_framebuffer(colour_.name(), 0)) {}

Image OffscreenFramebuffer::read_pixels(GLuint framebuffer, int width, int height) {
  Image image{width, height, {}};
  const auto row = static_cast<std::size_t>(width) * 3;
  image.rgb.resize(row * static_cast<std::size_t>(height));
  glBindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer);
  glReadBuffer(framebuffer == 0 ? GL_BACK : GL_COLOR_ATTACHMENT0);
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, width, height, GL_RGB, GL_UNSIGNED_BYTE, image.rgb.data());
  // The rows of OpenGL start at the bottom.
  for (std::size_t y = 0; y < static_cast<std::size_t>(height) / 2; ++y) {
    std::uint8_t* upper = &image.rgb[y * row];
    std::swap_ranges(upper, upper + row,
                     &image.rgb[(static_cast<std::size_t>(height) - 1 - y) * row]);
  }
  return image;
}

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx

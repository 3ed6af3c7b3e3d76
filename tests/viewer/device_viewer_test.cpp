/// Pictures from device memory equal those from the host. The device is that of the host, and its
/// memory, too, so that the test needs no GPU.
#include "src/viewer/device_viewer.hpp"

#include <jfpx/cuda/world.hpp>

#include "src/scenes/scenes.hpp"
#include "src/viewer/scene_viewer.hpp"
#include "src/viewer/ui.hpp"
#include "src/world/world_impl.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/viewer/gl_fixture.hpp"
#include "tests/world/host_device.hpp"

#include <vector>

namespace jfpx {
namespace {

using namespace view;
using DeviceViewerTest = test::GlTest;

class HostBuffer final : public SharedBuffer {
 public:
  HostBuffer(GLuint buffer, std::size_t items) : buffer_(buffer), items_(items) {}
  void* map(cuda::Stream) override { return items_.data(); }
  void unmap(cuda::Stream) override {
    glBindBuffer(GL_ARRAY_BUFFER, buffer_);
    glBufferSubData(GL_ARRAY_BUFFER, 0, static_cast<GLsizeiptr>(items_.size() * sizeof(SphereItem)),
                    items_.data());
  }

 private:
  GLuint buffer_;
  std::vector<SphereItem> items_;
};

class HostSpheres final : public ResidentSpheres {
 public:
  HostSpheres(World* world, std::vector<Ball> balls) : world_(world), balls_(std::move(balls)) {}
  std::size_t count() const override { return balls_.size(); }
  std::unique_ptr<SharedBuffer> share(GLuint buffer) override {
    return std::make_unique<HostBuffer>(buffer, balls_.size());
  }
  void write(SharedBuffer* buffer, const Vec3& eye) override {
    const cuda::DeviceStates states = cuda::device_states(*world_);
    auto* items = static_cast<SphereItem*>(buffer->map(states.stream));
    for (const Ball& ball : balls_) {
      *items++ = make_sphere_item(states.positions[ball.body] - eye, static_cast<Real>(ball.radius),
                                  states.orientations[ball.body], ball.paint);
    }
    buffer->unmap(states.stream);
  }
  const std::string& host_copy_reason() const override { return reason_; }

 private:
  World* world_;
  std::vector<Ball> balls_;
  std::string reason_ = "the test has no GPU";
};

DeviceRun run_on_the_host() {
  return {.make_world =
              [](const Scene& scene) {
                World world(scene, {.collider = {.backend = Backend::cpu}});
                WorldAccess::impl(world).device = test::make_host_device_world(scene);
                return world;
              },
          .make_spheres =
              [](World* world, const std::vector<Ball>& balls) {
                return std::make_unique<HostSpheres>(world, balls);
              }};
}

TEST_F(DeviceViewerTest, DrawsWhatASceneViewerDraws) {
  ViewOptions options;
  options.run.scene = "pile";
  options.run.spheres = 60;
  options.run.no_sleep = true;  // sleeping bodies are darker
  options.choice.backend = Backend::cpu;
  options.quality = kLowQuality;
  options.size = {320, 200};
  SceneViewer host(options);
  DeviceViewer device(options, host.player().scene(), run_on_the_host());
  Renderer renderer(options.quality);
  const OffscreenFramebuffer offscreen(options.size.width, options.size.height);
  Ui ui(offscreen);
  const auto picture = [&](Viewer& viewer) {
    viewer.paused = true;  // shows the last step
    viewer.home();
    ui.begin(1);
    viewer.draw(renderer, {offscreen.framebuffer(), offscreen.width(), offscreen.height()});
    ui.end(offscreen.framebuffer(), offscreen.width(), offscreen.height());
    return offscreen.read();
  };
  const auto expect_same_pictures = [&] {
    const Image a = picture(host), b = picture(device), again = picture(host);
    std::size_t different = 0;
    for (std::size_t i = 0; i < a.rgb.size(); ++i) different += a.rgb[i] != b.rgb[i] ? 1 : 0;
    // The spheres are in another order, which shows where two of them blend at an edge.
    EXPECT_LT(different, a.rgb.size() / 100);
    EXPECT_EQ(again.rgb, a.rgb) << "resident spheres are part of their own pictures only";
  };
  expect_same_pictures();
  const Image start = picture(device);
  for (int n = 0; n < 40; ++n) {
    host.step();
    device.step();
  }
  EXPECT_EQ(device.steps(), 40u);
  expect_same_pictures();
  device.restart();
  EXPECT_EQ(device.steps(), 0u);
  EXPECT_EQ(picture(device).rgb, start.rgb);
}

TEST(DeviceViewer, SuitsScenesOfBalls) {
  EXPECT_TRUE(DeviceViewer::suits(scenes::make("pile", {.spheres = 5})));
  EXPECT_FALSE(DeviceViewer::suits(scenes::make("mixed", {.spheres = 5, .boxes = 5})));
  Scene kinematic = scenes::make("pile", {.spheres = 5});
  kinematic.bodies[0].mass = 0;
  kinematic.bodies[0].kinematic = true;
  EXPECT_FALSE(DeviceViewer::suits(kinematic));
}

/// Other scenes and options are shown from the host.
TEST(DeviceViewer, IsForManyBallsOnAGpuWithoutStates) {
  ViewOptions options;
  options.run.scene = "pile";
  options.run.spheres = 50;
  options.choice.backend = Backend::cuda;
  EXPECT_EQ(make_device_viewer(options), nullptr) << "few bodies";
  options.run.spheres = 100000;
  options.choice.backend = Backend::automatic;
  EXPECT_EQ(make_device_viewer(options), nullptr);
  options.choice.backend = Backend::cuda;
  options.contacts = true;
  EXPECT_EQ(make_device_viewer(options), nullptr);
}

}  // namespace
}  // namespace jfpx

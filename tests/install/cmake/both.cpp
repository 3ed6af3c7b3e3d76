/// One program, both precisions, and the backends that the library says it has.
#include <jfpx/jfpx.hpp>

#include <cstdio>

int contacts_in_double();

int main() {
  jfpx::Scene scene;
  scene.bodies = {{.shape = jfpx::Sphere{1}}, {.shape = jfpx::Sphere{1}, .position = {1, 0, 0}}};
  jfpx::World world(scene);
  const jfpx::StepReport report = world.step();
  std::printf("contacts %d %d\n", static_cast<int>(report.contacts), contacts_in_double());
  for (const jfpx::BackendStatus& status : jfpx::available_backends()) {
    std::printf("%s %s\n", jfpx::to_string(status.backend).data(),
                status.compiled ? "compiled" : "not compiled");
  }
  try {
    scene.bodies[1].mass = -1;
    jfpx::World refused(scene);
    return 1;
  } catch (const jfpx::InvalidScene&) {  // one type on both sides of a shared library
    std::printf("refused\n");
  }
}

/// Bullet as an Engine, unmodified or with jfpx's parts.
#include "src/tool/bullet_engine.hpp"

#include "src/tool/bullet_world.hpp"

#include <BulletDynamics/Dynamics/btRigidBody.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {
namespace {

class BulletEngine final : public Engine {
 public:
  BulletEngine(EngineKind kind, const Scene& scene, const RunOptions& options)
      : world_(make_bullet_world(kind, scene, options)) {}

  void step() override {
    world_.step();
    contacts_ = count_contacts(world_);
  }
  std::vector<BodyState> states() const override { return world_.states(); }
  std::uint64_t contacts() const override { return contacts_; }
  std::uint32_t awake() const override {
    std::uint32_t awake = 0;
    for (const btRigidBody* body : world_.bodies()) {
      awake += !body->isStaticOrKinematicObject() && body->isActive() ? 1 : 0;
    }
    return awake;
  }
  StepMeasures measures() const override { return measures_of(world_); }
  StageTimes times() const override { return stage_times_of_bullet(world_.last_step()); }
  std::string backend() const override { return sphere_backend(world_); }
  std::string device_failure() const override { return tool::device_failure(world_); }

 private:
  mutable bullet::SceneWorld world_;  // Bullet's accessors of manifolds are not const
  std::uint64_t contacts_ = 0;
};

}  // namespace

std::unique_ptr<Engine> make_bullet_engine(EngineKind kind, const Scene& scene,
                                           const RunOptions& options) {
  return std::make_unique<BulletEngine>(kind, scene, options);
}

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx

/// A world and the recording of its calls and steps.
#include <jfpx/recorded_world.hpp>
#include <jfpx/recording.hpp>

#include "src/world/recording/recorded_calls.hpp"

#include <functional>
#include <optional>

namespace jfpx {
inline namespace JFPX_ABI {

using recorded::Json;

struct RecordedWorld::Impl {
  Impl(const std::string& path, const Scene& scene, const WorldSettings& settings)
      : world(scene, settings) {
    if (settings.communicator != nullptr && settings.communicator->rank() != 0) return;
    writer = RecordingWriter(path,
                             {.engine = "native",
                              .backend = std::string(to_string(settings.collider.backend)),
                              .scene = scene},
                             true);
  }

  /// Calls a function and records the call for the next step. The call is recorded first, because
  /// recording may fail, and removed if the function fails.
  template <class Function, class... Arguments>
  decltype(auto) call(const char* name, Function function, const Arguments&... arguments) {
    calls.push_back(recorded::make_call(name, arguments...));
    try {
      return std::invoke(function, world, arguments...);
    } catch (...) {
      calls.erase(calls.size() - 1);
      throw;
    }
  }

  World world;
  std::optional<RecordingWriter> writer;  ///< of rank 0
  Json calls = Json::array();             ///< since the last step
};

RecordedWorld::RecordedWorld(const std::string& path, const Scene& scene,
                             const WorldSettings& settings)
    : impl_(std::make_unique<Impl>(path, scene, settings)) {}
RecordedWorld::~RecordedWorld() = default;
RecordedWorld::RecordedWorld(RecordedWorld&&) noexcept = default;
RecordedWorld& RecordedWorld::operator=(RecordedWorld&&) noexcept = default;

const World& RecordedWorld::world() const { return impl_->world; }

StepReport RecordedWorld::step() {
  const std::string calls = impl_->calls.empty() ? std::string() : impl_->calls.dump();
  StepReport report = impl_->world.step();
  impl_->calls = Json::array();
  const auto states = impl_->world.states();
  if (impl_->writer) impl_->writer->append(states, calls);
  return report;
}

void RecordedWorld::finish() {
  if (impl_->writer) impl_->writer->finish();
}

BodyId RecordedWorld::add(const BodyDef& body) { return impl_->call("add", &World::add, body); }
void RecordedWorld::remove(BodyId id) { impl_->call("remove", &World::remove, id); }
void RecordedWorld::replace(BodyId id, const BodyDef& body) {
  impl_->call("replace", &World::replace, id, body);
}
void RecordedWorld::set_state(BodyId id, const BodyState& state) {
  impl_->call("set_state", &World::set_state, id, state);
}
void RecordedWorld::wake(BodyId id) { impl_->call("wake", &World::wake, id); }
void RecordedWorld::set_friction(BodyId id, Real friction) {
  impl_->call("set_friction", &World::set_friction, id, friction);
}
void RecordedWorld::set_restitution(BodyId id, Real restitution) {
  impl_->call("set_restitution", &World::set_restitution, id, restitution);
}
void RecordedWorld::set_acceleration(BodyId id, const Vec3& acceleration) {
  impl_->call("set_acceleration", &World::set_acceleration, id, acceleration);
}
void RecordedWorld::set_damping(BodyId id, Real linear, Real angular) {
  impl_->call("set_damping", &World::set_damping, id, linear, angular);
}
void RecordedWorld::set_mass(BodyId id, Real mass) {
  impl_->call("set_mass", &World::set_mass, id, mass);
}
void RecordedWorld::set_inertia(BodyId id, const std::optional<Mat3>& inertia) {
  impl_->call("set_inertia", &World::set_inertia, id, inertia);
}
void RecordedWorld::set_motion_locks(BodyId id, const MotionLocks& locks) {
  impl_->call("set_motion_locks", &World::set_motion_locks, id, locks);
}
void RecordedWorld::set_user_data(BodyId id, std::uint64_t user_data) {
  impl_->call("set_user_data", &World::set_user_data, id, user_data);
}
void RecordedWorld::set_filter(BodyId id, const CollisionFilter& filter) {
  impl_->call("set_filter", &World::set_filter, id, filter);
}
void RecordedWorld::set_pair_ignored(BodyId a, BodyId b, bool ignored) {
  impl_->call("set_pair_ignored", &World::set_pair_ignored, a, b, ignored);
}
void RecordedWorld::apply_force(BodyId id, const Vec3& force) {
  impl_->call("apply_force", &World::apply_force, id, force);
}
void RecordedWorld::apply_force_at_point(BodyId id, const Vec3& force, const Vec3& point) {
  impl_->call("apply_force_at_point", &World::apply_force_at_point, id, force, point);
}
void RecordedWorld::apply_torque(BodyId id, const Vec3& torque) {
  impl_->call("apply_torque", &World::apply_torque, id, torque);
}
void RecordedWorld::apply_impulse(BodyId id, const Vec3& impulse) {
  impl_->call("apply_impulse", &World::apply_impulse, id, impulse);
}
void RecordedWorld::apply_impulse_at_point(BodyId id, const Vec3& impulse, const Vec3& point) {
  impl_->call("apply_impulse_at_point", &World::apply_impulse_at_point, id, impulse, point);
}
void RecordedWorld::apply_angular_impulse(BodyId id, const Vec3& impulse) {
  impl_->call("apply_angular_impulse", &World::apply_angular_impulse, id, impulse);
}
ForceId RecordedWorld::add_force(const RecordableForce& force) {
  return impl_->call("add_force", &recorded::add_force, force);
}
void RecordedWorld::set_force(ForceId id, const RecordableForce& force) {
  impl_->call("set_force", &recorded::set_force, id, force);
}
void RecordedWorld::remove_force(ForceId id) {
  impl_->call("remove_force", &World::remove_force, id);
}
JointId RecordedWorld::add_joint(const Joint& joint) {
  return impl_->call("add_joint", &World::add_joint, joint);
}
void RecordedWorld::set_joint(JointId id, const Joint& joint) {
  impl_->call("set_joint", &World::set_joint, id, joint);
}
void RecordedWorld::remove_joint(JointId id) {
  impl_->call("remove_joint", &World::remove_joint, id);
}

void repeat_calls(RecordingReader& reader, std::uint64_t step, World& world) {
  const std::string text = reader.calls(step);
  if (text.empty()) return;
  const auto refuse = [&](const char* why) {
    throw FileError("the recording has a call before step " + std::to_string(step) +
                    " that can't be repeated: " + why);
  };
  try {
    for (const Json& call : parse_json(text)) recorded::make_call_on(world, call);
  } catch (const nlohmann::json::exception& error) {
    refuse(error.what());
  } catch (const InvalidScene& error) {
    refuse(error.what());
  } catch (const InvalidArgument& error) {
    refuse(error.what());
  }
}

}  // namespace JFPX_ABI
}  // namespace jfpx

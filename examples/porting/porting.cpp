/// Example of a small game scene: layers, a lift, a door, a character, a trigger and shots, with a
/// fixed step that is interpolated for drawing. docs/porting.md has the terms of other engines.
#include <jfpx/debug_draw.hpp>
#include <jfpx/world.hpp>

#include <algorithm>
#include <condition_variable>
#include <cstdint>
#include <cstdio>
#include <deque>
#include <functional>
#include <iterator>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

namespace {

using jfpx::Real;

// Layers are bits; kPlayer collides with all but kDebris.
constexpr std::uint32_t kLevel = 1, kPlayer = 2, kDebris = 4, kTrigger = 8;

jfpx::BodyDef body(const jfpx::Shape& shape, const jfpx::Vec3& position, Real mass,
                   const jfpx::CollisionFilter& filter) {
  jfpx::BodyDef def;
  def.shape = shape;
  def.position = position;
  def.mass = mass;  // 0: static, or kinematic if def.kinematic is set
  def.filter = filter;
  return def;
}

/// Whether a character stands: a ball at its feet, which is a little thinner, hits something that
/// is not too steep 5 cm below.
bool is_on_ground(const jfpx::World& world, jfpx::BodyId player) {
  const auto is_solid = [&](jfpx::BodyId id) { return id != player && !world.sensor(id); };
  const jfpx::Vec3 feet = world.state(player).position - jfpx::Vec3{0, Real(0.5), 0};
  const std::optional<jfpx::ShapeHit> hit = world.cast_shape(
      {.shape = jfpx::Sphere{Real(0.35)}, .position = feet, .translation = {0, Real(-0.1), 0}},
      is_solid);
  return hit && hit->normal.y > Real(0.7);
}

/// Lines for the renderer of the game.
class Lines : public jfpx::DebugDraw {
 public:
  struct Vertex {
    jfpx::Vec3 position;
    jfpx::DebugColor color;
  };
  void line(const jfpx::Vec3& from, const jfpx::Vec3& to, jfpx::DebugColor color) override {
    vertices.push_back({from, color});
    vertices.push_back({to, color});
  }
  std::vector<Vertex> vertices;
};

/// A one-way platform: bodies pass it while they rise, or while their centre is below its top.
struct OneWay {
  jfpx::BodyId platform;
  Real half_height = 0;  ///< [m]

  void operator()(jfpx::ContactContext& context) const {
    for (jfpx::DetectedContact& contact : context.detected()) {
      if (contact.a != platform && contact.b != platform) continue;
      const jfpx::BodyState floor = context.state(platform);
      const jfpx::BodyState body = context.state(contact.a == platform ? contact.b : contact.a);
      contact.ignored = body.velocity.y - floor.velocity.y > Real(0.1) ||
                        body.position.y < floor.position.y + half_height;
    }
  }
};

/// The job system of the game: two threads that run jobs in the order of their addition.
class Jobs {
 public:
  Jobs() : threads_{std::thread([this] { work(); }), std::thread([this] { work(); })} {}
  ~Jobs() {
    for (std::size_t i = 0; i < std::size(threads_); ++i) add({});
    for (std::thread& thread : threads_) thread.join();
  }
  Jobs(const Jobs&) = delete;
  Jobs& operator=(const Jobs&) = delete;
  /// An empty job ends a thread.
  void add(std::function<void()> job) {
    const std::lock_guard lock(mutex_);
    jobs_.push_back(std::move(job));
    changed_.notify_one();
  }

 private:
  void work() {
    for (;;) {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [this] { return !jobs_.empty(); });
      const std::function<void()> job = std::move(jobs_.front());
      jobs_.pop_front();
      lock.unlock();
      if (!job) return;
      job();
    }
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::function<void()>> jobs_;
  std::thread threads_[2];
};

/// Makes a body immovable where it is.
void freeze(jfpx::World& world, jfpx::BodyId id) {
  jfpx::BodyDef body = world.definition(id);
  body.mass = 0;
  body.velocity = body.angular_velocity = {};
  world.replace(id, body);
}

}  // namespace

int main() {
  jfpx::Scene scene;  // steps of 1/60 s, gravity (0, -9.81, 0) in each BodyDef
  scene.bodies.push_back(body(jfpx::Box{{20, 1, 20}}, {0, -1, 0}, 0, {kLevel}));
  // A step runs in this thread and in up to two jobs.
  Jobs jobs;
  jfpx::World world(
      scene, {.threads = 3, .enqueue_task = std::bind_front(&Jobs::add, &jobs), .hit_speed = 1});

  jfpx::BodyDef platform = body(jfpx::Box{{2, Real(0.1), 2}}, {8, Real(0.1), 0}, 0, {kLevel});
  platform.kinematic = true;
  platform.velocity = {0, 1, 0};  // until set_state() changes it
  const jfpx::BodyId lift = world.add(platform);

  jfpx::BodyDef belt = body(jfpx::Box{{4, Real(0.1), 1}}, {0, Real(0.1), -12}, 0, {kLevel});
  belt.kinematic = true;
  belt.motion_locks = jfpx::kFixedPose;
  belt.velocity = {1, 0, 0};  // of its surface
  world.add(belt);
  const jfpx::BodyId parcel =
      world.add(body(jfpx::Box{{Real(0.2), Real(0.2), Real(0.2)}}, {-3, Real(0.4), -12}, 5, {}));

  const jfpx::BodyId ledge =
      world.add(body(jfpx::Box{{2, Real(0.1), 2}}, {-14, Real(1.9), 0}, 0, {kLevel}));
  world.add_contact_generator(OneWay{ledge, Real(0.1)});
  jfpx::BodyDef thrown = body(jfpx::Sphere{Real(0.25)}, {-14, Real(0.25), 0}, 1, {});
  thrown.velocity = {0, 8, 0};
  const jfpx::BodyId ball = world.add(thrown);

  jfpx::HingeJoint hinge;
  hinge.a = world.add(body(jfpx::Box{{Real(0.5), 1, Real(0.05)}}, {-3, 1, 0}, 20, {kLevel}));
  hinge.min_angle = 0;
  hinge.max_angle = Real(1.5);
  hinge.motor_speed = 1;
  hinge.max_motor_torque = 200;
  // A joint without `b` holds the body in the world.
  place_joint(&hinge, world.state(hinge.a), {}, {Real(-3.5), 1, 0}, jfpx::Vec3{0, 1, 0});
  const jfpx::JointId door = world.add_joint(hinge);

  jfpx::BodyDef walker = body(jfpx::Capsule{Real(0.4), Real(0.5)}, {0, Real(0.9), 6}, 80,
                              {.category = kPlayer, .mask = ~kDebris});
  walker.motion_locks = jfpx::kFixedRotation;  // a character does not fall over
  walker.friction = 0;
  walker.can_sleep = false;
  const jfpx::BodyId player = world.add(walker);

  jfpx::BodyDef coin =
      body(jfpx::Sphere{Real(0.5)}, {0, 1, 0}, 0, {.category = kTrigger, .mask = kPlayer});
  coin.sensor = true;
  coin.user_data = 42;  // an index of the game's own objects
  world.add(coin);

  const jfpx::BodyId crate = world.add(body(jfpx::Box{{1, 1, 1}}, {0, 3, -6}, 30, {kDebris}));

  constexpr Real kDt = Real(1) / 60;
  Real accumulator = 0;
  jfpx::BodyState before, after;               // of the player
  Real loudest = 0;                            // [m/s]
  for (int frame = 0; frame < 288; ++frame) {  // 144 frames per second
    accumulator += Real(1) / 144;
    while (accumulator >= kDt) {
      accumulator -= kDt;
      jfpx::BodyState walk = world.state(player);
      before = walk;
      walk.velocity = {0, walk.velocity.y, -3};
      world.set_state(player, walk);

      jfpx::BodyState ride = world.state(lift);
      if (ride.position.y > 1) {
        ride.velocity.y = -1;
        world.set_state(lift, ride);
      }

      if (world.step().non_finite) return 1;
      after = world.state(player);

      // Events are read after the step; bodies may be removed here.
      std::vector<jfpx::BodyId> taken;
      for (const jfpx::ContactEvent& event : world.contact_events()) {
        if (event.phase != jfpx::ContactPhase::begin) continue;
        for (const jfpx::BodyId id : {event.a, event.b}) {
          if (world.contains(id) && world.sensor(id)) taken.push_back(id);
        }
      }
      // Impacts of at least 1 m/s, for sounds and damage.
      for (const jfpx::HitEvent& hit : world.hit_events()) {
        loudest = std::max(loudest, hit.approach_speed);
      }
      for (const jfpx::BodyId id : taken) {
        std::printf("took object %llu\n", static_cast<unsigned long long>(world.user_data(id)));
        world.remove(id);
      }
    }
  }
  std::printf("the belt has carried the parcel by %.1f m\n",
              static_cast<double>(world.state(parcel).position.x + 3));
  std::printf("the ball lies on the ledge at y = %.2f m\n",
              static_cast<double>(world.state(ball).position.y));
  std::printf("the loudest impact had %.1f m/s\n", static_cast<double>(loudest));
  const jfpx::BodyState drawn = interpolate(before, after, accumulator / kDt);
  std::printf("the player is drawn at z = %.2f m\n", static_cast<double>(drawn.position.z));
  std::printf("the player %s\n", is_on_ground(world, player) ? "stands" : "falls");
  std::printf("the door is open by %.1f rad\n",
              static_cast<double>(world.joint_state(door).position));

  // A shot: the first hit of a layer.
  const auto is_debris = [&world](jfpx::BodyId id) { return world.filter(id).category == kDebris; };
  const jfpx::Ray shot{.origin = {0, 1, 10}, .direction = {0, 0, -1}, .max_distance = 100};
  if (const std::optional<jfpx::RayHit> hit = world.cast_ray(shot, is_debris)) {
    world.apply_impulse(hit->body, {0, 0, -150});
    std::printf("shot at %.1f m: the crate moves at %.1f m/s\n", static_cast<double>(hit->distance),
                static_cast<double>(-world.state(crate).velocity.z));
  }
  freeze(world, crate);
  world.step();
  std::printf("frozen: the crate moves at %.1f m/s\n",
              static_cast<double>(-world.state(crate).velocity.z));
  Lines lines;
  jfpx::debug_draw(world, &lines, {.contacts = true});
  std::printf("%zu vertices of lines\n", lines.vertices.size());
}

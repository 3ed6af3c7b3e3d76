/// Moves of a character: collide and slide (Fauerby 2003, "Improved Collision detection and
/// Response"), with the steps of Quake's PM_StepSlideMove (1999), and a probe that keeps the
/// character on the ground, an idea of Jolt's CharacterVirtual.
#include <jfpx/character.hpp>
#include <jfpx/error.hpp>

#include "src/scene/scene_validate.hpp"
#include "src/world/bodies/motion_locks.hpp"
#include "src/world/character/slide.hpp"
#include "src/world/queries/query_arguments.hpp"

#include <algorithm>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

constexpr Real kJumpSpeed = Real(1e-3);  ///< [m/s], least upward velocity that leaves the ground
/// [m/s], of a character that steep surfaces hold.
constexpr Real kHeldSpeed = Real(1e-2);
/// [-], of the skin, for which positions are not corrected: rounding must not move a character
/// that stands.
constexpr Real kTolerance = Real(0.02);
constexpr int kMoves = 8;   ///< of a character within dt, between hits
constexpr int kPushes = 8;  ///< out of overlaps

bool is_coordinate(const Vec3& v) {
  return absolute(v.x) <= kMaxCoordinate && absolute(v.y) <= kMaxCoordinate &&
         absolute(v.z) <= kMaxCoordinate;
}

void validate(const CharacterSettings& s, const CharacterState& state, Real dt) {
  const auto positive = [](Real x) { return x > 0 && is_finite(x); };
  const Real up = length(s.up);
  require_in_query(positive(s.radius), "radius", to_text(s.radius), "positive and finite");
  require_in_query(positive(s.half_height), "half_height", to_text(s.half_height),
                   "positive and finite");
  require_in_query(up > kEpsilon && is_finite(up), "up", to_text(s.up),
                   "finite and longer than epsilon");
  require_in_query(s.max_slope >= 0 && s.max_slope <= Real(1.5), "max_slope", to_text(s.max_slope),
                   "from 0 to 1.5");
  require_in_query(s.step_height >= 0 && is_finite(s.step_height), "step_height",
                   to_text(s.step_height), ">= 0 and finite");
  require_in_query(s.skin > 0 && s.skin < s.radius, "skin", to_text(s.skin),
                   "positive and less than the radius");
  require_in_query(is_coordinate(state.position), "position", to_text(state.position),
                   "between -1e9 and 1e9");
  require_in_query(is_finite(state.velocity), "velocity", to_text(state.velocity), "finite");
  require_in_query(is_finite(state.ground_normal), "ground_normal", to_text(state.ground_normal),
                   "finite");
  require_in_query(positive(dt), "dt", to_text(dt), "positive and finite");
}

/// The rotation of the y axis to a direction.
Quat upright(const Vec3& up) {
  if (up == Vec3{0, 1, 0}) return {};
  const Vec3 other = absolute(up.x) < Real(0.7) ? Vec3{1, 0, 0} : Vec3{0, 0, 1};
  return axes_along(cross(up, other), up);
}

/// Cosine without the C library, whose bits differ between machines.
Real cosine(Real angle) { return to_matrix(from_axis_angle({0, 0, 1}, angle))(0, 0); }

/// How far a cast got, and what blocked it.
struct Advance {
  Real distance = 0;
  std::optional<ShapeHit> hit = {};
};

/// The surface below a character.
struct Landing {
  ShapeHit hit;
  Real drop = 0;  ///< [m], to the position that is `skin` above the surface
  Vec3 surface;   ///< normal of the walkable face; that of the hit if there is none
  bool walkable = false;
};

class CharacterMover {
 public:
  CharacterMover(const World& world, const CharacterSettings& settings, const CharacterState& state,
                 Real dt)
      : world_(world),
        settings_(settings),
        before_(state),
        dt_(dt),
        up_(normalized(settings.up)),
        least_rise_(cosine(settings.max_slope)),
        position_(state.position),
        rise_(dot(state.velocity, up_)),
        level_(state.velocity - up_ * rise_),
        standing_(state.ground_state == GroundState::ground && world.contains(state.ground_body)),
        held_(standing_ && !is_walkable(state.ground_normal)),
        walking_(standing_ && !held_ && rise_ < kJumpSpeed) {
    cast_.shape = Capsule{settings.radius, settings.half_height};
    cast_.orientation = upright(up_);
    filter_ = [this](BodyId id) {
      return id != ignored_ && !world_.sensor(id) && !(only_fixed_ && moves(id)) &&
             (!settings_.filter || settings_.filter(id));
    };
    ground_ = walking_ ? before_.ground_normal : up_;
    if (walking_) rise_ = 0;
    // Presses down, to find out whether it still is held.
    if (held_ && rise_ < kJumpSpeed) rise_ = std::min(rise_, -10 * kHeldSpeed);
  }

  CharacterMove run() {
    if (standing_) ride();
    leave_overlaps();
    advance();
    CharacterMove move;
    find_ground(&move.state);
    move.state.position = position_;
    move.state.velocity = final_velocity(move.state);
    move.hits = std::move(hits_);
    return move;
  }

 private:
  bool is_walkable(const Vec3& normal) const { return dot(normal, up_) >= least_rise_; }
  bool moves(BodyId id) const {
    return world_.mass(id) > 0 || (world_.awake(id) && world_.motion_locks(id) != kFixedPose);
  }
  Vec3 horizontal(const Vec3& v) const { return v - up_ * dot(v, up_); }
  Vec3 feet() const {
    return add_scaled(position_, up_, -(settings_.half_height + settings_.radius));
  }

  /// Moves with the body below, which has moved in the last step with its present velocities, or
  /// with the surface of a conveyor.
  void ride() {
    const BodyState body = world_.state(before_.ground_body);
    const MotionLocks locks = world_.motion_locks(before_.ground_body);
    const Vec3 arm = feet() - (body.position - detail::free_linear(locks, body.velocity) * dt_);
    const Quat turn = rotated_by({}, body.angular_velocity * dt_);
    const Vec3 motion = body.velocity * dt_ + (rotate(turn, arm) - arm);
    carrier_ = body.velocity + cross(body.angular_velocity, arm);
    const Real distance = length(motion);
    if (!(distance > 0) || !is_finite(distance)) return;
    ignored_ = before_.ground_body;
    const Vec3 direction = motion * (1 / distance);
    position_ += direction * cast(position_, direction, distance).distance;
    ignored_ = {};
  }

  /// Moves out of bodies, and half of `skin` away from them, so that grazing an edge does not push
  /// the character aside. The sweep over planes is that of Box3D's b3SolvePlanes. Bodies that do
  /// not move come last and stop the push, so that others cannot squeeze the character through
  /// them. Those up to `skin` away deflect it, such as the slope on which the character stands:
  /// cast() would end a push towards them at once.
  void leave_overlaps() {
    const Real margin = settings_.skin / 2;
    Real left = settings_.radius;
    for (int i = 0; i < kPushes && left > 0; ++i) {
      std::vector<BodyDistance> bodies = world_.bodies_within(
          {position_, cast_.shape, cast_.orientation, settings_.skin * (1 + kTolerance)}, filter_);
      const auto is_close = [&](const BodyDistance& b) {
        return b.distance <= margin * (1 - kTolerance);
      };
      if (std::ranges::none_of(bodies, is_close)) return;
      const auto fixed = std::stable_partition(bodies.begin(), bodies.end(),
                                               [&](const auto& b) { return moves(b.body); });
      for (const BodyDistance& b : bodies) {
        if (is_close(b)) report(b, b.normal, velocity());
      }
      Vec3 push;
      const auto leave = [&](auto first) {
        for (int sweep = 0; sweep < kPushes; ++sweep) {
          for (auto b = first; b != bodies.end(); ++b) {
            const Real least = b < fixed ? margin : std::max(margin, b->distance);
            const Real gap = b->distance + dot(b->normal, push);
            if (gap < least) push += b->normal * (least - gap);
          }
        }
      };
      leave(bodies.begin());
      leave(fixed);
      const Real size = length(push);
      if (!(size > 0)) return;
      const Vec3 direction = push * (1 / size);
      // Short enough that the next query finds what is in the way.
      Real distance = std::min({size, left, settings_.radius / 2});
      if (fixed != bodies.begin()) {
        only_fixed_ = true;
        distance = cast(position_, direction, distance).distance;
        only_fixed_ = false;
      }
      position_ += direction * distance;
      left -= distance;
      if (!(distance > 0)) return;
    }
  }

  /// Casts the capsule, and stops it where it is `skin` away from what it hits.
  Advance cast(const Vec3& from, const Vec3& direction, Real distance) {
    const Real reach = distance + 10 * settings_.skin;
    cast_.position = from;
    cast_.translation = direction * reach;
    std::optional<ShapeHit> hit = world_.cast_shape(cast_, filter_);
    if (hit && hit->distance < 0 && dot(direction, hit->normal) >= 0) {
      // Leaves a body that it overlaps, but not so far that it could pass another part of it.
      const BodyId ignored = std::exchange(ignored_, hit->body);
      distance = std::min(distance, settings_.radius / 2);
      hit = world_.cast_shape(cast_, filter_);
      ignored_ = ignored;
    }
    if (!hit) return {distance};
    const Real closing = -dot(direction, hit->normal);
    const Real free = closing > 0 ? hit->fraction * reach - settings_.skin / closing : 0;
    if (free >= distance) return {distance};
    return {std::max(free, Real(0)), hit};
  }

  /// Moves for dt from hit to hit.
  void advance() {
    Real left = dt_;
    for (int i = 0; i < kMoves && left > 0; ++i) {
      const Vec3 v = velocity();
      const Real speed = length(v);
      const Real distance = speed * left;
      if (!(distance > 0)) return;
      const Vec3 direction = v * (1 / speed);
      const Advance step = cast(position_, direction, distance);
      position_ += direction * step.distance;
      if (!step.hit) return;
      left *= 1 - step.distance / distance;
      const Vec3& normal = step.hit->normal;
      report(*step.hit, normal, v);
      if (is_walkable(normal) && (walking_ || dot(v, up_) <= 0)) {
        walking_ = true;
        rise_ = 0;
        ground_ = normal;
      } else if (!walking_ || !climb(normal, &left)) {
        normals_.push_back(normal);
        const Real least = support_ ? dot(support_->normal, up_) : 0;
        if (dot(normal, up_) > least) support_ = step.hit;
      }
    }
  }

  /// The velocity that all surfaces allow, without that of the ground.
  Vec3 velocity() const { return walking_ ? walking_velocity() : flying_velocity(); }

  /// Along the ground, in the direction of the horizontal velocity and with its speed.
  Vec3 walking_velocity() const {
    const Vec3 v = level_velocity();
    const Vec3 along = v - up_ * (dot(v, ground_) / dot(ground_, up_));
    const Real size = length(along);
    return size > 0 ? along * (length(v) / size) : v;
  }
  /// The horizontal velocity that walls allow. On ground with the normal g, the velocity
  /// v - up (v.g) / (up.g) does not enter a plane with the normal n if v does not enter the
  /// vertical plane with the normal n - g (n.up) / (g.up).
  Vec3 level_velocity() const {
    std::vector<Vec3> walls;
    for (const Vec3& n : normals_) {
      if (is_walkable(n)) continue;
      const Vec3 wall = n - ground_ * (dot(n, up_) / dot(ground_, up_));
      const Real size = length(wall);
      if (!(size > Real(1e-3))) return {};  // a ceiling that is parallel to the ground
      walls.push_back(wall * (1 / size));
    }
    return detail::slide_along(level_, walls);
  }
  /// Steep surfaces stop the horizontal velocity as walls do, so that nobody climbs them by
  /// walking. What is left slides down.
  Vec3 flying_velocity() const {
    std::vector<Vec3> walls;
    for (const Vec3& n : normals_) {
      const Vec3 wall = horizontal(n);
      const Real size = length(wall);
      if (dot(n, up_) < 0 || is_walkable(n) || !(size > 0)) continue;
      walls.push_back(wall * (1 / size));
    }
    return detail::slide_along(detail::slide_along(level_, walls) + up_ * rise_, normals_);
  }

  /// Tries to step onto what blocks a walk. If the way of this move is too short for that, it is
  /// extended beyond the edge.
  bool climb(const Vec3& normal, Real* left) {
    if (!(settings_.step_height > 0)) return false;
    const Vec3 way = level_velocity() * *left;
    const Vec3 wall = horizontal(normal);
    const Real size = length(wall);
    if (!(size > Real(1e-3))) return false;
    const Vec3 into = wall * (-1 / size);
    const Real depth = dot(way, into);
    if (!(depth > 0)) return false;
    const Real raise = cast(position_, up_, settings_.step_height).distance;
    Real done = 0;
    if (!climb_along(way, raise, &done)) {
      const Real least = 2 * settings_.skin;
      if (depth >= least || !climb_along(way + into * (least - depth), raise, &done)) return false;
    }
    *left *= 1 - done;
    return true;
  }
  /// @param done receives the part of the way
  bool climb_along(const Vec3& way, Real raise, Real* done) {
    const Vec3 raised = add_scaled(position_, up_, raise);
    const Real distance = length(way);
    if (!(distance > 0)) return false;
    const Vec3 direction = way * (1 / distance);
    const Real forward = cast(raised, direction, distance).distance;
    const Vec3 above = add_scaled(raised, direction, forward);
    const std::optional<Landing> landing = probe(above, raise + settings_.skin);
    if (!landing || !landing->walkable) return false;
    const Real height = dot(landing->hit.point - feet(), up_) + settings_.skin;
    const Real tolerance = settings_.skin / 10;
    if (height > settings_.step_height + tolerance) return false;
    if (raise - std::max(landing->drop, Real(0)) < tolerance / 10) return false;  // not higher
    position_ = add_scaled(above, up_, -std::max(landing->drop, Real(0)));
    ground_ = landing->surface;
    *done = forward / distance;
    return true;
  }

  /// The first surface below a position.
  std::optional<Landing> probe(const Vec3& from, Real reach) {
    cast_.position = from;
    cast_.translation = up_ * -reach;
    const std::optional<ShapeHit> hit = world_.cast_shape(cast_, filter_);
    if (!hit) return std::nullopt;
    const Real rise = dot(hit->normal, up_);
    if (!(rise > Real(1e-4))) return std::nullopt;  // beside the character
    Landing landing{*hit, 0, surface_at(*hit), false};
    landing.walkable = is_walkable(landing.surface);
    Real gap = settings_.skin / rise;
    if (dot(landing.surface, hit->normal) < Real(0.9999)) {
      // The hemisphere is above an edge: the height at which its distance from a point is `skin`.
      const Real lift = rise * settings_.radius;
      gap = square_root(lift * lift + settings_.skin * (2 * settings_.radius + settings_.skin)) -
            lift;
    }
    landing.drop = hit->fraction * reach - gap;
    return landing;
  }
  /// Normal of the face beside an edge. A ray that starts a little above the point of the hit, and
  /// farther from the axis, finds the upper face of a step below a capsule whose round end touches
  /// the edge.
  Vec3 surface_at(const ShapeHit& hit) const {
    const Real rise = dot(hit.normal, up_);
    if (rise > Real(0.9999)) return hit.normal;
    const Vec3 outwards = normalized(hit.normal - up_ * rise) * (settings_.skin * Real(-0.25));
    const Vec3 above = up_ * settings_.skin;
    const std::optional<RayHit> face =
        world_.cast_ray({hit.point + outwards + above, -up_, 2 * settings_.skin},
                        [&](BodyId id) { return id == hit.body; });
    // A ray that starts in a wall has the distance 0.
    return face && face->distance > 0 && is_walkable(face->normal) ? face->normal : hit.normal;
  }

  /// Stays on the ground, or finds out on which it lands or slides.
  void find_ground(CharacterState* state) {
    const Real skin = settings_.skin;
    if (walking_) {
      const std::optional<Landing> landing = probe(position_, settings_.step_height + 2 * skin);
      if (landing && landing->walkable) return stand(*landing, GroundState::ground, state);
      walking_ = false;
    }
    const Vec3 v = flying_velocity();
    if (dot(v, up_) >= kJumpSpeed) return;
    // Several steep surfaces may hold the character, which could never leave them if it did not
    // stand there. Jolt has this rule, too.
    if (support_ && rise_ < -kHeldSpeed && dot(v, up_) > -kHeldSpeed) {
      return stand({*support_, 0, support_->normal, false}, GroundState::ground, state);
    }
    const std::optional<Landing> landing = probe(position_, 6 * skin);
    if (!landing) return;
    const ShapeHit& hit = landing->hit;
    if (hit.fraction * 6 * skin * dot(hit.normal, up_) > 2 * skin) return;
    if (!is_walkable(hit.normal)) return stand(*landing, GroundState::steep, state);
    report(hit, hit.normal, v);
    walking_ = true;
    stand(*landing, GroundState::ground, state);
  }
  void stand(const Landing& landing, GroundState kind, CharacterState* state) {
    if (kind == GroundState::ground && landing.walkable) {
      ground_ = landing.surface;
      if (landing.drop >= 0) {
        position_ = add_scaled(position_, up_, -landing.drop);
      } else if (landing.drop < -kTolerance * settings_.skin) {
        position_ = add_scaled(position_, up_, cast(position_, up_, -landing.drop).distance);
      }
    }
    state->ground_state = kind;
    state->ground_body = landing.hit.body;
    state->ground_part = landing.hit.part;
    state->ground_normal = walking_ ? landing.surface : landing.hit.normal;
    state->ground_velocity = velocity_at(world_.state(landing.hit.body), feet());
  }

  /// Velocities on the ground are relative to its body.
  Vec3 final_velocity(const CharacterState& state) const {
    const bool stands = state.ground_state == GroundState::ground;
    Vec3 v = stands ? level_velocity() : flying_velocity();
    if (stands && standing_ && state.ground_body == before_.ground_body) return v;
    v += carrier_;
    if (stands) v = horizontal(v - state.ground_velocity);
    return v;
  }

  /// Adds a hit, or replaces a slower one of the same body.
  /// @param found a ShapeHit or a BodyDistance
  void report(const auto& found, const Vec3& normal, const Vec3& v) {
    const Vec3 relative = v + carrier_ - velocity_at(world_.state(found.body), found.point);
    const CharacterHit hit{found.body, found.point, normal,
                           std::max(-dot(relative, normal), Real(0)), found.part};
    const auto known = std::ranges::find(hits_, found.body, &CharacterHit::body);
    if (known == hits_.end()) {
      hits_.push_back(hit);
    } else if (hit.approach_speed > known->approach_speed) {
      *known = hit;
    }
  }

  const World& world_;
  const CharacterSettings& settings_;
  const CharacterState& before_;
  Real dt_;
  Vec3 up_;
  Real least_rise_;  ///< vertical component of the normal of the steepest walkable ground
  Vec3 position_;
  Real rise_;      ///< upward velocity
  Vec3 level_;     ///< horizontal velocity
  Vec3 carrier_;   ///< velocity of the ground at the start
  Vec3 ground_;    ///< normal of the ground, while the character walks
  bool standing_;  ///< on a body at the start
  bool held_;      ///< by steep surfaces at the start
  bool walking_;
  BodyId ignored_;           ///< by queries
  bool only_fixed_ = false;  ///< queries find only bodies that do not move
  BodyFilter filter_;
  ShapeCast cast_;
  std::vector<Vec3> normals_;        ///< of surfaces that blocked the move
  std::optional<ShapeHit> support_;  ///< that of these with the most upward normal
  std::vector<CharacterHit> hits_;
};

}  // namespace

CharacterMove move_character(const World& world, const CharacterSettings& settings,
                             const CharacterState& state, Real dt) {
  validate(settings, state, dt);
  return CharacterMover(world, settings, state, dt).run();
}

}  // namespace JFPX_ABI
}  // namespace jfpx

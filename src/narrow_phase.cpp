/// Gathers bounds, asks the collider, and tests what is no pair of spheres.
#include "src/narrow_phase.hpp"

#include <jfpx/intersect.hpp>

#include <algorithm>
#include <utility>

namespace jfpx::inline JFPX_ABI {
namespace {

bool near(const SphereInstance& a, const SphereInstance& b) {
  const Real most = a.radius + b.radius;
  return length_squared(a.centre - b.centre) <= most * most * (1 + 64 * kEpsilon);
}

template <class T>
void sort_if_needed(std::vector<T>* items) {
  if (!std::ranges::is_sorted(*items)) std::ranges::sort(*items);
}

/// Appends the contacts of two pieces of which one is no sphere.
class PairTest {
 public:
  using Piece = PieceTable::Piece;

  PairTest(const BodyStore& bodies, const PieceTable& pieces, std::vector<Contact>* contacts)
      : bodies_(bodies), pieces_(pieces), contacts_(contacts) {}

  /// Body a owns piece p, body b piece q; only q may be a wall.
  void operator()(std::uint32_t a, std::uint32_t b, Piece p, Piece q) const {
    if (pieces_.is_wall(q)) {
      const HalfSpace solid = pieces_.wall(q).solid_for(bodies_.moving.position[a]);
      if (pieces_.is_sphere(p)) {
        add(a, b, collide(pieces_.bounds(p), solid), 1);
      } else {
        add(a, b, collide(pieces_.box(p).box, pieces_.box(p).pose, solid));
      }
    } else if (pieces_.is_sphere(p)) {
      add(a, b, collide(pieces_.bounds(p), pieces_.box(q).box, pieces_.box(q).pose), 1);
    } else if (pieces_.is_sphere(q)) {
      add(a, b, collide(pieces_.bounds(q), pieces_.box(p).box, pieces_.box(p).pose), -1);
    } else {
      const PieceTable::PosedBox &first = pieces_.box(p), &second = pieces_.box(q);
      if (!may_touch(first.box, first.pose, second.box, second.pose)) return;
      add(a, b, collide(first.box, first.pose, second.box, second.pose));
    }
  }

 private:
  /// @param side 1 if the sphere of the touch is a's, -1 if it is b's
  void add(std::uint32_t a, std::uint32_t b, const Touch& touch, Real side) const {
    if (!touch.touching) return;
    const Vec3 normal = side < 0 ? -touch.normal : touch.normal;
    contacts_->push_back({a, b, normal, touch.point, touch.distance});
  }
  void add(std::uint32_t a, std::uint32_t b, const Manifold& manifold) const {
    for (int i = 0; i < manifold.count; ++i) {
      const ManifoldPoint& p = manifold.points[i];
      contacts_->push_back({a, b, manifold.normal, p.point, p.distance});
    }
  }

  const BodyStore& bodies_;
  const PieceTable& pieces_;
  std::vector<Contact>* contacts_;
};

}  // namespace

NarrowPhase::NarrowPhase(std::unique_ptr<SphereCollider> collider, BroadPhase broad_phase)
    : touches_(std::move(collider), broad_phase) {}

void NarrowPhase::set_bodies(const BodyStore& bodies) {
  pieces_.set_bodies(bodies);
  pieces_.place(bodies);
  touches_.set_spheres(pieces_.bounds());
}

std::uint64_t NarrowPhase::find_contacts(const BodyStore& bodies, std::vector<Contact>* contacts) {
  pieces_.place(bodies);
  candidates_.clear();
  find_sphere_pairs(bodies, contacts);
  const std::uint64_t sphere_contacts = contacts->size();
  find_obstacles(bodies);
  sort_if_needed(&candidates_);
  const PairTest test(bodies, pieces_, contacts);
  for (const Candidate& c : candidates_) test(c.a, c.b, c.piece_a, c.piece_b);
  return sphere_contacts;
}

/// Whether x is body a of its contacts with y.
bool NarrowPhase::comes_first(const BodyStore& bodies, std::uint32_t x, std::uint32_t y) const {
  const bool x_is_sphere = bodies.radius(x) > 0, y_is_sphere = bodies.radius(y) > 0;
  const bool assembly = std::holds_alternative<Assembly>(bodies.shape(x)) ||
                        std::holds_alternative<Assembly>(bodies.shape(y));
  if (!assembly && x_is_sphere && y_is_sphere) return x < y;
  if (!assembly && x_is_sphere != y_is_sphere) return x_is_sphere;
  if (bodies.movable(x) != bodies.movable(y)) return bodies.movable(x);
  return x < y;
}

NarrowPhase::Candidate NarrowPhase::ordered(const BodyStore& bodies, Piece x, Piece y) const {
  const std::uint32_t of_x = pieces_.body(x), of_y = pieces_.body(y);
  if (comes_first(bodies, of_x, of_y)) return {of_x, of_y, x, y};
  return {of_y, of_x, y, x};
}

/// Pairs in which a box takes part become candidates.
void NarrowPhase::find_sphere_pairs(const BodyStore& bodies, std::vector<Contact>* contacts) {
  const ContactSpan found = touches_.find(pieces_.bounds());
  hits_.clear();
  for (std::size_t i = 0; i < found.size(); ++i) {
    const std::uint32_t a = pieces_.body(found[i].a), b = pieces_.body(found[i].b);
    if (a == b || (!bodies.movable(a) && !bodies.movable(b))) continue;
    const Candidate pair = ordered(bodies, found[i].a, found[i].b);
    if (pieces_.is_sphere(found[i].b)) {
      hits_.push_back({pair, i});
    } else {
      candidates_.push_back(pair);
    }
  }
  sort_if_needed(&hits_);
  for (const SphereHit& hit : hits_) {
    const SphereContact& c = found[hit.index];
    const Vec3 point = middle_point(c.normal, c.distance, pieces_.bounds(c.b));
    const Vec3 normal = hit.pair.piece_a == c.a ? c.normal : -c.normal;
    contacts->push_back({hit.pair.a, hit.pair.b, normal, point, c.distance});
  }
}

void NarrowPhase::find_obstacles(const BodyStore& bodies) {
  for (Piece piece = 0; piece < pieces_.fixed_begin(); ++piece) {
    const std::uint32_t body = pieces_.body(piece);
    if (!bodies.movable(body)) continue;
    for (Piece fixed = pieces_.fixed_begin(); fixed < pieces_.size(); ++fixed) {
      if (may_touch(piece, fixed, bodies.moving.position[body])) {
        candidates_.push_back(ordered(bodies, piece, fixed));
      }
    }
  }
}

/// @param centre of mass of the body that the piece belongs to
bool NarrowPhase::may_touch(Piece piece, Piece fixed, const Vec3& centre) const {
  if (!pieces_.is_wall(fixed)) return near(pieces_.bounds(piece), pieces_.bounds(fixed));
  const HalfSpace solid = pieces_.wall(fixed).solid_for(centre);
  if (pieces_.is_sphere(piece)) return jfpx::may_touch(pieces_.bounds(piece), solid);
  return jfpx::may_touch(pieces_.box(piece).box, pieces_.box(piece).pose, solid);
}

}  // namespace jfpx::inline JFPX_ABI

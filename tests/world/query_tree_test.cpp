/// Tests of the tree of the queries: a linear scan finds the same, and the tree visits few bodies.
#include "src/world/queries/query_tree.hpp"

#include "tests/world/linear_queries.hpp"
#include "tests/world/random_bodies.hpp"

#include <set>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {
namespace {

Real random_sign(Random* random) { return random->below(2) == 0 ? Real(1) : Real(-1); }

/// 10 to a random power.
Real random_size(Random* random, int lowest, int highest) {
  const auto range = static_cast<std::uint64_t>(highest - lowest + 1);
  const int power = lowest + static_cast<int>(random->below(range));
  return random->uniform(1, 3) * static_cast<Real>(std::pow(10.0, power));
}

/// Bodies of all shapes and states, in a part of the world with a given centre and size.
class RandomPlace {
 public:
  RandomPlace(Random* random, Real size, const Vec3& centre)
      : random_(random), size_(size), centre_(centre) {}

  Vec3 point() const {
    Vec3 p = centre_ + random_->uniform_in_box({-3, -3, -3}, {3, 3, 3}) * size_;
    for (int i = 0; i < 3; ++i) p[i] = std::clamp(p[i], -kMaxCoordinate, kMaxCoordinate);
    return p;
  }
  Real length() const { return std::min(random_->uniform(Real(0.01), 1) * size_, Real(1e9)); }

  BodyDef body() const {
    BodyDef def = random_body(random_, 2);
    const auto scale = [this](auto& shape) {
      using S = std::decay_t<decltype(shape)>;
      const Real k = size_ * (random_->below(20) == 0 ? Real(3) : Real(1));
      const auto positive = [](Real x) {
        return std::max(x, std::numeric_limits<Real>::denorm_min());
      };
      if constexpr (std::is_same_v<S, Sphere>) shape.radius = positive(shape.radius * k);
      if constexpr (std::is_same_v<S, Capsule>) {
        shape.radius = positive(shape.radius * k);
        shape.half_height = positive(shape.half_height * k);
      }
      if constexpr (std::is_same_v<S, Box>) {
        for (int i = 0; i < 3; ++i) shape.half_extents[i] = positive(shape.half_extents[i] * k);
      }
    };
    std::visit(scale, def.shape);
    if (auto* mesh = std::get_if<TriangleMesh>(&def.shape)) {
      TriangleMeshDef scaled = mesh->def();
      const Real most = std::min(size_, kMaxCoordinate / 100);
      for (Vec3& vertex : scaled.vertices) vertex *= most;
      *mesh = TriangleMesh(std::move(scaled));
    }
    if (auto* heightfield = std::get_if<Heightfield>(&def.shape)) {
      HeightfieldDef scaled = heightfield->def();
      const Real most = std::min(size_, kMaxCoordinate / 100);
      scaled.spacing_x *= most;
      scaled.spacing_z *= most;
      for (Real& height : scaled.heights) height *= most;
      *heightfield = Heightfield(std::move(scaled));
    }
    if (auto* compound = std::get_if<Compound>(&def.shape)) {
      for (CompoundPart& part : compound->parts) {
        std::visit(scale, part.shape);
        part.position *= size_;
      }
    }
    def.position = point();
    const bool wall =
        std::holds_alternative<HalfSpace>(def.shape) || std::holds_alternative<Plane>(def.shape);
    // Masses of very small or large solids have no finite inertia.
    if (!(size_ > Real(0.01) && size_ < 100)) def.mass = 0;
    if (def.mass > 0 && std::holds_alternative<Compound>(def.shape)) def.mass = 0;
    if (def.mass == 0 && !wall && random_->below(3) == 0) {
      def.kinematic = true;
      def.velocity = random_->uniform_in_box({-1, -1, -1}, {1, 1, 1}) * size_;
    }
    // Coincident and aligned bodies, for ties.
    if (random_->below(4) == 0) def.orientation = {};
    if (random_->below(4) == 0) def.position = centre_;
    return def;
  }

  /// A direction; in some cases along an axis, or nearly so.
  Vec3 direction() const {
    Vec3 d = random_direction(random_);
    if (random_->below(3) != 0) return d;
    Vec3 axis;
    axis[static_cast<int>(random_->below(3))] = random_sign(random_);
    const Real small[] = {Real(0),
                          -Real(0),
                          kEpsilon,
                          std::numeric_limits<Real>::denorm_min(),
                          std::numeric_limits<Real>::min(),
                          Real(1e-6)};
    return add_scaled(axis, d, small[random_->below(std::size(small))]);
  }

  Real distance() const {
    const Real distances[] = {Real(0), kInfinity, kInfinity, length(), 10 * length()};
    return distances[random_->below(std::size(distances))];
  }

 private:
  Random* random_;
  Real size_;
  Vec3 centre_;
};

/// A ray at a random point, or one that passes the surface of a body, often from far away.
Ray random_ray(Random* random, const RandomPlace& place, const World& world) {
  Ray ray{place.point(), place.direction(), place.distance()};
  if (world.bodies().empty() || random->below(3) == 0) return ray;
  const BodyId body = world.bodies()[random->below(world.bodies().size())];
  const Vec3 centre = world.state(body).position;
  Real radius = place.length();
  if (const auto* sphere = std::get_if<Sphere>(&world.shape(body))) radius = sphere->radius;
  if (const auto* box = std::get_if<Box>(&world.shape(body))) radius = length(box->half_extents);
  if (const auto* capsule = std::get_if<Capsule>(&world.shape(body))) radius = capsule->radius;
  const Vec3 beside = normalized(cross(ray.direction, random_direction(random)));
  const Vec3 target =
      add_scaled(centre, beside, radius * random->uniform(Real(0.999), Real(1.001)));
  const Real back = random->below(2) == 0 ? place.length() : random_size(random, -3, 8);
  const Vec3 from = add_scaled(target, ray.direction, -back);
  for (int i = 0; i < 3; ++i) {
    if (!(absolute(from[i]) <= kMaxCoordinate)) return ray;
  }
  ray.origin = from;
  // Aimed again after the origin was rounded, or from the origin to the target.
  if (random->below(2) == 0 && length(target - from) > 0) ray.direction = target - from;
  return ray;
}

void expect_same_rays(Random* random, const RandomPlace& place, const World& world,
                      const LinearQueries& scan, std::uint64_t* hits) {
  Ray ray = random_ray(random, place, world);
  const std::vector<RayHit> expected = scan.cast_ray_through(ray);
  ASSERT_EQ(world.cast_ray_through(ray), expected);
  ASSERT_EQ(world.cast_ray(ray), scan.cast_ray(ray));
  *hits += expected.size();
  if (expected.empty()) return;
  // A length that ends exactly at a hit.
  const RayHit& last = expected[random->below(expected.size())];
  ray.max_distance = last.distance;
  ASSERT_EQ(world.cast_ray_through(ray), scan.cast_ray_through(ray));
  ASSERT_EQ(world.cast_ray(ray), scan.cast_ray(ray));
  const auto odd = [&last](BodyId id) { return id.index % 2 == 1 && id != last.body; };
  ray.max_distance = kInfinity;
  ASSERT_EQ(world.cast_ray_through(ray, odd), scan.cast_ray_through(ray, odd));
  ASSERT_EQ(world.cast_ray(ray, odd), scan.cast_ray(ray, odd));
}

void expect_same_overlaps(Random* random, const RandomPlace& place, const World& world,
                          const LinearQueries& scan, std::uint64_t* found) {
  Vec3 centre = place.point();
  Quat orientation = random_rotation(random);
  const Sphere sphere{place.length()};
  Box box{{place.length(), place.length(), place.length()}};
  if (!world.bodies().empty() && random->below(2) == 0) {
    // Nearly touching a body, boxes nearly parallel.
    const BodyId body = world.bodies()[random->below(world.bodies().size())];
    const BodyState state = world.state(body);
    Vec3 away = normalized(place.direction());
    Real distance = sphere.radius;
    if (const auto* other = std::get_if<Sphere>(&world.shape(body))) distance += other->radius;
    if (const auto* other = std::get_if<Box>(&world.shape(body))) {
      const int axis = static_cast<int>(random->below(3));
      away = to_matrix(state.orientation).column(axis);
      distance = other->half_extents[axis] + box.half_extents[axis];
      orientation = normalized(
          add_scaled(state.orientation, random_direction(random), random->uniform(0, Real(1e-3))));
    }
    const Real error = random->below(2) == 0 ? Real(5e-4) : 2 * kEpsilon;
    centre = add_scaled(state.position, away, distance * (1 + random->uniform(-error, error)));
    for (int i = 0; i < 3; ++i) centre[i] = std::clamp(centre[i], -kMaxCoordinate, kMaxCoordinate);
  }
  const std::vector<BodyId> by_sphere = scan.overlapping(sphere, centre);
  const std::vector<BodyId> by_box = scan.overlapping(box, centre, orientation);
  ASSERT_EQ(world.overlapping(sphere, centre), by_sphere);
  ASSERT_EQ(world.overlapping(box, centre, orientation), by_box);
  *found += by_sphere.size() + by_box.size();
}

/// A solid of the size of a place.
SolidShape random_solid(Random* random, const RandomPlace& place, Real size) {
  const Real a = place.length(), b = place.length();
  switch (random->below(6)) {
    case 0:
      return Sphere{a};
    case 1:
      return Box{{a, b, place.length()}};
    case 2:
      return Capsule{a, b};
    case 3:
      return Cylinder{a, b};
    case 4:
      return Cone{a, b};
    default:
      if (!(size < Real(1e6))) return Sphere{a};
      return random_hull(random).scaled({size, size, size});
  }
}

void expect_same_casts(Random* random, const RandomPlace& place, const World& world,
                       const LinearQueries& scan, Real size, std::uint64_t* hits) {
  ShapeCast cast;
  cast.shape = random_solid(random, place, size);
  cast.orientation = random->below(3) == 0 ? Quat{} : random_rotation(random);
  const Ray ray = random_ray(random, place, world);
  cast.position = ray.origin;
  const Real lengths[] = {0, place.length(), 10 * place.length(), random_size(random, -3, 8)};
  cast.translation = normalized(ray.direction) * lengths[random->below(std::size(lengths))];
  for (int i = 0; i < 3; ++i) {
    if (!(absolute(cast.position[i] + cast.translation[i]) <= kMaxCoordinate)) return;
  }
  const std::vector<ShapeHit> expected = scan.cast_shape_through(cast);
  ASSERT_EQ(world.cast_shape_through(cast), expected);
  const std::optional<ShapeHit> first = world.cast_shape(cast);
  ASSERT_EQ(first.has_value(), !expected.empty());
  if (!first) return;
  ASSERT_EQ(*first, expected[0]);
  *hits += expected.size();
  const auto odd = [&](BodyId id) { return id.index % 2 == 1; };
  ASSERT_EQ(world.cast_shape_through(cast, odd), scan.cast_shape_through(cast, odd));
}

void expect_same_distances(Random* random, const RandomPlace& place, const World& world,
                           const LinearQueries& scan, Real size, std::uint64_t* found) {
  DistanceQuery query;
  query.position = random_ray(random, place, world).origin;
  if (random->below(3) != 0) query.shape = random_solid(random, place, size);
  if (random->below(3) != 0) query.orientation = random_rotation(random);
  if (random->below(2) == 0) query.max_distance = place.length() * random->uniform(0, 4);
  std::vector<BodyDistance> expected = scan.bodies_within(query);
  ASSERT_EQ(world.bodies_within(query), expected);
  const std::optional<BodyDistance> closest = world.closest_body(query);
  ASSERT_EQ(closest.has_value(), !expected.empty());
  if (!closest) return;
  ASSERT_EQ(*closest, expected[0]);
  *found += expected.size();
  const auto odd = [&](BodyId id) { return id.index % 2 == 1; };
  const std::vector<BodyDistance> of_odd = world.bodies_within(query, odd);
  const std::optional<BodyDistance> closest_odd = world.closest_body(query, odd);
  std::erase_if(expected, [&](const BodyDistance& one) { return !odd(one.body); });
  ASSERT_EQ(of_odd, expected);
  ASSERT_EQ(closest_odd.has_value(), !expected.empty());
  if (!closest_odd) return;
  ASSERT_EQ(*closest_odd, expected[0]);
  // A limit that ends exactly at a body.
  query.max_distance = std::max(expected[random->below(expected.size())].distance, Real(0));
  std::erase_if(expected, [&](const auto& one) { return one.distance > query.max_distance; });
  ASSERT_EQ(world.bodies_within(query, odd), expected);
}

void change(Random* random, const RandomPlace& place, World* world) {
  const auto any = [&] { return world->bodies()[random->below(world->bodies().size())]; };
  switch (random->below(world->bodies().empty() ? 1 : 5)) {
    case 0:
      for (std::uint64_t i = random->below(9); i > 0; --i) world->add(place.body());
      return;
    case 1:
      return world->remove(any());
    case 2:
      return world->set_state(any(), {place.point(), random_rotation(random), {}, {}});
    case 3:
      return;
    default:
      world->step();
  }
}

TEST(QueryTree, QueriesFindWhatALinearScanFinds) {
  const std::uint64_t seed = fresh_seed();
  SCOPED_TRACE(trace(seed));
  Random random(seed);
  std::uint64_t hits = 0, found = 0, cast_hits = 0, distances = 0;
  for (int run = 0; run < 100; ++run) {
    const bool usual = run % 2 == 0;
    const Real size = usual ? 1 : random_size(&random, -30, 8);
    const Vec3 direction = random_direction(&random);
    const Vec3 centre =
        usual || random.below(2) == 0 ? Vec3{} : direction * random_size(&random, -3, 8);
    const RandomPlace place(&random, size, centre);
    Scene scene;
    scene.resolver.max_iterations = 20;
    scene.sleep.epsilon = Real(0.5);
    for (std::uint64_t i = random.below(random.below(2) == 0 ? 4 : 120); i > 0; --i) {
      scene.bodies.push_back(place.body());
    }
    World world(scene);
    for (int round = 0; round < 10; ++round) {
      const LinearQueries scan(world);
      for (int i = 0; i < 20; ++i) {
        expect_same_rays(&random, place, world, scan, &hits);
        expect_same_overlaps(&random, place, world, scan, &found);
        // Contacts of smaller cylinders and cones have points that are no numbers.
        const bool casts = i == 0 && size > Real(1e-6);
        if (casts) expect_same_casts(&random, place, world, scan, size, &cast_hits);
        if (casts && round % 2 == 0)
          expect_same_distances(&random, place, world, scan, size, &distances);
        if (HasFatalFailure()) return;
      }
      change(&random, place, &world);
    }
  }
  EXPECT_GT(hits, 30000u);
  EXPECT_GT(found, 30000u);
  EXPECT_GT(cast_hits, 300u);
  EXPECT_GT(distances, 3000u);
}

/// Rounding makes a ray from far away hit spheres beside it, also outside of their exact bounds.
TEST(QueryTree, RaysFromFarAwayFindWhatALinearScanFinds) {
  const std::uint64_t seed = fresh_seed();
  SCOPED_TRACE(trace(seed));
  Random random(seed);
  std::uint64_t hits = 0;
  for (int run = 0; run < 100; ++run) {
    const Real far = random_size(&random, 0, 8);
    const Vec3 origin = random_direction(&random) * far;
    Scene scene;
    for (int i = 0; i < 100; ++i) {
      // About the error of the distance from the line.
      const Real near = far * kEpsilon * random.uniform(0, 20);
      const Vec3 position = random.uniform_in_box({-1, -1, -1}, {1, 1, 1}) * near;
      BodyDef def = ball(position, std::max(near * random.uniform(0, 1), Real(1e-9)), 0);
      if (i % 2 == 0) {
        const Real radius = std::get<Sphere>(def.shape).radius;
        def.shape = Box{{radius, radius, radius}};
        def.orientation = random_rotation(&random);
      }
      scene.bodies.push_back(def);
    }
    const World world(scene);
    const LinearQueries scan(world);
    for (int i = 0; i < 50; ++i) {
      const Vec3 target = scene.bodies[random.below(100)].position;
      const Ray ray{origin, target - origin};
      const std::vector<RayHit> expected = scan.cast_ray_through(ray);
      ASSERT_EQ(world.cast_ray_through(ray), expected);
      ASSERT_EQ(world.cast_ray(ray), scan.cast_ray(ray));
      hits += expected.size();
    }
  }
  EXPECT_GT(hits, 1000u);
}

/// collide() ignores the common normal of nearly parallel edges, so it reports boxes as touching
/// that are apart along that normal, here the x axis.
TEST(QueryTree, OverlapsAlongNearlyParallelEdgesFindWhatALinearScanFinds) {
  const std::uint64_t seed = fresh_seed();
  SCOPED_TRACE(trace(seed));
  Random random(seed);
  int apart = 0;
  for (int run = 0; run < 3000; ++run) {
    const auto square_column = [&random] {
      const Real half_width = random.uniform(Real(0.1), 1);
      return Box{{half_width, half_width, random.uniform(1, 30)}};
    };
    const auto reach = [&](const Box& box, const Quat& q) {
      const Vec3 row = to_matrix(q).row[0];
      return dot(box.half_extents, {absolute(row.x), absolute(row.y), absolute(row.z)});
    };
    // An eighth of a turn, so that edges of the columns face each other.
    const Quat about_z = normalized(Quat{1 + square_root(2), 0, 0, 1});
    const Real angle = square_root(kEpsilon) * random.uniform(0, Real(2.2));
    const Quat tilted = normalized(Quat{1, angle / 2, 0, 0} * about_z);
    BodyDef def;
    const Box box = square_column(), query = square_column();
    def.shape = box;
    def.orientation = about_z;
    def.mass = 0;
    Scene scene;
    scene.bodies = {def};
    const World world(scene);
    const Real gap = angle * random.uniform(0, 10);
    const Vec3 centre{reach(box, about_z) + reach(query, tilted) + gap, 0, 0};
    const std::vector<BodyId> expected = LinearQueries(world).overlapping(query, centre, tilted);
    ASSERT_EQ(world.overlapping(query, centre, tilted), expected);
    if (gap > 100 * kEpsilon && !expected.empty()) ++apart;
  }
  EXPECT_GT(apart, 100);
}

/// A ray in the plane of a tiny, flat heightfield: the distances of triangles ahead are lost to
/// underflow.
TEST(QueryTree, RaysInThePlaneOfATinyHeightfieldFindWhatALinearScanFinds) {
  Scene scene;
  BodyDef def;
  HeightfieldDef flat;
  flat.rows = 4, flat.columns = 6;
  flat.spacing_x = flat.spacing_z = Real(1.17e-15);
  flat.heights.resize(24);
  def.shape = Heightfield(std::move(flat));
  def.mass = 0;
  def.position = {569878, -7945235, -12129068};
  scene.bodies = {def};
  const World world(scene);
  const LinearQueries scan(world);
  const Real least = std::numeric_limits<Real>::min();
  for (const Real part : {Real(0.0811), Real(-0.0811), Real(1)}) {
    const Real along_y = part * least;
    Ray ray{def.position, {1, along_y, Real(0.9965) * least}};
    for (const Real most : {Real(0), Real(1e-15), kInfinity}) {
      ray.max_distance = most;
      EXPECT_EQ(world.cast_ray_through(ray), scan.cast_ray_through(ray)) << along_y << ' ' << most;
    }
  }
}

TEST(QueryTree, AFilterIsCalledAtMostOnceForEachHitBody) {
  const std::uint64_t seed = fresh_seed();
  SCOPED_TRACE(trace(seed));
  Random random(seed);
  const RandomPlace place(&random, 1, {});
  Scene scene;
  for (int i = 0; i < 300; ++i) scene.bodies.push_back(place.body());
  const World world(scene);
  for (int i = 0; i < 200; ++i) {
    const Ray ray{place.point(), place.direction(), place.distance()};
    std::set<std::uint32_t> hit, of_closest, of_all;
    for (const RayHit& each : world.cast_ray_through(ray)) hit.insert(each.body.index);
    const auto record = [](std::set<std::uint32_t>* called, bool answer) {
      return [=](BodyId id) {
        EXPECT_TRUE(called->insert(id.index).second);
        return answer;
      };
    };
    world.cast_ray(ray, record(&of_closest, true));
    EXPECT_TRUE(std::ranges::includes(hit, of_closest));
    EXPECT_EQ(of_closest.empty(), hit.empty());
    world.cast_ray_through(ray, record(&of_all, true));
    EXPECT_EQ(of_all, hit);
    of_closest.clear();
    EXPECT_FALSE(world.cast_ray(ray, record(&of_closest, false)));
    EXPECT_EQ(of_closest, hit);
  }
}

/// Balls at random positions, and the number of bodies that queries among them visit.
struct Balls {
  BodyStore bodies{Real(0.01), {}};
  QueryTree tree;
  Random random{1};

  void add(const Vec3& position, Real radius) { bodies.add(ball(position, radius, 0)); }
  Vec3 point() { return random.uniform_in_box({-50, -50, -50}, {50, 50, 50}); }

  /// The mean number of 200 short overlaps and of 200 rays that end at the closest hit.
  double visits() {
    tree.build(bodies);
    std::uint64_t count = 0;
    for (int i = 0; i < 200; ++i) {
      tree.visit_around(point(), {1, 1, 1}, [&](std::uint32_t) { ++count; });
      const Ray ray{point() * 2, random_direction(&random)};
      Real closest = kInfinity;
      tree.visit_along(ray, [&](std::uint32_t body) {
        ++count;
        const SphereInstance sphere{bodies.moving.position[body], bodies.radius(body)};
        const detail::RayEntry entry = detail::enter(ray.origin, ray.direction, sphere);
        if (entry.hit) closest = std::min(closest, entry.distance);
        return closest;
      });
    }
    return static_cast<double>(count) / 400;
  }
};

TEST(QueryTree, VisitsFewOfManyBodies) {
  for (const Real radius : {Real(0.5), Real(0.05)}) {
    Balls balls;
    for (int i = 0; i < 20000; ++i) balls.add(balls.point(), radius);
    EXPECT_LT(balls.visits(), 10);
  }
}

TEST(QueryTree, LargeAndDistantBodiesDoNotMakeItVisitMore) {
  Balls balls;
  for (int i = 0; i < 20000; ++i) balls.add(balls.point(), i % 20 == 0 ? Real(5) : Real(0.2));
  balls.add({0, -1020, 0}, 1000);
  balls.add({Real(1e9), 0, 0}, 1);
  balls.add({0, Real(-1e6), 0}, 1);
  EXPECT_LT(balls.visits(), 40);
}

TEST(QueryTree, TakesNoBodiesAFewAndManyAtOnePoint) {
  for (const int count : {0, 1, 2, 7, 8, 9, 63, 64, 65, 66, 72, 73, 513, 4097}) {
    Balls balls;
    for (int i = 0; i < count; ++i) balls.add({1, 2, 3}, Real(0.5));
    balls.tree.build(balls.bodies);
    for (const Vec3& direction : {Vec3{0, 0, 1}, Vec3{1, 0, 0}}) {
      std::vector<std::uint32_t> visited;
      balls.tree.visit_along({{1, 2, 0}, direction}, [&](std::uint32_t body) {
        visited.push_back(body);
        return kInfinity;
      });
      std::ranges::sort(visited);
      ASSERT_EQ(visited.size(), direction.z > 0 ? static_cast<std::size_t>(count) : 0u);
      for (std::uint32_t i = 0; i < visited.size(); ++i) ASSERT_EQ(visited[i], i);
    }
  }
}

}  // namespace
}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx

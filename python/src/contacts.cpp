/// Binding of the contacts, events, queries and characters of worlds. A body in an array is its
/// BodyId::index.
#include <jfpx/character.hpp>

#include "python/src/world.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace python {
namespace {

using Flags = Vector<bool>;

/// @throws ConcurrentUse if a step was made since the arrays were allocated
void require_size(const Vector<Real>& array, std::size_t size) {
  if (array.shape(0) != size) throw ConcurrentUse(UseGuard::message("world"));
}

void write_contacts(const PythonWorld& self, const Rows<std::int64_t>& pairs,
                    const Rows<Real>& normals, const Rows<Real>& points,
                    const Vector<Real>& distances, const Vector<Real>& frictions,
                    const Vector<Real>& restitutions, const Flags& sensors) {
  const std::span<const Contact> contacts = self.get().contacts();
  require_size(distances, contacts.size());
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const Contact& c = contacts[i];
    pairs(0, i) = c.a.index;
    pairs(1, i) = c.b.index;
    set_row(normals, i, c.normal);
    set_row(points, i, c.point);
    distances(i) = c.distance;
    frictions(i) = c.friction;
    restitutions(i) = c.restitution;
    sensors(i) = c.sensor;
  }
}

void write_forces(const PythonWorld& self, const Rows<std::int64_t>& pairs,
                  const Rows<Real>& normals, const Rows<Real>& arms_a, const Rows<Real>& arms_b,
                  const Rows<Real>& forces, const Rows<Real>& torques,
                  const Rows<std::int64_t>& parts) {
  const std::span<const ContactForce> all = self.get().contact_forces();
  if (normals.shape(0) != all.size()) throw ConcurrentUse(UseGuard::message("world"));
  for (std::size_t i = 0; i < all.size(); ++i) {
    const ContactForce& f = all[i];
    pairs(0, i) = f.a.index;
    pairs(1, i) = f.b.index;
    set_row(normals, i, f.normal);
    set_row(arms_a, i, f.arm_a);
    set_row(arms_b, i, f.arm_b);
    set_row(forces, i, f.force);
    set_row(torques, i, f.torque);
    parts(0, i) = f.part_a;
    parts(1, i) = f.part_b;
  }
}

void write_events(const PythonWorld& self, const Vector<std::int64_t>& phases,
                  const Rows<std::int64_t>& pairs, const Vector<std::int64_t>& counts,
                  const Rows<Real>& normals, const Rows<Real>& points,
                  const Vector<Real>& distances) {
  const std::span<const ContactEvent> events = self.get().contact_events();
  require_size(distances, events.size());
  for (std::size_t i = 0; i < events.size(); ++i) {
    const ContactEvent& e = events[i];
    phases(i) = static_cast<std::int64_t>(e.phase);
    pairs(0, i) = e.a.index;
    pairs(1, i) = e.b.index;
    counts(i) = e.contacts;
    set_row(normals, i, e.normal);
    set_row(points, i, e.point);
    distances(i) = e.distance;
  }
}

void write_hits(const PythonWorld& self, const Rows<std::int64_t>& pairs, const Rows<Real>& normals,
                const Rows<Real>& points, const Vector<Real>& speeds,
                const Rows<std::int64_t>& parts) {
  const std::span<const HitEvent> hits = self.get().hit_events();
  require_size(speeds, hits.size());
  for (std::size_t i = 0; i < hits.size(); ++i) {
    pairs(0, i) = hits[i].a.index;
    pairs(1, i) = hits[i].b.index;
    set_row(normals, i, hits[i].normal);
    set_row(points, i, hits[i].point);
    speeds(i) = hits[i].approach_speed;
    parts(0, i) = hits[i].part_a;
    parts(1, i) = hits[i].part_b;
  }
}

Ray to_ray(const Triple& origin, const Triple& direction, double max_distance) {
  return {.origin = to_vec3(origin),
          .direction = to_vec3(direction),
          .max_distance = static_cast<Real>(max_distance)};
}

nb::tuple to_python(const RayHit& hit) {
  return nb::make_tuple(to_tuple(hit.body), static_cast<double>(hit.distance), to_triple(hit.point),
                        to_triple(hit.normal), hit.part);
}

/// The shape of the only body of a scene.
SolidShape to_solid_shape(const Scene& scene) {
  const auto convert = [](const auto& shape) -> SolidShape {
    using S = std::decay_t<decltype(shape)>;
    if constexpr (std::is_constructible_v<SolidShape, const S&>) {
      return shape;
    } else {
      throw InvalidArgument(
          "the shape is no solid; it must be a sphere, a box, a capsule, a hull, a cylinder or a "
          "cone");
    }
  };
  return std::visit(convert, scene.bodies.at(0).shape);
}

ShapeCast to_cast(const Scene& shape, const Triple& position, const Triple& translation,
                  const Quadruple& orientation) {
  return {to_solid_shape(shape), to_vec3(position), to_quat(orientation), to_vec3(translation)};
}

nb::tuple to_python(const ShapeHit& hit) {
  return nb::make_tuple(to_tuple(hit.body), static_cast<double>(hit.fraction), to_triple(hit.point),
                        to_triple(hit.normal), static_cast<double>(hit.distance), hit.part);
}

/// The first hit of each cast of a solid; -1 for the body of a cast without a hit.
void cast_shapes(const PythonWorld& self, const Scene& shape, const Rows<const Real>& positions,
                 const Rows<const Real>& translations, const Rows<const Real>& orientations,
                 const Vector<std::int64_t>& bodies, const Vector<Real>& fractions,
                 const Rows<Real>& points, const Rows<Real>& normals, const Vector<Real>& distances,
                 const Vector<std::int64_t>& parts) {
  ShapeCast cast{to_solid_shape(shape), {}, {}, {}};
  self.for_each_query(bodies.shape(0), [&](const World& world, std::size_t i) {
    const std::size_t turned = orientations.shape(0) == 1 ? 0 : i;
    cast.position = vec3_at(positions, i);
    cast.translation = vec3_at(translations, i);
    cast.orientation = {orientations(turned, 0), orientations(turned, 1), orientations(turned, 2),
                        orientations(turned, 3)};
    std::optional<ShapeHit> hit;
    try {
      hit = world.cast_shape(cast);
    } catch (const InvalidArgument& e) {
      throw InvalidArgument("cast " + std::to_string(i) + ": " + e.what());
    }
    bodies(i) = hit ? std::int64_t{hit->body.index} : -1;
    const ShapeHit values = hit.value_or(ShapeHit{});
    fractions(i) = hit ? values.fraction : std::numeric_limits<Real>::infinity();
    set_row(points, i, values.point);
    set_row(normals, i, values.normal);
    distances(i) = values.distance;
    parts(i) = values.part;
  });
}

/// @param shape null: a point
DistanceQuery to_query(const Scene* shape, const Triple& position, const Quadruple& orientation,
                       double max_distance) {
  return {to_vec3(position), shape != nullptr ? to_solid_shape(*shape) : Sphere{0},
          to_quat(orientation), static_cast<Real>(max_distance)};
}

nb::tuple to_python(const BodyDistance& found) {
  return nb::make_tuple(to_tuple(found.body), static_cast<double>(found.distance),
                        to_triple(found.point), to_triple(found.query_point),
                        to_triple(found.normal), found.part);
}

/// The closest body of each position; -1 if there is none.
void closest_bodies(const PythonWorld& self, const Scene* shape, const Rows<const Real>& positions,
                    const Rows<const Real>& orientations, const Vector<const Real>& max_distances,
                    const Vector<std::int64_t>& bodies, const Vector<Real>& distances,
                    const Rows<Real>& points, const Rows<Real>& query_points,
                    const Rows<Real>& normals, const Vector<std::int64_t>& parts) {
  DistanceQuery query;
  if (shape != nullptr) query.shape = to_solid_shape(*shape);
  self.for_each_query(bodies.shape(0), [&](const World& world, std::size_t i) {
    const std::size_t turned = orientations.shape(0) == 1 ? 0 : i;
    query.position = vec3_at(positions, i);
    query.orientation = {orientations(turned, 0), orientations(turned, 1), orientations(turned, 2),
                         orientations(turned, 3)};
    query.max_distance = max_distances(max_distances.shape(0) == 1 ? 0 : i);
    std::optional<BodyDistance> found;
    try {
      found = world.closest_body(query);
    } catch (const InvalidArgument& e) {
      throw InvalidArgument("query " + std::to_string(i) + ": " + e.what());
    }
    bodies(i) = found ? std::int64_t{found->body.index} : -1;
    const BodyDistance values = found.value_or(BodyDistance{});
    distances(i) = found ? values.distance : std::numeric_limits<Real>::infinity();
    set_row(points, i, values.point);
    set_row(query_points, i, values.query_point);
    set_row(normals, i, values.normal);
    parts(i) = values.part;
  });
}

/// The first hit of each ray; -1 for the body of a ray without a hit.
void cast_rays(const PythonWorld& self, const Rows<const Real>& origins,
               const Rows<const Real>& directions, const Vector<const Real>& max_distances,
               const Vector<std::int64_t>& bodies, const Vector<Real>& distances,
               const Rows<Real>& points, const Rows<Real>& normals,
               const Vector<std::int64_t>& parts) {
  self.for_each_query(bodies.shape(0), [&](const World& world, std::size_t i) {
    const std::size_t limit = max_distances.shape(0) == 1 ? 0 : i;
    std::optional<RayHit> hit;
    try {
      hit = world.cast_ray({.origin = vec3_at(origins, i),
                            .direction = vec3_at(directions, i),
                            .max_distance = max_distances(limit)});
    } catch (const InvalidArgument& e) {
      throw InvalidArgument("ray " + std::to_string(i) + ": " + e.what());
    }
    bodies(i) = hit ? std::int64_t{hit->body.index} : -1;
    const RayHit values = hit.value_or(RayHit{});
    distances(i) = hit ? values.distance : std::numeric_limits<Real>::infinity();
    set_row(points, i, values.point);
    set_row(normals, i, values.normal);
    parts(i) = values.part;
  });
}

/// @param numbers radius, half_height, max_slope, step_height, skin
nb::tuple move_one(const PythonWorld& self, const std::array<double, 5>& numbers, const Triple& up,
                   const Triple& position, const Triple& velocity, int ground,
                   const std::optional<IdTuple>& body, const Triple& normal, double dt,
                   const nb::object& filter) {
  CharacterSettings settings;
  settings.radius = static_cast<Real>(numbers[0]);
  settings.half_height = static_cast<Real>(numbers[1]);
  settings.max_slope = static_cast<Real>(numbers[2]);
  settings.step_height = static_cast<Real>(numbers[3]);
  settings.skin = static_cast<Real>(numbers[4]);
  settings.up = to_vec3(up);
  settings.filter = to_filter(filter);
  CharacterState state;
  state.position = to_vec3(position);
  state.velocity = to_vec3(velocity);
  state.ground_state = static_cast<GroundState>(ground);
  if (body) state.ground_body = to_id(*body);
  state.ground_normal = to_vec3(normal);
  const CharacterMove move = move_character(self.get(), settings, state, static_cast<Real>(dt));
  nb::list hits;
  for (const CharacterHit& hit : move.hits) {
    hits.append(nb::make_tuple(to_tuple(hit.body), to_triple(hit.point), to_triple(hit.normal),
                               static_cast<double>(hit.approach_speed), hit.part));
  }
  const CharacterState& s = move.state;
  std::optional<IdTuple> below;
  if (s.ground_state != GroundState::air) below = to_tuple(s.ground_body);
  return nb::make_tuple(to_triple(s.position), to_triple(s.velocity),
                        static_cast<int>(s.ground_state), below, to_triple(s.ground_normal),
                        to_triple(s.ground_velocity), s.ground_part, hits);
}

std::vector<IdTuple> to_tuples(const std::vector<BodyId>& ids) {
  std::vector<IdTuple> tuples;
  for (const BodyId id : ids) tuples.push_back(to_tuple(id));
  return tuples;
}

}  // namespace

BodyFilter to_filter(const nb::object& filter) {
  if (filter.is_none()) return {};
  return [&filter](BodyId id) { return nb::cast<bool>(filter(to_tuple(id))); };
}

void bind_contacts(nb::class_<PythonWorld>& world) {
  world.def("contact_count", [](const PythonWorld& self) { return self.get().contacts().size(); })
      .def("write_contacts", &write_contacts)
      .def("event_count",
           [](const PythonWorld& self) { return self.get().contact_events().size(); })
      .def("write_events", &write_events)
      .def("force_count",
           [](const PythonWorld& self) { return self.get().contact_forces().size(); })
      .def("write_forces", &write_forces)
      .def("hit_count", [](const PythonWorld& self) { return self.get().hit_events().size(); })
      .def("write_hits", &write_hits)
      .def("cast_rays", &cast_rays)
      .def(
          "cast_ray",
          [](const PythonWorld& self, Triple origin, Triple direction, double max_distance,
             const nb::object& filter) -> std::optional<nb::tuple> {
            const auto hit =
                self.get().cast_ray(to_ray(origin, direction, max_distance), to_filter(filter));
            if (!hit) return std::nullopt;
            return to_python(*hit);
          },
          nb::arg("origin"), nb::arg("direction"), nb::arg("max_distance"),
          nb::arg("filter").none())
      .def(
          "cast_ray_through",
          [](const PythonWorld& self, Triple origin, Triple direction, double max_distance,
             const nb::object& filter) {
            nb::list hits;
            for (const RayHit& hit : self.get().cast_ray_through(
                     to_ray(origin, direction, max_distance), to_filter(filter))) {
              hits.append(to_python(hit));
            }
            return hits;
          },
          nb::arg("origin"), nb::arg("direction"), nb::arg("max_distance"),
          nb::arg("filter").none())
      .def("cast_shapes", &cast_shapes)
      .def(
          "cast_shape",
          [](const PythonWorld& self, const Scene& shape, Triple position, Triple translation,
             Quadruple orientation, const nb::object& filter) -> std::optional<nb::tuple> {
            const auto hit = self.get().cast_shape(
                to_cast(shape, position, translation, orientation), to_filter(filter));
            if (!hit) return std::nullopt;
            return to_python(*hit);
          },
          nb::arg("shape"), nb::arg("position"), nb::arg("translation"), nb::arg("orientation"),
          nb::arg("filter").none())
      .def(
          "cast_shape_through",
          [](const PythonWorld& self, const Scene& shape, Triple position, Triple translation,
             Quadruple orientation, const nb::object& filter) {
            nb::list hits;
            for (const ShapeHit& hit : self.get().cast_shape_through(
                     to_cast(shape, position, translation, orientation), to_filter(filter))) {
              hits.append(to_python(hit));
            }
            return hits;
          },
          nb::arg("shape"), nb::arg("position"), nb::arg("translation"), nb::arg("orientation"),
          nb::arg("filter").none())
      .def("closest_bodies", &closest_bodies, nb::arg("shape").none(), nb::arg("positions"),
           nb::arg("orientations"), nb::arg("max_distances"), nb::arg("bodies"),
           nb::arg("distances"), nb::arg("points"), nb::arg("query_points"), nb::arg("normals"),
           nb::arg("parts"))
      .def(
          "closest_body",
          [](const PythonWorld& self, const Scene* shape, Triple position, Quadruple orientation,
             double max_distance, const nb::object& filter) -> std::optional<nb::tuple> {
            const auto found = self.get().closest_body(
                to_query(shape, position, orientation, max_distance), to_filter(filter));
            if (!found) return std::nullopt;
            return to_python(*found);
          },
          nb::arg("shape").none(), nb::arg("position"), nb::arg("orientation"),
          nb::arg("max_distance"), nb::arg("filter").none())
      .def(
          "bodies_within",
          [](const PythonWorld& self, const Scene* shape, Triple position, Quadruple orientation,
             double max_distance, const nb::object& filter) {
            nb::list all;
            for (const BodyDistance& found : self.get().bodies_within(
                     to_query(shape, position, orientation, max_distance), to_filter(filter))) {
              all.append(to_python(found));
            }
            return all;
          },
          nb::arg("shape").none(), nb::arg("position"), nb::arg("orientation"),
          nb::arg("max_distance"), nb::arg("filter").none())
      .def("move_character", &move_one, nb::arg("numbers"), nb::arg("up"), nb::arg("position"),
           nb::arg("velocity"), nb::arg("ground"), nb::arg("body").none(), nb::arg("normal"),
           nb::arg("dt"), nb::arg("filter").none())
      .def(
          "overlapping",
          [](const PythonWorld& self, const Scene& shape, Triple position, Quadruple orientation,
             const nb::object& filter) {
            return to_tuples(self.get().overlapping(to_solid_shape(shape), to_vec3(position),
                                                    to_quat(orientation), to_filter(filter)));
          },
          nb::arg("shape"), nb::arg("position"), nb::arg("orientation"), nb::arg("filter").none())
      .def("overlapping_sphere",
           [](const PythonWorld& self, Real radius, Triple centre) {
             return to_tuples(self.get().overlapping(Sphere{radius}, to_vec3(centre)));
           })
      .def("overlapping_box",
           [](const PythonWorld& self, Triple half_extents, Triple centre, Quadruple orientation) {
             return to_tuples(self.get().overlapping(Box{to_vec3(half_extents)}, to_vec3(centre),
                                                     to_quat(orientation)));
           });
}

}  // namespace python
}  // namespace JFPX_ABI
}  // namespace jfpx

/// Binding of the sphere collider: a search keeps its contacts, which are then written to arrays
/// of their number. The caller keeps other threads away between the two; the calls release
/// Python's global lock, and Ctrl-C ends them.
#include "python/src/bindings.hpp"

#include <algorithm>
#include <memory>

namespace jfpx {
inline namespace JFPX_ABI {
namespace python {
namespace {

using Release = nb::call_guard<nb::gil_scoped_release, SignalInterrupt>;

/// Centres, and a radius for each or one for all.
struct Spheres {
  Rows<const Real> positions;
  Vector<const Real> radii;
};

class Collider {
 public:
  Collider(const std::string& backend, const std::string& algorithm, unsigned threads, int device)
      : collider_(make_sphere_collider(collider_options(backend, algorithm, threads, device))) {}

  /// Pairs of spheres that touch, without contacts.
  std::size_t search_pairs(const Spheres& spheres, bool half) {
    start(spheres);
    pairs_ = collider_->find_pairs(spheres_);
    if (!half) {
      pair_list_ = in_both_orders(pairs_, rows_);
      pairs_ = pair_list_;
    }
    return pairs_.size();
  }

  /// Contacts among spheres; within each system if there are offsets.
  std::size_t search(const Spheres& spheres,
                     const std::optional<Vector<const std::uint64_t>>& batch, bool half) {
    start(spheres);
    if (batch) {
      list_ = find_contacts_in_systems(*collider_, spheres_, {batch->data(), batch->size()});
      found_ = list_;
    } else {
      found_ = collider_->find_contacts(spheres_);
    }
    if (!half) {
      list_ = in_both_orders(found_, rows_);
      found_ = list_;
    }
    return found_.size();
  }

  /// Contacts of a sphere of `first` with one of `second`.
  std::size_t search_between(const Spheres& first, const Spheres& second) {
    start(first);
    pack(second, &others_);
    list_ = find_contacts_between(*collider_, spheres_, others_);
    found_ = list_;
    return found_.size();
  }

  /// Contacts in a periodic cell.
  std::size_t search_periodic(const Spheres& spheres, const PeriodicCell& cell, bool half) {
    start(spheres);
    std::vector<PeriodicContact> contacts = find_periodic_contacts(*collider_, spheres_, cell);
    if (!half) contacts = in_both_orders(contacts, rows_);
    return keep(contacts);
  }

  /// The same within each system of `batch`.
  std::size_t search_periodic_systems(const Spheres& spheres,
                                      const Vector<const std::uint64_t>& batch,
                                      const std::vector<PeriodicCell>& cells, bool half) {
    start(spheres);
    std::vector<PeriodicContact> contacts = find_periodic_contacts_in_systems(
        *collider_, spheres_, {batch.data(), batch.size()}, cells);
    if (!half) contacts = in_both_orders(contacts, rows_);
    return keep(contacts);
  }

  /// The same of a sphere of `first` with one of `second`.
  std::size_t search_periodic_between(const Spheres& first, const Spheres& second,
                                      const PeriodicCell& cell) {
    start(first);
    pack(second, &others_);
    return keep(find_periodic_contacts_between(*collider_, spheres_, others_, cell));
  }

  /// Writes the indices of the last search: pairs[0] and pairs[1], which may be longer than the
  /// number of contacts.
  template <class Index>
  void write_pairs(const Rows<Index>& pairs) {
    visit([&](const auto& found) {
      for_each_interruptible(found.size(), [&](std::size_t i) {
        pairs(0, i) = static_cast<Index>(found[i].a);
        pairs(1, i) = static_cast<Index>(found[i].b);
      });
    });
  }
  template <class Index>
  void write_rows(const Vector<std::int64_t>& offsets, const Vector<Index>& columns) {
    visit([&](const auto& found) {
      const std::vector<std::uint64_t> begins = row_offsets(found, rows_);
      for (std::size_t i = 0; i <= rows_; ++i) offsets(i) = static_cast<std::int64_t>(begins[i]);
      for_each_interruptible(found.size(),
                             [&](std::size_t i) { columns(i) = static_cast<Index>(found[i].b); });
    });
  }
  void write_contacts(const Rows<Real>& normals, const Vector<Real>& distances) {
    for_each_interruptible(found_.size(), [&](std::size_t i) {
      set_row(normals, i, found_[i].normal);
      distances(i) = found_[i].distance;
    });
  }

  /// Writes the shifts of the last search, which must have been in a periodic cell.
  void write_shifts(const Rows<std::int32_t>& shifts) {
    for_each_interruptible(shifts_.size(), [&](std::size_t i) {
      for (std::size_t k = 0; k < 3; ++k) shifts(i, k) = shifts_[i][k];
    });
  }

  std::string_view backend() const { return to_string(collider_->backend()); }
  std::string_view algorithm() const { return to_string(collider_->algorithm()); }
  std::string_view reason() const { return to_string(collider_->reason()); }

 private:
  /// Begins a search among `spheres`, or between them and others.
  void start(const Spheres& spheres) {
    found_ = {};
    pairs_ = {};
    pack(spheres, &spheres_);
    rows_ = spheres_.size();
  }
  std::size_t keep(const std::vector<PeriodicContact>& contacts) {
    list_.clear();
    shifts_.clear();
    for_each_interruptible(contacts.size(), [&](std::size_t i) {
      list_.push_back(contacts[i].contact);
      shifts_.push_back(contacts[i].shift);
    });
    found_ = list_;
    return found_.size();
  }
  /// Calls `write` with the result of the last search: contacts, or pairs alone.
  template <class Write>
  void visit(const Write& write) const {
    if (pairs_.empty()) {
      write(found_);
    } else {
      write(pairs_);
    }
  }
  /// Copies arrays of any strides.
  static void pack(const Spheres& from, std::vector<SphereInstance>* to) {
    const std::size_t n = from.positions.shape(0);
    const std::size_t radius_step = from.radii.shape(0) == 1 ? 0 : 1;
    to->resize(n);
    for (std::size_t i = 0; i < n; ++i) {
      (*to)[i] = {.centre = vec3_at(from.positions, i), .radius = from.radii(i * radius_step)};
    }
  }

  std::unique_ptr<SphereCollider> collider_;
  std::vector<SphereInstance> spheres_, others_;
  std::vector<SphereContact> list_;
  std::vector<ImageShift> shifts_;
  std::vector<SpherePair> pair_list_;
  ContactSpan found_;
  std::span<const SpherePair> pairs_;
  std::size_t rows_ = 0;
};

}  // namespace

SphereColliderOptions collider_options(const std::string& backend, const std::string& algorithm,
                                       unsigned threads, int device) {
  SphereColliderOptions options{.threads = threads, .device = device};
  const std::optional<Backend> known = parse_backend(backend);
  if (!known) {
    throw InvalidArgument("backend is \"" + backend + "\"; it must be auto, cpu or cuda");
  }
  options.backend = *known;
  for (const SphereAlgorithm a :
       {SphereAlgorithm::automatic, SphereAlgorithm::all_pairs, SphereAlgorithm::grid}) {
    std::string name(to_string(a));
    std::replace(name.begin(), name.end(), ' ', '_');
    if (name == algorithm) {
      options.algorithm = a;
      return options;
    }
  }
  throw InvalidArgument("algorithm is \"" + algorithm +
                        "\"; it must be automatic, all_pairs or grid");
}

void bind_collider(nb::module_& module) {
  nb::class_<Collider>(module, "Collider")
      .def(nb::init<const std::string&, const std::string&, unsigned, int>(), nb::arg("backend"),
           nb::arg("algorithm"), nb::arg("threads"), nb::arg("device"))
      .def(
          "search_pairs",
          [](Collider& self, const Rows<const Real>& positions, const Vector<const Real>& radii,
             bool half) {
            return self.search_pairs({positions, radii}, half);
          },
          nb::arg("positions"), nb::arg("radii"), nb::arg("half"), Release())
      .def(
          "search",
          [](Collider& self, const Rows<const Real>& positions, const Vector<const Real>& radii,
             const std::optional<Vector<const std::uint64_t>>& batch, bool half) {
            return self.search({positions, radii}, batch, half);
          },
          nb::arg("positions"), nb::arg("radii"), nb::arg("batch").none(), nb::arg("half"),
          Release())
      .def(
          "search_between",
          [](Collider& self, const Rows<const Real>& first, const Vector<const Real>& first_radii,
             const Rows<const Real>& second, const Vector<const Real>& second_radii) {
            return self.search_between({first, first_radii}, {second, second_radii});
          },
          nb::arg("first"), nb::arg("first_radii"), nb::arg("second"), nb::arg("second_radii"),
          Release())
      .def(
          "search_periodic",
          [](Collider& self, const Rows<const Real>& positions, const Vector<const Real>& radii,
             const Rows<const double>& cell, bool half) {
            return self.search_periodic({positions, radii}, to_cells(cell).at(0), half);
          },
          nb::arg("positions"), nb::arg("radii"), nb::arg("cell"), nb::arg("half"), Release())
      .def(
          "search_periodic_systems",
          [](Collider& self, const Rows<const Real>& positions, const Vector<const Real>& radii,
             const Vector<const std::uint64_t>& batch, const Rows<const double>& cells, bool half) {
            return self.search_periodic_systems({positions, radii}, batch, to_cells(cells), half);
          },
          nb::arg("positions"), nb::arg("radii"), nb::arg("batch"), nb::arg("cells"),
          nb::arg("half"), Release())
      .def(
          "search_periodic_between",
          [](Collider& self, const Rows<const Real>& first, const Vector<const Real>& first_radii,
             const Rows<const Real>& second, const Vector<const Real>& second_radii,
             const Rows<const double>& cell) {
            return self.search_periodic_between({first, first_radii}, {second, second_radii},
                                                to_cells(cell).at(0));
          },
          nb::arg("first"), nb::arg("first_radii"), nb::arg("second"), nb::arg("second_radii"),
          nb::arg("cell"), Release())
      .def("write_shifts", &Collider::write_shifts, nb::arg("shifts").noconvert(), Release())
      .def("write_pairs", &Collider::write_pairs<std::int32_t>, nb::arg("pairs").noconvert(),
           Release())
      .def("write_pairs", &Collider::write_pairs<std::int64_t>, nb::arg("pairs").noconvert(),
           Release())
      .def("write_rows", &Collider::write_rows<std::int32_t>, nb::arg("offsets").noconvert(),
           nb::arg("columns").noconvert(), Release())
      .def("write_rows", &Collider::write_rows<std::int64_t>, nb::arg("offsets").noconvert(),
           nb::arg("columns").noconvert(), Release())
      .def("write_contacts", &Collider::write_contacts, nb::arg("normals").noconvert(),
           nb::arg("distances").noconvert(), Release())
      .def_prop_ro("backend", [](const Collider& self) { return std::string(self.backend()); })
      .def_prop_ro("algorithm", [](const Collider& self) { return std::string(self.algorithm()); })
      .def_prop_ro("reason", [](const Collider& self) { return std::string(self.reason()); });

  module.def("available_backends", [] {
    nb::list rows;
    for (const BackendStatus& status : available_backends()) {
      nb::dict row;
      row["backend"] = std::string(to_string(status.backend));
      row["compiled"] = status.compiled;
      row["usable"] = status.usable;
      row["device"] = status.device;
      row["reason"] = status.reason;
      rows.append(row);
    }
    return rows;
  });
  module.def("available_gpus", [] {
    nb::list rows;
    for (const Gpu& gpu : available_gpus()) {
      nb::dict row;
      row["number"] = gpu.number;
      row["name"] = gpu.name;
      row["usable"] = gpu.usable;
      row["reason"] = gpu.reason;
      row["linked"] = gpu.linked;
      rows.append(row);
    }
    return rows;
  });
}

}  // namespace python
}  // namespace JFPX_ABI
}  // namespace jfpx

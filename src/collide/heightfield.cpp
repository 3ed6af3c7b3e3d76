/// Construction of heightfields: flags of cells, and bounds of tiles.
#include <jfpx/error.hpp>
#include <jfpx/heightfield.hpp>
#include <jfpx/scene.hpp>

#include "src/collide/heightfield_data.hpp"

#include <algorithm>
#include <string>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

using detail::GridView;
using detail::HeightfieldData;
using detail::HeightRange;

/// Coordinates along an axis are exact to one rounding.
constexpr std::uint32_t kMostAlongAxis = 1u << 16;
/// Triangles have numbers of 32 bits.
constexpr std::uint64_t kMostVertices = std::uint64_t{1} << 28;

[[noreturn]] void fail_member(const std::string& name, const std::string& value,
                              const std::string& range) {
  throw InvalidArgument(name + " is " + value + "; it must be " + range);
}

void check_grid_axis(const char* count_name, std::uint32_t count, const char* spacing_name,
                     Real spacing) {
  if (count < 2 || count > kMostAlongAxis) {
    fail_member(count_name, std::to_string(count), "from 2 to " + std::to_string(kMostAlongAxis));
  }
  const Real most = 2 * kMaxCoordinate / static_cast<Real>(count - 1);
  if (!(spacing > 0 && spacing <= most)) {
    fail_member(
        spacing_name, std::to_string(spacing),
        "> 0 and at most " + std::to_string(most) + ", so that coordinates are at most 1e9");
  }
}

void check_grid(const HeightfieldDef& def) {
  check_grid_axis("columns", def.columns, "spacing_x", def.spacing_x);
  check_grid_axis("rows", def.rows, "spacing_z", def.spacing_z);
  const std::uint64_t count = std::uint64_t{def.rows} * def.columns;
  const std::string product = "rows * columns = " + std::to_string(count);
  if (count > kMostVertices) {
    throw InvalidArgument(product + "; it must be at most " + std::to_string(kMostVertices));
  }
  if (def.heights.size() != count) {
    throw InvalidArgument("heights has " + std::to_string(def.heights.size()) +
                          " items; it must have " + product);
  }
  const auto bad = std::ranges::find_if(
      def.heights, [](Real height) { return !(absolute(height) <= kMaxCoordinate); });
  if (bad != def.heights.end()) {
    fail_member("heights[" + std::to_string(bad - def.heights.begin()) + "]", std::to_string(*bad),
                "between -1e9 and 1e9");
  }
  for (std::size_t i = 0; i < def.holes.size(); ++i) {
    const std::uint32_t cell = def.holes[i];
    if (cell < count - def.columns && cell % def.columns != def.columns - 1) continue;
    fail_member("holes[" + std::to_string(i) + "]", std::to_string(cell),
                "row * columns + column of a cell; the last row and column have none");
  }
}

/// Sets the flags of the cells, and the bounds of the tiles.
class GridBuilder {
 public:
  explicit GridBuilder(HeightfieldData* data) : data_(*data), grid_(data->view().grid) {
    data_.cells.assign(grid_.cell_count(), GridView::kMissing);
    grid_.cells = data_.cells.data();
    data_.tiles.resize(grid_.tile_count());
    grid_.tiles = data_.tiles.data();
  }

  void build() {
    for_each_cell([this](std::uint32_t cell) { flags(cell) = 0; });
    for (const std::uint32_t cell : data_.def.holes) flags(cell) = GridView::kMissing;
    for_each_cell([this](std::uint32_t cell) { drop_degenerate(cell); });
    for_each_cell([this](std::uint32_t cell) { set_flat(cell); });
    set_tiles();
  }

 private:
  template <class Visit>
  void for_each_cell(const Visit& visit) {
    for (std::uint32_t row = 0; row + 1 < grid_.rows; ++row) {
      for (std::uint32_t column = 0; column + 1 < grid_.columns; ++column) {
        visit(row * grid_.columns + column);
      }
    }
  }
  std::uint8_t& flags(std::uint32_t cell) { return data_.cells[grid_.padding() + cell]; }
  void add_flag(std::uint32_t cell, std::uint8_t flag) {
    flags(cell) = static_cast<std::uint8_t>(flags(cell) | flag);
  }

  /// Triangles that are nearly vertical may have no area.
  void drop_degenerate(std::uint32_t cell) {
    for (std::uint32_t k = 0; k < 2; ++k) {
      Vec3 p[3];
      grid_.get_corners(2 * cell + k, p);
      if (!has_area(detail::TriangleArea(p[0], p[1], p[2]), p[0], p[1], p[2])) {
        add_flag(cell, static_cast<std::uint8_t>(1u << k));
      }
    }
  }

  void set_flat(std::uint32_t cell) {
    const std::uint32_t first = 2 * cell;
    if (!grid_.has_triangle(first)) return;
    constexpr std::uint8_t kFlags[] = {GridView::kFlatZ, GridView::kFlatDiagonal, GridView::kFlatX};
    for (int edge = 0; edge < 3; ++edge) {
      const std::uint32_t opposite = grid_.opposite(first, edge);
      if (opposite == detail::kNoVertex) continue;
      const auto corner = [&](int k) { return grid_.position(grid_.vertex(first, k % 3)); };
      if (detail::are_flat(corner(edge), corner(edge + 1), corner(edge + 2),
                           grid_.position(opposite))) {
        add_flag(cell, kFlags[edge]);
      }
    }
  }

  void set_tiles() {
    for_each_cell([this](std::uint32_t cell) {
      for (std::uint32_t k = 0; k < 2; ++k) {
        if (grid_.has_triangle(2 * cell + k)) enclose(2 * cell + k);
      }
    });
    std::vector<Aabb> bounds;
    std::vector<std::uint32_t> items;
    for (std::uint32_t tile = 0; tile < grid_.tile_count(); ++tile) {
      if (data_.tiles[tile].least > data_.tiles[tile].most) continue;
      const Aabb box = grid_.bounds_of_tile(tile);
      bounds.push_back(box);
      items.push_back(tile);
      for (int axis = 0; axis < 3; ++axis) {
        Real& half = data_.half_extents[axis];
        half = std::max({half, absolute(box.lower[axis]), absolute(box.upper[axis])});
      }
    }
    data_.tree.build(bounds, items);
  }
  void enclose(std::uint32_t triangle) {
    const std::uint32_t cell = triangle / 2;
    const std::uint32_t row = cell / grid_.columns, column = cell % grid_.columns;
    HeightRange& range =
        data_.tiles[row / GridView::kTile * grid_.tile_columns() + column / GridView::kTile];
    for (int k = 0; k < 3; ++k) {
      const Real height = grid_.heights[grid_.vertex(triangle, k)];
      range.least = std::min(range.least, height);
      range.most = std::max(range.most, height);
    }
  }

  HeightfieldData& data_;
  GridView grid_;
};

}  // namespace

Heightfield::Heightfield(HeightfieldDef def) {
  if (def == HeightfieldDef{}) return;
  check_grid(def);
  auto data = std::make_shared<HeightfieldData>();
  data->def = std::move(def);
  GridBuilder(data.get()).build();
  data_ = std::move(data);
}

const HeightfieldDef& Heightfield::def() const noexcept {
  static const HeightfieldDef kEmpty;
  return data_ == nullptr ? kEmpty : data_->def;
}

Vec3 Heightfield::vertex(std::uint32_t row, std::uint32_t column) const noexcept {
  return data_->view().grid.position(row * columns() + column);
}

bool operator==(const Heightfield& a, const Heightfield& b) {
  return a.data_ == b.data_ || a.def() == b.def();
}

TriangleMesh to_triangle_mesh(const Heightfield& heightfield) {
  if (heightfield.data() == nullptr) return {};
  const GridView grid = heightfield.data()->view().grid;
  TriangleMeshDef mesh;
  mesh.two_sided = heightfield.two_sided();
  mesh.vertices.reserve(grid.vertex_count());
  for (std::uint32_t i = 0; i < grid.vertex_count(); ++i) mesh.vertices.push_back(grid.position(i));
  for (std::uint32_t i = 0; i < 2 * grid.vertex_count(); ++i) {
    if (!grid.has_triangle(i)) continue;
    mesh.triangles.push_back({grid.vertex(i, 0), grid.vertex(i, 1), grid.vertex(i, 2)});
  }
  return TriangleMesh(std::move(mesh));
}

}  // namespace JFPX_ABI
}  // namespace jfpx

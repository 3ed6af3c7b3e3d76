/// The spheres, boxes and walls that bodies are made of, in flat arrays for the pair tests.
#pragma once

#include "src/body_store.hpp"

#include <span>
#include <vector>

namespace jfpx::inline JFPX_ABI {

/// A piece is a body of one shape, or one part of an assembly. Pieces are numbered: spheres, then
/// boxes that can be moved, then those that can't (kinematic ones among them), then half-spaces and
/// planes; each kind by body, then by part.
class PieceTable {
 public:
  using Piece = std::uint32_t;

  struct PosedBox {
    Box box;
    Transform pose;
  };
  struct Wall {
    HalfSpace solid;  ///< of a plane: what is behind it
    bool two_sided = false;

    /// What is solid for a body whose centre of mass is at `centre`.
    HalfSpace solid_for(const Vec3& centre) const {
      if (!two_sided || !(dot(solid.normal, centre) < solid.offset)) return solid;
      return {-solid.normal, -solid.offset};
    }
  };

  /// Must be called when bodies came, went, or an immovable one was moved.
  void set_bodies(const BodyStore& bodies);
  /// Puts the pieces where their bodies are now.
  void place(const BodyStore& bodies);

  std::uint32_t body(Piece piece) const { return body_[piece]; }
  bool is_sphere(Piece piece) const { return piece < sphere_count_; }
  bool is_wall(Piece piece) const { return piece >= bounds_.size(); }
  const PosedBox& box(Piece piece) const { return boxes_[piece - sphere_count_]; }
  const Wall& wall(Piece piece) const { return walls_[piece - bounds_.size()]; }
  /// The sphere itself, or a sphere around the box.
  const SphereInstance& bounds(Piece piece) const { return bounds_[piece]; }

  /// Of all spheres and movable boxes.
  std::span<const SphereInstance> bounds() const { return {bounds_.data(), fixed_begin_}; }
  Piece size() const { return static_cast<Piece>(body_.size()); }
  Piece fixed_begin() const { return fixed_begin_; }  ///< the first box or wall of mass 0

 private:
  void add_body(const BodyStore& bodies, std::uint32_t body);
  void place(const BodyStore& bodies, Piece piece);

  Piece sphere_count_ = 0, fixed_begin_ = 0;
  std::vector<std::uint32_t> body_;     ///< by piece
  std::vector<SphereInstance> bounds_;  ///< of spheres and boxes
  std::vector<PosedBox> boxes_;
  std::vector<Wall> walls_;
  std::vector<std::uint32_t> part_;  ///< by sphere or box: 0, or 1 + its index in local_
  std::vector<Transform> local_;     ///< of parts, in body axes
  std::vector<Piece> kinematic_;     ///< boxes of mass 0 that move all the same
};

}  // namespace jfpx::inline JFPX_ABI

"""Shapes of bodies as groups of equal solids, each with vertices, places and colours."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

(SPHERE, BOX, HALF_SPACE, PLANE, COMPOUND, CAPSULE, TRIANGLE_MESH, HULL, HEIGHTFIELD, CYLINDER,
 CONE) = range(11)
"""Kinds of solids, with the numbers of shapes in a trajectory."""

_SMOOTH = np.cos(np.radians(40))
"""Edges of larger angles are sharp, as in jfpx-view."""


class Geometry(NamedTuple):
    """The P solids, walls and meshes of N bodies; a compound has one for each part.

    Attributes
    ----------
    bodies : array (P,)
        Row of the body.
    kinds : array (P,)
        Kind of solid.
    sizes : array (P, 4)
        Radius; half extents; radius and half height; normal and offset; or the number of a mesh.
    poses : array (P, 7)
        Position and orientation (w, x, y, z) in the axes of the body.
    meshes : list
        Vertices, triangles, and whether both sides collide.
    movable : array (N,) of bool
        Whether the mass is > 0.
    acceleration : array (3,)
        Sum of those of the movable bodies.
    """

    bodies: np.ndarray
    kinds: np.ndarray
    sizes: np.ndarray
    poses: np.ndarray
    meshes: list[tuple[np.ndarray, np.ndarray, bool]]
    movable: np.ndarray
    acceleration: np.ndarray

    @classmethod
    def of(cls, core: Any) -> Geometry:
        """Geometry of a scene or world of jfpx._core."""
        bodies, kinds, sizes, poses, meshes, movable, acceleration = core.geometry()
        return cls(bodies.ravel(), kinds.ravel(), sizes.astype(np.float64), poses.astype(np.float64), meshes,
                   movable.ravel().astype(bool), np.array(acceleration))


@dataclass
class Model:
    """Triangles that are drawn once for each solid of a group.

    A vertex is at (x, y, z) * size[:3] + (0, w * size[3], 0) in the axes of its solid.
    """

    vertices: np.ndarray
    """(V, 7) of float32: x, y, z, w, and a normal, which is divided by size[:3]."""
    indices: np.ndarray
    """(T, 3) of uint32, counterclockwise seen from the front."""
    one_sided: bool = False

    def points(self, size: Any) -> np.ndarray:
        """Vertices of a solid of the given size, in its axes."""
        points = self.vertices[:, :3] * np.asarray(size)[:3]
        points[:, 1] += self.vertices[:, 3] * size[3]
        return points


@dataclass
class Group:
    """Solids that one draw call shows: spheres, or instances of a model."""

    kind: int
    bodies: np.ndarray
    """(P,) rows of bodies"""
    poses: np.ndarray
    """(P, 7) in the axes of the body"""
    sizes: np.ndarray
    """(P, 4) of Model; spheres: the radius, four times"""
    reach: np.ndarray
    """(P,) radius of a ball about the position that contains the solid [m]"""
    middles: np.ndarray
    """(P, 3) point of the body near which the solid is"""
    model: Model | None = None


def groups_of(geometry: Geometry) -> list[Group]:
    """The solids of bodies by shape: one group for all spheres, boxes, capsules, cylinders and cones
    each, and for each hull and mesh. Half-spaces and planes are left out."""
    groups = []
    for kind in (SPHERE, BOX, CAPSULE, CYLINDER, CONE):
        rows = np.flatnonzero(geometry.kinds == kind)
        if rows.size:
            sizes = _scales(kind, geometry.sizes[rows])
            groups.append(_group(geometry, kind, rows, sizes, _reach(kind, sizes), _model(kind, rows.size)))
    is_mesh = np.isin(geometry.kinds, (TRIANGLE_MESH, HULL, HEIGHTFIELD))
    numbers = np.where(is_mesh, geometry.sizes[:, 0], -1)
    for number, (vertices, triangles, two_sided) in enumerate(geometry.meshes):
        rows = np.flatnonzero(numbers == number)
        kind = int(geometry.kinds[rows[0]])
        model = surface(vertices, triangles, flat=kind == HULL, one_sided=kind != HULL and not two_sided)
        used = model.vertices[:, :3] if len(model.vertices) else np.zeros((1, 3))
        low, high = used.min(axis=0), used.max(axis=0)
        group = _group(geometry, kind, rows, np.tile([1.0, 1.0, 1.0, 0.0], (rows.size, 1)),
                       np.full(rows.size, np.linalg.norm(high - low) / 2), model)
        group.middles = group.middles + rotated(group.poses[:, 3:], np.tile((low + high) / 2, (rows.size, 1)))
        groups.append(group)
    return groups


def _group(geometry: Geometry, kind: int, rows: np.ndarray, sizes: np.ndarray, reach: np.ndarray,
           model: Model | None) -> Group:
    poses = geometry.poses[rows]
    return Group(kind, geometry.bodies[rows], poses, sizes, reach, poses[:, :3], model)


def _scales(kind: int, sizes: np.ndarray) -> np.ndarray:
    """Sizes of Model."""
    r, h, zero = sizes[:, 0], sizes[:, 1], np.zeros(len(sizes))
    if kind == SPHERE:
        return np.stack([r, r, r, r], axis=1)
    if kind == BOX:
        return sizes
    if kind == CAPSULE:
        return np.stack([r, r, r, h], axis=1)
    return np.stack([r, h, r, zero], axis=1)


def _reach(kind: int, sizes: np.ndarray) -> np.ndarray:
    if kind == SPHERE:
        return sizes[:, 0]
    if kind == BOX:
        return np.linalg.norm(sizes[:, :3], axis=1)
    if kind == CAPSULE:
        return sizes[:, 0] + sizes[:, 3]
    if kind == CYLINDER:
        return np.hypot(sizes[:, 0], sizes[:, 1])
    return np.maximum(1.5 * sizes[:, 1], np.hypot(sizes[:, 0], 0.5 * sizes[:, 1]))


def _model(kind: int, count: int) -> Model | None:
    if kind == SPHERE:
        return None
    if kind == BOX:
        return box()
    sides = 48 if count <= 500 else 24 if count <= 5000 else 16
    if kind == CAPSULE:
        return _capsule(sides)
    return _frustum(sides, -1.0, 1.0, 1.0) if kind == CYLINDER else _frustum(sides, -0.5, 1.5, 0.0)


def box() -> Model:
    """A cube of two meters."""
    vertices: list[list[float]] = []
    indices: list[list[int]] = []
    for axis in range(3):
        for side in (-1.0, 1.0):
            normal, u = np.zeros(3), np.zeros(3)
            normal[axis], u[(axis + 1) % 3] = side, 1
            v = np.cross(normal, u)
            first = len(vertices)
            vertices += [[*(normal + a * u + b * v), 0, *normal] for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
            indices += [[first, first + 1, first + 2], [first, first + 2, first + 3]]
    return Model(np.array(vertices, np.float32), np.array(indices, np.uint32))


def _strips(rings: int, sides: int) -> np.ndarray:
    """Triangles between rings of sides + 1 vertices each, from the lowest ring up."""
    ring, side = np.mgrid[0:rings - 1, 0:sides].reshape(2, -1)
    a = ring * (sides + 1) + side
    b = a + sides + 1
    return np.concatenate([np.stack([a, b, a + 1], 1), np.stack([a + 1, b, b + 1], 1)])


def _capsule(sides: int) -> Model:
    rings = sides // 4 + 1
    angle = np.linspace(-np.pi / 2, 0, rings)
    angle = np.concatenate([angle, -angle[::-1]])
    end = np.repeat([-1.0, 1.0], rings)
    turn = np.linspace(0, 2 * np.pi, sides + 1)
    direction = np.stack([np.cos(angle)[:, None] * np.cos(turn), np.repeat(np.sin(angle)[:, None], sides + 1, 1),
                          -np.cos(angle)[:, None] * np.sin(turn)], axis=2).reshape(-1, 3)
    vertices = np.column_stack([direction, np.repeat(end, sides + 1), direction])
    triangles = _strips(2 * rings, sides)
    return Model(vertices.astype(np.float32), triangles[:, [0, 2, 1]].astype(np.uint32))


def _frustum(sides: int, low: float, high: float, top: float) -> Model:
    """Round solid of radius 1 at the base and `top` at the upper end."""
    turn = np.linspace(0, 2 * np.pi, sides + 1)
    radial = np.stack([np.cos(turn), np.zeros(sides + 1), -np.sin(turn)], axis=1)
    slope = radial + np.array([0, (1 - top) / (high - low), 0])
    slope /= np.linalg.norm(slope, axis=1, keepdims=True)
    zero = np.zeros((sides + 1, 1))
    vertices = [np.hstack([radial * r + [0, y, 0], zero, slope]) for r, y in ((1.0, low), (top, high))]
    indices = [_strips(2, sides)[:, [0, 2, 1]]]
    for radius, y, side in ((1.0, low, -1.0), (top, high, 1.0)):
        if radius == 0:
            continue
        first = sum(map(len, vertices))
        normal = np.tile([0, side, 0], (sides + 1, 1))
        middle = np.array([[0, y, 0, 0, 0, side, 0]])
        vertices += [np.hstack([radial * radius + [0, y, 0], zero, normal]), middle]
        rim = first + np.arange(sides)
        fan = np.stack([np.full(sides, first + sides + 1), rim, rim + 1], axis=1)
        indices.append(fan if side > 0 else fan[:, ::-1])
    return Model(np.vstack(vertices).astype(np.float32), np.vstack(indices).astype(np.uint32))


def surface(vertices: np.ndarray, triangles: np.ndarray, *, flat: bool, one_sided: bool) -> Model:
    """A model of triangles, with sharp edges alone if `flat`. Degenerate triangles are left out."""
    points = np.asarray(vertices, np.float64)
    corners = np.asarray(triangles, np.int64)
    weighted = np.cross(points[corners[:, 1]] - points[corners[:, 0]], points[corners[:, 2]] - points[corners[:, 0]])
    area = np.linalg.norm(weighted, axis=1)
    corners, weighted, area = corners[area > 0], weighted[area > 0], area[area > 0]
    face = weighted / area[:, None]
    normals = np.zeros_like(points)
    for k in range(3):
        for axis in range(3):
            normals[:, axis] += np.bincount(corners[:, k], weighted[:, axis], len(points))
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    smooth = np.einsum("tkx,tx->tk", normals[corners], face) >= _SMOOTH
    if flat:
        smooth[:] = False
    sharp = np.argwhere(~smooth)
    kept, indices = np.unique(corners[smooth], return_inverse=True)
    result = np.empty_like(corners)
    result[smooth] = indices.ravel()
    result[~smooth] = len(kept) + np.arange(len(sharp))
    places = np.concatenate([points[kept], points[corners[~smooth]]])
    directions = np.concatenate([normals[kept], face[sharp[:, 0]]])
    columns = np.column_stack([places, np.zeros(len(places)), directions])
    return Model(columns.astype(np.float32), result.astype(np.uint32), one_sided)


def rotated(quaternions: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Vectors (N, 3) rotated by quaternions (N, 4), (w, x, y, z)."""
    w, q = quaternions[:, :1], quaternions[:, 1:]
    return vectors + 2 * np.cross(q, np.cross(q, vectors) + w * vectors)

"""Colours of bodies, walls of rooms, the ground, and what the camera shows, as in jfpx-view."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from .geometry import BOX, CAPSULE, HALF_SPACE, HEIGHTFIELD, PLANE, SPHERE, TRIANGLE_MESH, Geometry, Group, rotated

PLAIN, SOLID_BALL, STRIPED_BALL, CRATE, LINES, GLASS, QUADRANTS = range(7)
"""Patterns, the fourth number of a colour."""

_BALLS = np.array([(214, 172, 92), (84, 122, 168), (190, 98, 88), (136, 110, 152), (210, 142, 96), (98, 146, 112),
                   (148, 88, 98), (98, 106, 116)])
_CRATE = np.array((196, 162, 118))
CONCRETE = np.array((168, 168, 166))
_STONE = np.array((140, 146, 146))
_SAMPLED = 4000


@dataclass
class Wall:
    """A side of a room: the part of a large box of mass 0 that is drawn."""

    centre: np.ndarray
    half: np.ndarray
    thickness: float
    """[m], of a floor; 0: glass"""


@dataclass
class Look:
    """What a picture shows besides the bodies."""

    up: np.ndarray
    body_size: float = 1.0
    """Median of the radii of the movable bodies [m]."""
    balls: np.ndarray = field(default_factory=lambda: np.zeros((0, 4)))
    """(M, 4) centres and radii that the camera shows"""
    height: float = 0.36
    """Height of the camera, relative to its distance: above the edges of a terrain."""
    planes: list[tuple[np.ndarray, float]] = field(default_factory=list)
    """Normals towards the bodies, and offsets."""
    walls: list[Wall] = field(default_factory=list)
    hidden: set[int] = field(default_factory=set)
    """Bodies that are drawn as walls."""


def up_of(geometry: Geometry) -> np.ndarray:
    """The axis of the world opposite to gravity; y without gravity."""
    pull = geometry.acceleration
    axis = int(np.argmax(np.abs(pull))) if np.any(pull) else 1
    up = np.zeros(3)
    up[axis] = 1 if pull[axis] <= 0 else -1
    return up


def paints_of(group: Group, movable: np.ndarray, compounds: np.ndarray) -> np.ndarray:
    """Colours and patterns (P, 4) of solids: those of pool balls for movable bodies, in calm tones."""
    index = group.bodies.astype(np.uint32)
    mixed = index * np.uint32(2654435761)  # hashed, so that neighbouring indices differ
    scattered = mixed >> np.uint32(8)
    paints = np.empty((index.size, 4), np.uint8)
    if group.kind == BOX:
        tone = (mixed >> np.uint32(12)) % 5
        paints[:, :3] = _CRATE - 6 * tone[:, None].astype(int)
        paints[:, 3] = CRATE
    else:
        paints[:, :3] = _BALLS[scattered % len(_BALLS)]
        striped = (scattered >> np.uint32(5)) % 5 < 2
        paints[:, 3] = np.where(striped, STRIPED_BALL, SOLID_BALL) if group.kind == SPHERE else QUADRANTS
    several = compounds[group.bodies]
    paints[several, :3] = _BALLS[scattered[several] % len(_BALLS)]
    paints[several, 3] = CRATE if group.kind == BOX else QUADRANTS
    still = ~movable[group.bodies]
    is_mesh = group.kind in (TRIANGLE_MESH, HEIGHTFIELD)
    paints[still, :3] = _STONE if is_mesh else CONCRETE
    paints[still, 3] = LINES if is_mesh or group.kind == BOX else PLAIN
    return paints


def look_of(geometry: Geometry, groups: list[Group], frames: list[tuple[np.ndarray, np.ndarray]],
            up: np.ndarray) -> Look:
    """The look of a picture. `frames` has positions and orientations of some moments, the first of
    which places the walls."""
    look = Look(up)
    movable = geometry.movable
    moving = [_balls(group, frame, movable[group.bodies]) for frame in frames for group in groups]
    sizes = np.concatenate([group.reach[movable[group.bodies]] for group in groups] or [np.zeros(0)])
    if sizes.size:
        look.body_size = float(np.median(sizes))
    inner = _finite(moving)
    _find_room(geometry, groups, frames, look, inner)
    still = ~movable
    still[list(look.hidden)] = False
    outer = [_corners(group, frames[0], still[group.bodies]) for group in groups]
    if len(inner):
        centre, radius = _bounds(inner)
        outer = [points[(np.linalg.norm(points[..., :3] - centre, axis=2) < 6 * radius).all(axis=1)] for points in outer]
    look.balls = np.concatenate([inner, _finite([points.reshape(-1, 4) for points in outer], 1.0)])
    if any(group.kind in (TRIANGLE_MESH, HEIGHTFIELD) for group in groups):
        look.height = 0.9
    _find_planes(geometry, look)
    return look


def _balls(group: Group, frame: tuple[np.ndarray, np.ndarray], chosen: np.ndarray) -> np.ndarray:
    """Balls that contain some solids of a group."""
    bodies = group.bodies[chosen]
    middles = frame[0][bodies] + rotated(frame[1][bodies], group.middles[chosen])
    return np.column_stack([middles, group.reach[chosen]])


def _corners(group: Group, frame: tuple[np.ndarray, np.ndarray], chosen: np.ndarray) -> np.ndarray:
    """The corners (P, 8, 4) of oriented boxes that contain some solids of a group, as balls without
    radius."""
    low, high = np.full(3, -1.0), np.full(3, 1.0)
    if group.model is not None and len(group.model.vertices):
        low, high = group.model.vertices[:, :3].min(axis=0), group.model.vertices[:, :3].max(axis=0)
    unit = np.stack(np.meshgrid(*zip(low, high), indexing="ij"), axis=-1).reshape(8, 3)
    sizes = group.sizes[chosen]
    local = unit * sizes[:, None, :3]
    local[..., 1] += np.sign(unit[:, 1]) * sizes[:, None, 3] if group.kind == CAPSULE else 0
    flat, bodies = local.reshape(-1, 3), np.repeat(group.bodies[chosen], 8)
    poses = np.repeat(group.poses[chosen], 8, axis=0)
    points = frame[0][bodies] + rotated(frame[1][bodies], poses[:, :3] + rotated(poses[:, 3:], flat))
    return np.column_stack([points, np.zeros(len(points))]).reshape(-1, 8, 4)


def _finite(balls: list[np.ndarray], share: float = 0.98) -> np.ndarray:
    """A sample of balls without the outermost ones, which have run away."""
    rows = np.concatenate(balls or [np.zeros((0, 4))])
    rows = rows[np.isfinite(rows).all(axis=1) & (np.abs(rows) < 1e9).all(axis=1)]
    if len(rows) > 50 and share < 1:
        low, high = np.quantile(rows[:, :3], (1 - share, share), axis=0)
        margin = (high - low).max() + 3 * rows[:, 3:]
        rows = rows[((rows[:, :3] >= low - margin) & (rows[:, :3] <= high + margin)).all(axis=1)]
    if len(rows) <= _SAMPLED:
        return rows
    ends = np.concatenate([np.argsort(rows[:, axis])[[0, -1]] for axis in range(3)])
    return rows[np.union1d(ends, np.arange(0, len(rows), len(rows) // _SAMPLED + 1))]


def _bounds(balls: np.ndarray) -> tuple[np.ndarray, float]:
    low, high = balls[:, :3].min(axis=0), balls[:, :3].max(axis=0)
    return (low + high) / 2, float(np.linalg.norm(high - low) / 2 + balls[:, 3].max())


def _find_room(geometry: Geometry, groups: list[Group], frames: list[tuple[np.ndarray, np.ndarray]], look: Look,
               inner: np.ndarray) -> None:
    """Large boxes around the movable bodies are the walls of a room, which are drawn as glass and
    clipped to the inside. The largest box on a side is the wall."""
    boxes = next((group for group in groups if group.kind == BOX), None)
    if boxes is None or not len(inner):
        return
    centre, radius = _bounds(inner)
    positions, orientations = frames[0]
    counts = np.bincount(geometry.bodies, minlength=len(geometry.movable))
    plain = ~geometry.movable[boxes.bodies] & (counts[boxes.bodies] == 1)
    plain &= (orientations[boxes.bodies, 0] ** 2 > 1 - 1e-6) & (boxes.reach > 0.7 * radius)
    sides: dict[tuple[int, bool], int] = {}  # axis and whether it is the lower end: row of the box
    for row in np.flatnonzero(plain).tolist():
        half, away = boxes.sizes[row, :3], centre - positions[boxes.bodies[row]]
        axis = int(np.argmin(half))
        if np.array_equal(np.abs(away) >= half, np.arange(3) == axis):
            side = axis, bool(away[axis] > 0)
            if side not in sides or boxes.reach[row] > boxes.reach[sides[side]]:
                sides[side] = row
    # A floor without walls may be endless: what is drawn of it is that below the bodies.
    low, high = centre - 6 * radius, centre + 6 * radius
    faces = {}
    for (axis, is_low), row in sides.items():
        position, half = positions[boxes.bodies[row]][axis], boxes.sizes[row, axis]
        faces[axis, is_low] = (low if is_low else high)[axis] = position + half if is_low else position - half
    for (axis, is_low), row in sides.items():
        position, half = positions[boxes.bodies[row]], boxes.sizes[row, :3]
        first, last = np.maximum(position - half, low), np.minimum(position + half, high)
        is_floor = look.up[axis] == (1 if is_low else -1)
        thickness = min(look.body_size / 4, 2 * half[axis]) if is_floor else 0.0
        face = faces[axis, is_low]
        first[axis], last[axis] = (face - thickness, face) if is_low else (face, face + thickness)
        drawn = np.maximum((last - first) / 2, 1e-3 * look.body_size)
        look.walls.append(Wall((first + last) / 2, drawn, thickness))
        look.hidden.add(int(boxes.bodies[row]))
        if is_floor:
            look.planes.append((look.up, float(face * look.up[axis]) - thickness))


def _find_planes(geometry: Geometry, look: Look) -> None:
    """Planes are seen from the side of the bodies alone, which they thus never hide."""
    inside = look.balls[:, :3].mean(axis=0) if len(look.balls) else np.zeros(3)
    for kind, size in zip(geometry.kinds, geometry.sizes):
        if kind not in (HALF_SPACE, PLANE):
            continue
        side = 1 if kind == HALF_SPACE or size[:3] @ inside >= size[3] else -1
        look.planes.insert(0, (side * size[:3], side * size[3]))

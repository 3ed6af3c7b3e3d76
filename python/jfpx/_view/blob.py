"""Scenes and frames as bytes, which the script of a picture reads.

A scene is a length (uint32), a JSON header of that length, and arrays at multiples of 4 bytes, which
the header names by [type, offset, length]. A frame is, for N bodies, N positions (float32 x 3, relative
to the origin of the header), N orientations (int16 x 4: x, y, z, w of a unit quaternion times 32767)
and N bytes that are 0 for sleeping bodies, which are dimmer.
"""

from __future__ import annotations

import json
import zlib
from typing import Any

import numpy as np

from .geometry import Geometry, Group, Model, box
from .look import CONCRETE, GLASS, LINES, Look, Wall, paints_of

_TYPES = {"f4": "Float32Array", "u4": "Uint32Array", "u1": "Uint8Array"}
_IDENTITY = np.array([0.0, 0, 0, 1, 0, 0, 0])


class _Writer:
    def __init__(self) -> None:
        self.parts: list[bytes] = []
        self.size = 0

    def add(self, array: Any, dtype: str) -> list[Any]:
        values = np.ascontiguousarray(array, "<" + dtype)
        data = values.tobytes()
        data += bytes(-len(data) % 4)
        place = [_TYPES[dtype], self.size, values.size]
        self.parts.append(data)
        self.size += len(data)
        return place

    def finish(self, header: dict[str, Any]) -> bytes:
        text = json.dumps(header, allow_nan=False).encode()
        text += b" " * (-len(text) % 4)
        return len(text).to_bytes(4, "little") + text + b"".join(self.parts)


def scene_blob(geometry: Geometry, groups: list[Group], look: Look, origin: np.ndarray, interval: float) -> bytes:
    """The bodies of a picture and their surroundings."""
    writer = _Writer()
    compounds = np.bincount(geometry.bodies, minlength=len(geometry.movable)) > 1
    lists = []
    for group in groups:
        shown = ~np.isin(group.bodies, list(look.hidden))
        if not shown.any():
            continue
        paints = paints_of(group, geometry.movable, compounds)[shown]
        entry = {"count": int(shown.sum()), "bodies": writer.add(group.bodies[shown], "u4"),
                 "sizes": writer.add(group.sizes[shown], "f4"), "paints": writer.add(paints, "u1"),
                 **_model(writer, group.model)}
        if np.any(group.poses[shown] != _IDENTITY):
            entry["poses"] = writer.add(group.poses[shown], "f4")
        lists.append(entry)
    for glass in (False, True):
        walls = [wall for wall in look.walls if (wall.thickness == 0) == glass]
        if walls:
            lists.append(_walls(writer, walls, len(geometry.movable), origin, glass))
    return writer.finish({
        "bodies": len(geometry.movable), "groups": lists, "up": look.up.tolist(), "bodySize": look.body_size,
        "interval": interval, "height": look.height, "origin": origin.tolist(),
        "balls": writer.add(look.balls - [*origin, 0], "f4"),
        "planes": [[*map(float, normal), float(offset - normal @ origin)] for normal, offset in look.planes],
    })


def _walls(writer: _Writer, walls: list[Wall], fixed: int, origin: np.ndarray, glass: bool) -> dict[str, Any]:
    """A group of boxes that belong to no body: their number is that of the bodies."""
    count = len(walls)
    paint = (255, 255, 255, GLASS) if glass else (*CONCRETE, LINES)
    poses = np.tile(_IDENTITY, (count, 1))
    poses[:, :3] = [wall.centre - origin for wall in walls]
    sizes = np.column_stack([[wall.half for wall in walls], np.zeros(count)])
    return {"count": count, "glass": glass, "bodies": writer.add(np.full(count, fixed), "u4"),
            "sizes": writer.add(sizes, "f4"), "paints": writer.add(np.tile(paint, (count, 1)), "u1"),
            "poses": writer.add(poses, "f4"), **_model(writer, box())}


def _model(writer: _Writer, model: Model | None) -> dict[str, Any]:
    if model is None:
        return {}
    return {"vertices": writer.add(model.vertices, "f4"), "indices": writer.add(model.indices, "u4"),
            "oneSided": model.one_sided}


def frame_blob(positions: np.ndarray, orientations: np.ndarray, awake: np.ndarray, origin: np.ndarray) -> bytes:
    """The poses of all bodies at a moment."""
    with np.errstate(over="ignore", invalid="ignore"):
        places = np.nan_to_num((positions - origin).astype("<f4"), posinf=3e38, neginf=-3e38)
    turns = np.rint(np.nan_to_num(orientations[:, [1, 2, 3, 0]]) * 32767).clip(-32767, 32767).astype("<i2")
    return places.tobytes() + turns.tobytes() + awake.astype(np.uint8).tobytes()


def movie_blob(frames: list[bytes]) -> bytes:
    """Frames, compressed: each byte is that of the frame before, xor its change."""
    packer = zlib.compressobj(6)
    parts, before = [], None
    for frame in frames:
        now = np.frombuffer(frame, np.uint8)
        parts.append(packer.compress((now if before is None else now ^ before).tobytes()))
        before = now
    return b"".join(parts) + packer.flush()

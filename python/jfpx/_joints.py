"""Joints between the bodies of a world."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

from . import _arrays
from ._errors import InvalidArgument
from ._forces import BodyId, Vector, _numbers, _optional


class JointId(NamedTuple):
    """Identifies a joint of one World for the lifetime of the joint. Never reused.

    Attributes
    ----------
    index : int
        That of a removed joint may be given to a later one.
    generation : int
        Differs for joints with the same index.
    """

    index: int
    generation: int


class JointState(NamedTuple):
    """A joint after the last step.

    Attributes
    ----------
    point_a : three numbers
        Anchor of body a in the world [m].
    point_b : three numbers
        That of body b.
    length : float
        Their distance [m].
    force : float
        [N], along the line of the anchors, mean of the last substep; > 0 pulls the bodies together.
    """

    point_a: tuple[float, ...]
    point_b: tuple[float, ...]
    length: float
    force: float


@dataclass(frozen=True)
class DistanceJoint:
    """Keeps the distance of two points of two bodies in a range: a rod, if both lengths are equal;
    a rope, if min_length is 0. Between the limits, a spring may act. World.add_joint() checks the
    fields, and raises InvalidArgument.

    a : body; b : another body, or None for the world; one of them movable
    anchor_a, anchor_b : points of the bodies in body axes, from the centre of mass; of the world,
    its coordinates [m]
    min_length, max_length : [m], 0 <= min_length <= max_length <= 1e9
    rest_length : [m] >= 0, of the spring
    hertz : [Hz] from 0 to 1e6, frequency of the spring; 0: none
    damping_ratio : from 0 to 1000, of the spring; 1: critical
    collide_connected : whether the two bodies have contacts with each other
    user_data : whole number up to 2**64 - 1, for the program
    """

    a: BodyId
    b: BodyId | None = None
    anchor_a: Vector = (0.0, 0.0, 0.0)
    anchor_b: Vector = (0.0, 0.0, 0.0)
    min_length: float = 0.0
    max_length: float = 1e9
    rest_length: float = 0.0
    hertz: float = 0.0
    damping_ratio: float = 0.0
    collide_connected: bool = False
    user_data: int = 0

    _name = "distance"

    def _values(self) -> tuple[Any, ...]:
        return (_arrays.body(self.a, "a"), _optional(self.b),
                _arrays.triple(self.anchor_a, "anchor_a"), _arrays.triple(self.anchor_b, "anchor_b"),
                *_numbers(self, "min_length", "max_length", "rest_length", "hertz",
                          "damping_ratio"),
                bool(self.collide_connected),
                _arrays.count(self.user_data, "user_data", 0, 2**64 - 1))

    @classmethod
    def _of(cls, fields: tuple[Any, ...]) -> DistanceJoint:
        a, b, *others = fields
        return cls(BodyId(*a), None if b is None else BodyId(*b), *others)


_TYPES = {joint._name: joint for joint in (DistanceJoint,)}


def arguments(joint: Any) -> tuple[str, tuple[Any, ...]]:
    """Name and fields of a joint, for the extension module."""
    if isinstance(joint, type) or not hasattr(joint, "_values"):
        raise InvalidArgument(f"joint is {joint!r}; it must be a joint of jfpx, such as "
                              "DistanceJoint(...)")
    return joint._name, joint._values()


def joint_of(name: str, fields: tuple[Any, ...]) -> Any:
    """A joint from its name and fields."""
    return _TYPES[name]._of(fields)

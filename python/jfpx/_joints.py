"""Joints between the bodies of a world."""

from __future__ import annotations

from dataclasses import dataclass, fields
from math import pi
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
    tension : float
        [N], of a DistanceJoint: along the line of the anchors; > 0 pulls the bodies together.
    force : three numbers
        [N], in the world, on body a at its anchor, mean of the last substep.
    torque : three numbers
        [N m], in the world, on body a in addition to that of the force.
    position : float
        [m] or [rad], of a relative to b: the length of a DistanceJoint, the angle of a HingeJoint in
        [-pi, pi], the position of a SliderJoint or a WheelJoint, the angle between the x axes of a
        BallJoint.
    speed : float
        [m/s] or [rad/s], rate of the position; of a WheelJoint that of its rotation.
    """

    point_a: tuple[float, ...]
    point_b: tuple[float, ...]
    length: float
    tension: float
    force: tuple[float, ...]
    torque: tuple[float, ...]
    position: float
    speed: float


Rotation = tuple[float, float, float, float]
_IDENTITY: Rotation = (1.0, 0.0, 0.0, 0.0)


class _Joint:
    """What all joints have in common. Their fields have the order of the engine."""

    def _values(self) -> tuple[Any, ...]:
        values: list[Any] = []
        for field in fields(self):  # type: ignore[arg-type]
            value = getattr(self, field.name)
            if field.name == "a":
                values.append(_arrays.body(value, "a"))
            elif field.name == "b":
                values.append(_optional(value))
            elif field.name.startswith("anchor_"):
                values.append(_arrays.triple(value, field.name))
            elif field.name.startswith("axes_"):
                values.append(_arrays.triple(value, field.name, 4))
            elif field.name == "collide_connected":
                values.append(bool(value))
            elif field.name == "user_data":
                values.append(_arrays.count(value, field.name, 0, 2**64 - 1))
            else:
                values.extend(_numbers(self, field.name))
        return tuple(values)

    @classmethod
    def _of(cls, values: tuple[Any, ...]) -> Any:
        a, b, *others = values
        return cls(BodyId(*a), None if b is None else BodyId(*b), *others)  # type: ignore[call-arg]


@dataclass(frozen=True)
class DistanceJoint(_Joint):
    """Keeps the distance of two points of two bodies in a range: a rod, if both lengths are equal;
    a rope, if min_length is 0. Between the limits, a spring may act. World.add_joint() checks the
    fields, and raises InvalidArgument.

    Attributes
    ----------
    a : BodyId
        A body.
    b : BodyId or None
        Another body, or None for the world; a or b is movable.
    anchor_a, anchor_b : three numbers
        Points of the bodies in body axes, from the centre of mass; of the world, its coordinates
        [m].
    min_length, max_length : float
        [m], 0 <= min_length <= max_length <= 1e9.
    rest_length : float
        [m] >= 0, of the spring.
    hertz : float
        [Hz] from 0 to 1e6, frequency of the spring; 0: none.
    damping_ratio : float
        From 0 to 1000, of the spring; 1: critical.
    collide_connected : bool
        Whether the two bodies have contacts with each other.
    user_data : int
        Whole number up to 2**64 - 1, for the program.
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


@dataclass(frozen=True)
class BallJoint(_Joint):
    """Holds two points of two bodies together: three rotations stay free.

    Attributes
    ----------
    a, b, anchor_a, anchor_b, collide_connected, user_data
        As in DistanceJoint.
    axes_a, axes_b : four numbers
        Unit quaternions (w, x, y, z), from joint axes to the axes of the bodies; the angles are 0
        when the joint axes coincide, and x is the twist axis.
    cone_angle : float
        [rad] from 0 to pi, largest angle between the x axes; pi: free.
    min_twist, max_twist : float
        [rad] from -pi to pi, of a about x; both: free, otherwise pi is a limit, too.
    hertz : float
        [Hz] from 0 to 1e6, of a spring to all angles 0; 0: none.
    damping_ratio : float
        From 0 to 1000, of the spring.
    friction_torque : float
        [N m] from 0 to 1e9, largest torque against rotation.
    """

    a: BodyId
    b: BodyId | None = None
    anchor_a: Vector = (0.0, 0.0, 0.0)
    anchor_b: Vector = (0.0, 0.0, 0.0)
    axes_a: Rotation = _IDENTITY
    axes_b: Rotation = _IDENTITY
    cone_angle: float = pi
    min_twist: float = -pi
    max_twist: float = pi
    hertz: float = 0.0
    damping_ratio: float = 0.0
    friction_torque: float = 0.0
    collide_connected: bool = False
    user_data: int = 0

    _name = "ball"


@dataclass(frozen=True)
class HingeJoint(_Joint):
    """Lets body a rotate relative to b about the x axis of the joint only.

    The other fields are those of BallJoint.

    Attributes
    ----------
    min_angle, max_angle : float
        [rad] from -pi to pi, of a about x; both: free, otherwise pi is a limit, too.
    target_angle : float
        [rad] from -pi to pi, of the spring.
    hertz, damping_ratio : float
        Of the spring, as in BallJoint.
    motor_speed : float
        [rad/s], of a about x.
    max_motor_torque : float
        [N m] from 0 to 1e9; 0: no motor; with speed 0: a brake.
    """

    a: BodyId
    b: BodyId | None = None
    anchor_a: Vector = (0.0, 0.0, 0.0)
    anchor_b: Vector = (0.0, 0.0, 0.0)
    axes_a: Rotation = _IDENTITY
    axes_b: Rotation = _IDENTITY
    min_angle: float = -pi
    max_angle: float = pi
    target_angle: float = 0.0
    hertz: float = 0.0
    damping_ratio: float = 0.0
    motor_speed: float = 0.0
    max_motor_torque: float = 0.0
    collide_connected: bool = False
    user_data: int = 0

    _name = "hinge"


@dataclass(frozen=True)
class SliderJoint(_Joint):
    """Lets body a move relative to b along the x axis of the joint only, without rotation.

    The other fields are those of BallJoint.

    Attributes
    ----------
    min_position, max_position : float
        [m] from -1e9 to 1e9, of a's anchor along x.
    target_position : float
        [m], of the spring.
    hertz, damping_ratio : float
        Of the spring, as in BallJoint.
    motor_speed : float
        [m/s], of a along x.
    max_motor_force : float
        [N] from 0 to 1e9; 0: no motor; with speed 0: a brake.
    """

    a: BodyId
    b: BodyId | None = None
    anchor_a: Vector = (0.0, 0.0, 0.0)
    anchor_b: Vector = (0.0, 0.0, 0.0)
    axes_a: Rotation = _IDENTITY
    axes_b: Rotation = _IDENTITY
    min_position: float = -1e9
    max_position: float = 1e9
    target_position: float = 0.0
    hertz: float = 0.0
    damping_ratio: float = 0.0
    motor_speed: float = 0.0
    max_motor_force: float = 0.0
    collide_connected: bool = False
    user_data: int = 0

    _name = "slider"


@dataclass(frozen=True)
class FixedJoint(_Joint):
    """Keeps two bodies in the relative pose in which their joint frames coincide.

    The other fields are those of BallJoint.

    Attributes
    ----------
    linear_hertz, angular_hertz : float
        [Hz] from 0 to 1e6, of springs that hold points and axes; 0: rigid.
    damping_ratio : float
        From 0 to 1000, of the springs.
    """

    a: BodyId
    b: BodyId | None = None
    anchor_a: Vector = (0.0, 0.0, 0.0)
    anchor_b: Vector = (0.0, 0.0, 0.0)
    axes_a: Rotation = _IDENTITY
    axes_b: Rotation = _IDENTITY
    linear_hertz: float = 0.0
    angular_hertz: float = 0.0
    damping_ratio: float = 0.0
    collide_connected: bool = False
    user_data: int = 0

    _name = "fixed"


@dataclass(frozen=True)
class WheelJoint(_Joint):
    """A wheel a on a vehicle b: rotates about the x axis of the joint, and moves along its y axis,
    the direction of the suspension.

    The other fields are those of BallJoint.

    Attributes
    ----------
    min_position, max_position : float
        [m] from -1e9 to 1e9, of the wheel along y.
    hertz, damping_ratio : float
        Of the suspension to position 0, as in BallJoint.
    steering_angle : float
        [rad] from -pi to pi, about y.
    motor_speed : float
        [rad/s], of the wheel about x.
    max_motor_torque : float
        [N m] from 0 to 1e9; 0: no motor; with speed 0: a brake.
    """

    a: BodyId
    b: BodyId | None = None
    anchor_a: Vector = (0.0, 0.0, 0.0)
    anchor_b: Vector = (0.0, 0.0, 0.0)
    axes_a: Rotation = _IDENTITY
    axes_b: Rotation = _IDENTITY
    min_position: float = -1e9
    max_position: float = 1e9
    hertz: float = 0.0
    damping_ratio: float = 0.0
    steering_angle: float = 0.0
    motor_speed: float = 0.0
    max_motor_torque: float = 0.0
    collide_connected: bool = False
    user_data: int = 0

    _name = "wheel"


_TYPES = {joint._name: joint for joint in (DistanceJoint, BallJoint, HingeJoint, SliderJoint,
                                           FixedJoint, WheelJoint)}


def arguments(joint: Any) -> tuple[str, tuple[Any, ...]]:
    """Name and fields of a joint, for the extension module."""
    if isinstance(joint, type) or not hasattr(joint, "_values"):
        raise InvalidArgument(f"joint is {joint!r}; it must be a joint of jfpx, such as "
                              "DistanceJoint(...)")
    return joint._name, joint._values()


def joint_of(name: str, fields: tuple[Any, ...]) -> Any:
    """A joint from its name and fields."""
    return _TYPES[name]._of(fields)

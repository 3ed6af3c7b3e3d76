"""Joints between the bodies of a world."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from math import pi
from typing import Any, NamedTuple, TypeVar, Union

import numpy as np

from . import _arrays
from ._errors import InvalidArgument
from ._forces import BodyId, BodyState, Vector, _numbers, _optional


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


Joint = Union[DistanceJoint, BallJoint, HingeJoint, SliderJoint, FixedJoint, WheelJoint]
"""A joint of any type."""

JointWithAxes = TypeVar("JointWithAxes", BallJoint, HingeJoint, SliderJoint, FixedJoint, WheelJoint)

_TYPES = {joint._name: joint for joint in (DistanceJoint, BallJoint, HingeJoint, SliderJoint,
                                           FixedJoint, WheelJoint)}


def place_joint(joint: JointWithAxes, a: BodyState, b: BodyState | None, point: Vector,
                axis: Vector, y_axis: Vector | None = None) -> JointWithAxes:
    """The joint with the frames of its zero position for given poses of its bodies::

        door, frame = world.bodies
        hinge = jfpx.place_joint(jfpx.HingeJoint(door, frame, min_angle=0, max_angle=2),
                                 world.state(door), world.state(frame), point=(0, 1, 0), axis=(0, 1, 0))
        world.add_joint(hinge)

    Parameters
    ----------
    joint : BallJoint, HingeJoint, SliderJoint, FixedJoint or WheelJoint
        Its anchors and axes are replaced.
    a, b : BodyState
        Of the bodies of the joint; `b` is None for the world.
    point : three numbers
        [m], of both anchors, in the axes of the world.
    axis : three numbers
        x axis of the joint in the axes of the world, of any length but 0.
    y_axis : three numbers, optional
        The y axis of the joint is as near as possible to it, for example the direction of the
        suspension of a WheelJoint; any if absent.

    Raises
    ------
    InvalidArgument
        The joint has no axes, `b` is None but not that of the joint, or the reverse, a vector is
        zero, not finite or not of three numbers, or `axis` and `y_axis` are parallel.
    """
    if isinstance(joint, type) or not hasattr(joint, "axes_a"):
        raise InvalidArgument(f"joint is {joint!r}; it must be a joint with axes, such as HingeJoint(...)")
    if (b is None) != (joint.b is None):
        given, used = ("absent", "joint.b is a body") if b is None else ("a state", "joint.b is the world")
        raise InvalidArgument(f"b is {given}, but {used}")
    if b is None:
        b = BodyState((0.0, 0.0, 0.0), _IDENTITY, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    axes = _axes_along(axis, y_axis)
    at = np.array(_arrays.triple(point, "point"))
    if not np.all(np.isfinite(at)):
        raise InvalidArgument(f"point is {point}; it must be finite")
    frames: dict[str, Any] = {}
    for name, state in (("a", a), ("b", b)):
        if not isinstance(state, BodyState):
            raise InvalidArgument(f"{name} is of type {type(state).__name__}; it must be a BodyState")
        w, x, y, z = _arrays.triple(state.orientation, f"{name}.orientation", 4)
        to_body = np.array((w, -x, -y, -z))
        arm = at - np.array(_arrays.triple(state.position, f"{name}.position"))
        turned = _product(_product(to_body, np.array((0.0, *arm))), np.array((w, x, y, z)))
        frames[f"anchor_{name}"] = tuple(turned[1:].tolist())
        frames[f"axes_{name}"] = tuple(_product(to_body, axes).tolist())
    return replace(joint, **frames)


def _product(p: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Of quaternions (w, x, y, z)."""
    return np.array((p[0] * q[0] - p[1:] @ q[1:],
                     *(p[0] * q[1:] + q[0] * p[1:] + np.cross(p[1:], q[1:]))))


def _axes_along(axis: Vector, y_axis: Vector | None) -> np.ndarray:
    """The rotation from joint axes to the axes of the world, as a quaternion."""
    x = _direction(axis, "axis")
    if y_axis is None:
        near = np.eye(3)[np.argmin(np.abs(x))]  # far from x
    else:
        near = _direction(y_axis, "y_axis")
    y = near - x * (x @ near)
    length = float(np.linalg.norm(y))
    if length < 1e-6:
        raise InvalidArgument(f"y_axis is {y_axis}; it must not be parallel to axis")
    y /= length
    m = np.column_stack((x, y, np.cross(x, y)))
    # The largest of the four components divides the others (Shepperd 1978).
    squares = np.array((1 + m[0, 0] + m[1, 1] + m[2, 2], 1 + m[0, 0] - m[1, 1] - m[2, 2],
                        1 - m[0, 0] + m[1, 1] - m[2, 2], 1 - m[0, 0] - m[1, 1] + m[2, 2]))
    rows = np.array(((squares[0], m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]),
                     (m[2, 1] - m[1, 2], squares[1], m[1, 0] + m[0, 1], m[0, 2] + m[2, 0]),
                     (m[0, 2] - m[2, 0], m[1, 0] + m[0, 1], squares[2], m[2, 1] + m[1, 2]),
                     (m[1, 0] - m[0, 1], m[0, 2] + m[2, 0], m[2, 1] + m[1, 2], squares[3])))
    q: np.ndarray = rows[np.argmax(squares)]
    return q / np.linalg.norm(q)


def _direction(vector: Any, name: str) -> np.ndarray:
    values = np.array(_arrays.triple(vector, name))
    largest = float(np.max(np.abs(values)))
    if not 0 < largest < np.inf:
        raise InvalidArgument(f"{name} is {vector}; it must be finite and not zero")
    values /= largest
    return values / np.linalg.norm(values)


def arguments(joint: Any) -> tuple[str, tuple[Any, ...]]:
    """Name and fields of a joint, for the extension module."""
    if isinstance(joint, type) or not hasattr(joint, "_values"):
        raise InvalidArgument(f"joint is {joint!r}; it must be a joint of jfpx, such as "
                              "DistanceJoint(...)")
    return joint._name, joint._values()


def joint_of(name: str, fields: tuple[Any, ...]) -> Joint:
    """A joint from its name and fields."""
    joint: Joint = _TYPES[name]._of(fields)
    return joint

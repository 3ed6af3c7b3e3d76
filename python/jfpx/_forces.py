"""Forces that act on the bodies of a world in every step."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, TypeVar, Union

import numpy as np

from . import _arrays
from ._errors import InvalidArgument


class BodyId(NamedTuple):
    """Identifies a body of one World for the lifetime of the body. Never reused.

    Attributes
    ----------
    index : int
        Row of the body in World.device_states(), and its number in arrays of contacts and rays.
        That of a removed body may be given to a later one.
    generation : int
        Differs for bodies with the same index.
    """

    index: int
    generation: int


class States(NamedTuple):
    """States of all bodies, in the order of World.bodies, in the dtype of the world.

    Attributes
    ----------
    positions : array (N, 3)
        Centres of mass [m].
    orientations : array (N, 4)
        Unit quaternions (w, x, y, z).
    velocities : array (N, 3)
        [m/s]
    angular_velocities : array (N, 3)
        [rad/s], in the axes of the world.
    """

    positions: Any
    orientations: Any
    velocities: Any
    angular_velocities: Any

    @classmethod
    def empty(cls, size: int, dtype: Any) -> States:
        """New arrays of NumPy with `size` rows, whose values are undefined."""
        return cls(np.empty((size, 3), dtype), np.empty((size, 4), dtype),
                   np.empty((size, 3), dtype), np.empty((size, 3), dtype))


class BodyState(NamedTuple):
    """State of motion of a body. World.set_state() has the ranges.

    Attributes
    ----------
    position : three numbers
        Centre of mass [m].
    orientation : four numbers
        Unit quaternion (w, x, y, z).
    velocity : three numbers
        [m/s]
    angular_velocity : three numbers
        [rad/s], in the axes of the world.
    """

    position: tuple[float, ...]
    orientation: tuple[float, ...] = (1.0, 0.0, 0.0, 0.0)
    velocity: tuple[float, ...] = (0.0, 0.0, 0.0)
    angular_velocity: tuple[float, ...] = (0.0, 0.0, 0.0)


Motion = TypeVar("Motion", States, BodyState)


def interpolate(before: Motion, after: Motion, t: float) -> Motion:
    """State or states between two steps, for drawing: linear interpolation, of orientations
    normalized and along the shorter arc. Draw `after` for bodies that set_state() has moved in
    between.

    Parameters
    ----------
    before, after : BodyState or States
        Both of the same type, and States of the same bodies, in host memory.
    t : float
        0: `before`, 1: `after`. Finite; outside of this range, the motion is extrapolated.

    Returns
    -------
    BodyState or States
        The arrays of States are new.

    Raises
    ------
    InvalidArgument
        Different types, arrays of different shapes, or a `t` that is not finite.
    """
    t = _arrays.number(t, "t")
    if not math.isfinite(t):
        raise InvalidArgument(f"t is {t}; it must be finite")
    if type(before) is not type(after) or not isinstance(after, (BodyState, States)):
        raise InvalidArgument(f"before is a {type(before).__name__} and after a "
                              f"{type(after).__name__}; both must be BodyState or both States")
    parts = []
    for name, a, b in zip(after._fields, before, after):
        a, b = np.asarray(a), np.asarray(b)
        if a.shape != b.shape:
            raise InvalidArgument(f"{name} has the shape {a.shape} before and {b.shape} after")
        least = np.float32 if isinstance(after, States) else np.float64
        dtype = np.result_type(a, b, least)
        a, b = a.astype(dtype), b.astype(dtype)
        if name.startswith("orientation"):
            b = np.where(np.sum(a * b, axis=-1, keepdims=True) < 0, -b, b)
        mixed = a * dtype.type(1 - t) + b * dtype.type(t)
        if name.startswith("orientation"):
            mixed /= np.linalg.norm(mixed, axis=-1, keepdims=True)
        parts.append(mixed)
    if isinstance(after, States):
        return States(*parts)
    return BodyState(*(tuple(part.tolist()) for part in parts))


Vector = Union[Sequence[float], "np.ndarray[Any, Any]"]
"""Numbers of a vector or quaternion: a sequence or an array."""


def _optional(body: Any) -> tuple[int, int] | None:
    return None if body is None else _arrays.body(body)


def _numbers(force: Any, *fields: str) -> list[float]:
    return [_arrays.number(getattr(force, field), field) for field in fields]


@dataclass(frozen=True)
class Gravity:
    """Force mass * acceleration [m/s^2] on one body or on all, in addition to their own
    acceleration, which is gravity by default; acceleration finite. World.add_force() checks the
    fields of all forces, and raises InvalidArgument."""

    acceleration: Vector = (0.0, -9.81, 0.0)
    body: BodyId | None = None

    def _add(self, core: Any) -> int:
        return core.add_gravity(_arrays.triple(self.acceleration, "acceleration"),
                                _optional(self.body))


@dataclass(frozen=True)
class Drag:
    """Drag -(linear + quadratic * s) * u on one body or on all, where u is the velocity relative to
    the wind [m/s], and s its magnitude; linear [kg/s] >= 0, quadratic [kg/m] >= 0, all finite."""

    linear: float = 0.0
    quadratic: float = 0.0
    wind: Vector = (0.0, 0.0, 0.0)
    body: BodyId | None = None

    def _add(self, core: Any) -> int:
        return core.add_drag(*_numbers(self, "linear", "quadratic"),
                             _arrays.triple(self.wind, "wind"), _optional(self.body))


@dataclass(frozen=True)
class Attachment:
    """Attachment point of a spring: a point [m], finite, in the axes of a body from its centre of
    mass, or without a body in those of the world."""

    body: BodyId | None = None
    point: Vector = (0.0, 0.0, 0.0)

    def _pair(self) -> tuple[BodyId | None, tuple[float, ...]]:
        return _optional(self.body), _arrays.triple(self.point, "point")


@dataclass(frozen=True)
class Spring:
    """Spring between two attachments, at least one of which has a body, and not both the same one;
    stiffness [N/m] >= 0, damping [N s/m] >= 0, rest_length [m] >= 0, all finite."""

    a: Attachment
    b: Attachment
    stiffness: float
    damping: float = 0.0
    rest_length: float = 0.0

    def _add(self, core: Any) -> int:
        return core.add_spring(*self._arguments())

    def _arguments(self) -> tuple[Any, ...]:
        ends = (_arrays.instance(getattr(self, name), name, Attachment, ", such as Attachment(body)")
                for name in ("a", "b"))
        return (*(end._pair() for end in ends),
                *_numbers(self, "stiffness", "damping", "rest_length"))


@dataclass(frozen=True)
class Bungee(Spring):
    """A spring without force while it is shorter than its rest length. Fields as in Spring."""

    def _add(self, core: Any) -> int:
        return core.add_bungee(*self._arguments())


@dataclass(frozen=True)
class Buoyancy:
    """Buoyancy of one body or of all in the liquid where dot(normal, p) <= offset [m]. `normal`
    is a unit vector, to a thousandth of the squared length; density [kg/m^3] >= 0 and gravity
    [m/s^2] >= 0, all finite."""

    normal: Vector = (0.0, 1.0, 0.0)
    offset: float = 0.0
    density: float = 1000.0
    gravity: float = 9.81
    body: BodyId | None = None

    def _add(self, core: Any) -> int:
        return core.add_buoyancy(_arrays.triple(self.normal, "normal"),
                                 *_numbers(self, "offset", "density", "gravity"),
                                 _optional(self.body))


@dataclass(frozen=True)
class Explosion:
    """Pressure wave: a spherical shell that expands from `centre` [m] at `start` [s] of the time
    of the world with `speed` [m/s] > 0, and fades in `duration` [s] > 0; `peak_force` [N] >= 0 in
    the middle of its `thickness` [m] > 0. All finite."""

    centre: Vector = (0.0, 0.0, 0.0)
    start: float = 0.0
    peak_force: float = 0.0
    speed: float = 340.0
    thickness: float = 10.0
    duration: float = 1.0

    def _add(self, core: Any) -> int:
        return core.add_explosion(
            _arrays.triple(self.centre, "centre"),
            *_numbers(self, "start", "peak_force", "speed", "thickness", "duration"))


class _StepView:
    """The world during a step, for a function of Python."""

    def __init__(self, core: Any, dtype: Any) -> None:
        self._core = core
        self._dtype = dtype

    @property
    def dt(self) -> float:
        """Length of the step [s], > 0."""
        return self._core.dt

    @property
    def time(self) -> float:
        """Time of the world at the start of the step [s]; 0 in the first."""
        return self._core.time

    @property
    def bodies(self) -> list[BodyId]:
        """Living bodies in the order of their indices."""
        return [BodyId(*body) for body in self._core.bodies()]

    def states(self) -> States:
        """States of all bodies as new arrays (N, 3) and (N, 4) of the dtype of the world, in the
        order of `bodies`."""
        states = States.empty(self._core.size(), self._dtype)
        self._core.write_states(*states)
        return states

    def state(self, body: BodyId) -> BodyState:
        """State of a body. Raises InvalidArgument for an unknown body."""
        return BodyState(*self._core.state(_arrays.body(body)))

    def mass(self, body: BodyId) -> float:
        """Mass of a body [kg], >= 0; 0: immovable or kinematic. Raises InvalidArgument for an unknown
        body."""
        return self._core.mass(_arrays.body(body))

    def awake(self, body: BodyId) -> bool:
        """Whether a body is awake. Raises InvalidArgument for an unknown body."""
        return self._core.awake(_arrays.body(body))


class ForceContext(_StepView):
    """The world at the start of a step, for a force that is a function of Python. Valid during the
    call: afterwards, every use raises InvalidArgument. Contributions affect awake bodies only. They
    are not checked: a value that is not finite undoes the step, and sets StepReport.non_finite. A
    body is unknown if its id is not of a living body of the world."""

    def wake(self, body: BodyId) -> None:
        """Wakes a movable body. Raises InvalidArgument for an unknown body."""
        self._core.wake(_arrays.body(body))

    def apply_force(self, body: BodyId, force: Vector) -> None:
        """Adds a force [N] at the centre of mass, in world axes. Raises InvalidArgument for an
        unknown body, or if there are not three numbers."""
        self._core.apply_force(_arrays.body(body), _arrays.triple(force, "force"))

    def apply_torque(self, body: BodyId, torque: Vector) -> None:
        """Adds a torque [N m], in world axes. Raises InvalidArgument as apply_force()."""
        self._core.apply_torque(_arrays.body(body), _arrays.triple(torque, "torque"))

    def apply_force_at_point(self, body: BodyId, force: Vector, point: Vector) -> None:
        """Adds a force [N] at a point [m] of the world. Raises InvalidArgument as apply_force()."""
        self._core.apply_force_at_point(_arrays.body(body), _arrays.triple(force, "force"),
                                        _arrays.triple(point, "point"))

    def apply_forces(self, forces: Any) -> None:
        """Adds a force [N] on each body: an array (N, 3), in the order of `bodies`, which is converted
        to the dtype of the world. Raises InvalidArgument for a wrong shape or type."""
        forces = _arrays.rows(_arrays.converted(forces, "forces", self._dtype), "forces", 3)
        size = self._core.size()
        if forces.shape[0] != size:
            raise InvalidArgument(f"forces has {forces.shape[0]} rows; it must have one for each "
                                  f"of {size} bodies")
        self._core.apply_forces(forces)

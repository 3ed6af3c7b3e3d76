"""Worlds of rigid bodies."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from . import _arrays
from ._errors import InvalidArgument
from ._forces import BodyId, BodyState, ForceContext, States, Vector
from ._scene import Scene


class StepReport(NamedTuple):
    """Result of a step. Times are wall-clock times."""

    step: int
    """Number of completed steps, without undone ones."""
    contacts: int
    """Contacts found by detection, including those of sensors."""
    sphere_contacts: int
    """Of these, contacts between two spheres."""
    generated_contacts: int
    """Contacts of contact generators, not included in `contacts`."""
    position_iterations: int
    """Corrections of positions by the solver worst_first."""
    velocity_iterations: int
    """Corrections of velocities by the solver worst_first."""
    iterations_exhausted: bool
    """A loop of the solver stopped at its limit with work left."""
    non_finite: bool
    """A value of a body is no longer finite; the step was undone, and so are further ones."""
    non_finite_body: tuple[int, int] | None
    """The first such body."""
    awake: int
    """Movable bodies awake after the step."""
    backend: str
    """Device of the step, or that found the sphere contacts of a step on the CPU."""
    algorithm: str
    choice: str
    """Reason for backend and algorithm."""
    device_failure: str
    """Error of a device whose work the CPU took over; empty if there was none."""
    integrate_ms: float
    """[ms], forces and, with the solver worst_first, integration."""
    detect_ms: float
    """[ms], contact detection."""
    resolve_ms: float
    """[ms], all other stages. In a step on a GPU, these three are times of the device."""
    total_ms: float
    """[ms], the whole step."""


class WorldContacts(NamedTuple):
    """Contact points of the last step, in the order of World::contacts() in C++."""

    pairs: Any
    """(2, E) int64: BodyId.index of a and b."""
    normal: Any
    """(E, 3) [-]: unit vectors from b to a."""
    point: Any
    """(E, 3) [m], world: middle of the overlap, or a point of b if the bodies met in the step."""
    distance: Any
    """(E,) [m], <= 0: negative penetration depths; 0 if the bodies met in the step."""
    friction: Any
    """(E,) [-]."""
    restitution: Any
    """(E,) [-]."""
    sensor: Any
    """(E,) bool: a or b is a sensor."""


BEGIN, STAY, END = 0, 1, 2


class ContactEvents(NamedTuple):
    """Pairs of bodies that began to touch, stay in contact or ceased to touch in the last step."""

    phase: Any
    """(E,) int64: BEGIN, STAY or END."""
    pairs: Any
    """(2, E) int64: BodyId.index, pairs[0] < pairs[1]."""
    contacts: Any
    """(E,) int64: number of contact points."""
    normal: Any
    """(E, 3) [-]: unit vectors from b to a, at the deepest point."""
    point: Any
    """(E, 3) [m], world: the deepest points."""
    distance: Any
    """(E,) [m], <= 0."""


class RayHit(NamedTuple):
    """Point where a ray enters a body."""

    body: BodyId
    distance: float
    """[m], from the origin."""
    point: tuple[float, ...]
    """[m], world."""
    normal: tuple[float, ...]
    """[-], unit, outwards."""


class RayHits(NamedTuple):
    """First hits of many rays."""

    bodies: Any
    """(R,) int64: BodyId.index; -1: no hit."""
    distance: Any
    """(R,) [m]; infinity: no hit."""
    point: Any
    """(R, 3) [m]; zero: no hit."""
    normal: Any
    """(R, 3) [-]; zero: no hit."""


class World:
    """Rigid bodies and their motion. Steps are deterministic to the last bit, whatever the
    backend, the algorithm and the number of threads.

    One thread may use a world at a time: while step() or run() of one thread works, without
    Python's global lock, every call of another raises ConcurrentUse.

    Parameters
    ----------
    scene : Scene, dict or str
        A scene, its fields, or the name of a scene.
    dtype : "float32" or "float64", optional
        Precision, where `scene` is not a Scene.
    backend, algorithm, threads, device
        As for SphereCollider. `threads` also run the other parts of a step.

    Raises
    ------
    InvalidScene, InvalidArgument, BackendUnavailable, OutOfMemory
    """

    def __init__(self, scene: Scene | dict[str, Any] | str, *, dtype: Any = None,
                 backend: str = "auto", algorithm: str = "automatic", threads: int = 1,
                 device: int = 0) -> None:
        if isinstance(scene, str):
            scene = Scene.named(scene, dtype=dtype or "float32")
        elif isinstance(scene, dict):
            scene = Scene(scene, dtype=dtype or "float32")
        elif not isinstance(scene, Scene):
            raise InvalidArgument(f"scene is {type(scene).__name__}; it must be a Scene, a dict "
                                  "or a name")
        elif dtype is not None and np.dtype(dtype) != scene.dtype:
            raise InvalidArgument(f"dtype is {dtype}; that of the scene is {scene.dtype}")
        self._dtype = scene.dtype
        self._core = _arrays.precision_of(self._dtype).World(
            scene._scene, backend, algorithm, _arrays.count(threads, "threads", 0, 256),
            _arrays.count(device, "device", 0, 2**31 - 1))
        self._report: StepReport | None = None

    # Steps

    def step(self) -> StepReport:
        """Advances the world by the dt of its scene. An exception of a force undoes the step.

        Raises
        ------
        OutOfMemory, DeviceError, ConcurrentUse
        """
        self._report = StepReport(*self._core.step())
        return self._report

    def run(self, steps: int, *, after_step: Callable[[StepReport], Any] | None = None) -> StepReport:
        """Makes many steps, and returns the report of the last. Stops after a step that was undone
        because a value is no longer finite. KeyboardInterrupt ends it between two steps.

        Parameters
        ----------
        steps : int, > 0
        after_step : function, optional
            Called with the report of every step.
        """
        steps = _arrays.count(steps, "steps", 1, 2**63 - 1)
        if after_step is None:
            self._report = StepReport(*self._core.run(steps))
            return self._report
        for _ in range(steps):
            report = self.step()
            after_step(report)
            if report.non_finite:
                break
        return report

    @property
    def report(self) -> StepReport | None:
        """Report of the last step; None before the first."""
        return self._report

    @property
    def dtype(self) -> np.dtype:
        return self._dtype

    @property
    def time(self) -> float:
        """[s], completed steps times dt."""
        return self._core.time()

    @property
    def scene(self) -> Scene:
        """The scene of which the world was made."""
        return Scene._of(self._core.scene(), self._dtype)

    def state_hash(self) -> int:
        """Hash of all states: equal hashes mean equal states to the last bit."""
        return self._core.state_hash()

    def snapshot(self) -> bytes:
        """The state as a value: all that the following steps depend on, except for Python functions.
        Equal states have equal bytes, whatever the backend and the number of threads."""
        return self._core.snapshot()

    def restore(self, snapshot: bytes) -> None:
        """Replaces the state by that of a snapshot of this or of another world of the same dtype. The
        following steps have the bits of those without. A world that is to be restored must have
        Python functions as forces with the ids of the snapshot. Raises InvalidSnapshot; the world is
        then unchanged."""
        if not isinstance(snapshot, bytes):
            raise InvalidArgument(f"snapshot is of type {type(snapshot).__name__}; it must be bytes")
        self._core.restore(snapshot)

    def close(self) -> None:
        """Frees the world now. Later calls raise Closed. Also at the end of a `with` statement."""
        self._core.close()

    def __enter__(self) -> World:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    # Bodies

    def __len__(self) -> int:
        """Number of living bodies."""
        return self._core.size()

    @property
    def bodies(self) -> list[BodyId]:
        """Living bodies in the order of their indices."""
        return [BodyId(*body) for body in self._core.bodies()]

    def body_at(self, index: int) -> BodyId:
        """The living body with an index. Raises InvalidArgument if there is none."""
        return BodyId(*self._core.body_at(_arrays.count(index, "index", 0, 2**32 - 1)))

    def __contains__(self, body: BodyId) -> bool:
        return self._core.contains(body)

    def add(self, body: dict[str, Any]) -> BodyId:
        """Adds a body, with the fields of a body in a scene. Raises InvalidScene."""
        return self.add_scene(Scene({"bodies": [body]}, dtype=self._dtype))[0]

    def add_scene(self, scene: Scene) -> list[BodyId]:
        """Adds the bodies of a scene; its settings have no effect."""
        if scene.dtype != self._dtype:
            raise InvalidArgument(f"the scene has dtype {scene.dtype}; the world has {self._dtype}")
        return [BodyId(*body) for body in self._core.add(scene._scene)]

    def remove(self, body: BodyId) -> None:
        """Removes a body and wakes the bodies in contact with it."""
        self._core.remove(body)

    def states(self) -> States:
        """States of all bodies as new arrays, in the order of `bodies`."""
        states = States.empty(len(self), self._dtype)
        self._core.write_states(*states)
        return states

    def device_states(self) -> States:
        """States in the memory of the GPU that steps the world, as arrays that share it: a library
        reads them with its `from_dlpack()`, and jfpx takes them as they are.

        Row i is that of the body with BodyId.index i; rows of removed bodies have no meaning. The
        arrays are valid until the next step or change of the world, and must not be written. The
        step or change waits for all work of the GPU, which may still read them. The first call after
        a change by the host uploads the world.

        Raises
        ------
        BackendUnavailable
            No GPU steps the world; it needs backend="cuda" and the solver soft_step.
        OutOfMemory, DeviceError
        """
        return States(*self._core.device_states())

    def set_states(self, states: States) -> None:
        """Replaces the states of all bodies, or of none if one is invalid."""
        size = len(self)
        arrays = []
        for name, array, columns in zip(States._fields, states, (3, 4, 3, 3)):
            array = _arrays.rows(array, name, columns, self._dtype)
            if array.shape[0] != size:
                raise InvalidArgument(f"{name} has {array.shape[0]} rows; it must have one for "
                                      f"each of {size} bodies")
            arrays.append(array)
        self._core.set_states(*arrays)

    @property
    def positions(self) -> np.ndarray:
        """(N, 3) [m]: a copy of the positions of all bodies, in the order of `bodies`."""
        return self.states().positions

    @property
    def velocities(self) -> np.ndarray:
        """(N, 3) [m/s]: a copy of the velocities."""
        return self.states().velocities

    def state(self, body: BodyId) -> BodyState:
        return BodyState(*self._core.state(body))

    def set_state(self, body: BodyId, state: BodyState) -> None:
        """Replaces the state of a body, and wakes it and the bodies in contact with it."""
        state = BodyState(*state)
        self._core.set_state(body, _arrays.triple(state.position, "position"),
                             _arrays.triple(state.orientation, "orientation", 4),
                             _arrays.triple(state.velocity, "velocity"),
                             _arrays.triple(state.angular_velocity, "angular_velocity"))

    def awake(self, body: BodyId) -> bool:
        return self._core.awake(body)

    def wake(self, body: BodyId) -> None:
        self._core.wake(body)

    def mass(self, body: BodyId) -> float:
        """[kg]; 0: immovable or kinematic."""
        return self._core.mass(body)

    def set_mass(self, body: BodyId, mass: float) -> None:
        """[kg], > 0. The inertia follows, unless it was given."""
        self._core.set_mass(body, _arrays.number(mass, "mass"))

    def friction(self, body: BodyId) -> float:
        """[-]."""
        return self._core.friction(body)

    def set_friction(self, body: BodyId, friction: float) -> None:
        """[-], >= 0."""
        self._core.set_friction(body, _arrays.number(friction, "friction"))

    def restitution(self, body: BodyId) -> float:
        """[-]."""
        return self._core.restitution(body)

    def set_restitution(self, body: BodyId, restitution: float) -> None:
        """[-], in [0, 1]."""
        self._core.set_restitution(body, _arrays.number(restitution, "restitution"))

    def acceleration(self, body: BodyId) -> tuple[float, ...]:
        """[m/s^2], constant; gravity by default."""
        return self._core.acceleration(body)

    def set_acceleration(self, body: BodyId, acceleration: Vector) -> None:
        self._core.set_acceleration(body, _arrays.triple(acceleration, "acceleration"))

    def damping(self, body: BodyId) -> tuple[float, float]:
        """[-]: fractions of velocity and of angular velocity kept per second."""
        return self._core.damping(body)

    def set_damping(self, body: BodyId, linear: float, angular: float) -> None:
        """[-], each in (0, 1]."""
        self._core.set_damping(body, _arrays.number(linear, "linear"),
                               _arrays.number(angular, "angular"))

    def sensor(self, body: BodyId) -> bool:
        return self._core.sensor(body)

    def filter(self, body: BodyId) -> tuple[int, int]:
        """Category and mask."""
        return self._core.filter(body)

    def set_filter(self, body: BodyId, category: int, mask: int) -> None:
        """Two bodies collide if each has a category that is in the mask of the other."""
        self._core.set_filter(body, _arrays.count(category, "category", 0, 2**32 - 1),
                              _arrays.count(mask, "mask", 0, 2**32 - 1))

    def pair_ignored(self, a: BodyId, b: BodyId) -> bool:
        return self._core.pair_ignored(a, b)

    def set_pair_ignored(self, a: BodyId, b: BodyId, ignored: bool) -> None:
        """Adds two bodies to the pairs that do not collide, or removes them."""
        self._core.set_pair_ignored(a, b, bool(ignored))

    # Forces

    def apply_force(self, body: BodyId, force: Vector, point: Vector | None = None) -> None:
        """Applies a force [N] in the next step, at a point [m] of the world or at the centre of
        mass. Wakes the body."""
        force = _arrays.triple(force, "force")
        if point is None:
            self._core.apply_force(body, force)
        else:
            self._core.apply_force_at_point(body, force, _arrays.triple(point, "point"))

    def apply_torque(self, body: BodyId, torque: Vector) -> None:
        """Applies a torque [N m] in the next step. Wakes the body."""
        self._core.apply_torque(body, _arrays.triple(torque, "torque"))

    def add_force(self, force: Any) -> int:
        """Adds a force that acts in every step, and returns its number. Wakes all bodies.

        Parameters
        ----------
        force : Gravity, Drag, Spring, Bungee, Buoyancy, Explosion, or a function
            A function is called with a ForceContext at the start of every step. Calls in the same
            state must have the same result. It must not use the world. Its exceptions undo the
            step and are raised by step().
        """
        if hasattr(force, "_add"):
            return force._add(self._core)
        if not callable(force):
            raise InvalidArgument(f"force is {type(force).__name__}; it must be a force of jfpx "
                                  "or a function")
        return self._core.add_function(functools.partial(_call, force, self._dtype))

    def remove_force(self, number: int) -> None:
        """Removes a force and wakes all bodies. Raises InvalidArgument for an unknown number."""
        self._core.remove_force(_arrays.count(number, "force", 0, 2**64 - 1))

    @property
    def forces(self) -> list[int]:
        """Numbers of the forces, in the order in which they act."""
        return self._core.forces()

    # Contacts and queries

    def contacts(self) -> WorldContacts:
        """Contact points of the last step, as new arrays."""
        size = self._core.contact_count()
        result = WorldContacts(np.empty((2, size), np.int64), self._rows(size), self._rows(size),
                               self._values(size), self._values(size), self._values(size),
                               np.empty(size, bool))
        self._core.write_contacts(*result)
        return result

    def contact_events(self) -> ContactEvents:
        """Changes of the contacts in the last step, as new arrays."""
        size = self._core.event_count()
        result = ContactEvents(np.empty(size, np.int64), np.empty((2, size), np.int64),
                               np.empty(size, np.int64), self._rows(size), self._rows(size),
                               self._values(size))
        self._core.write_events(*result)
        return result

    def cast_ray(self, origin: Vector, direction: Vector, max_distance: float = math.inf, *,
                 filter: Callable[[BodyId], bool] | None = None) -> RayHit | None:
        """The first hit of a ray.

        Parameters
        ----------
        origin : three numbers
            [m].
        direction : three numbers
            Of any length but 0.
        max_distance : float
            [m], >= 0.
        filter : function, optional
            Selects bodies.
        """
        hit = self._core.cast_ray(_arrays.triple(origin, "origin"),
                                  _arrays.triple(direction, "direction"),
                                  _arrays.number(max_distance, "max_distance"), _of_body(filter))
        return None if hit is None else RayHit(BodyId(*hit[0]), *hit[1:])

    def cast_ray_through(self, origin: Vector, direction: Vector, max_distance: float = math.inf,
                         *, filter: Callable[[BodyId], bool] | None = None) -> list[RayHit]:
        """All hits of a ray, sorted by distance; one hit per body."""
        hits = self._core.cast_ray_through(_arrays.triple(origin, "origin"),
                                           _arrays.triple(direction, "direction"),
                                           _arrays.number(max_distance, "max_distance"),
                                           _of_body(filter))
        return [RayHit(BodyId(*hit[0]), *hit[1:]) for hit in hits]

    def cast_rays(self, origins: Any, directions: Any, max_distances: Any = math.inf) -> RayHits:
        """The first hits of many rays: arrays (R, 3), and a number or an array (R,)."""
        origins = _arrays.rows(origins, "origins", 3, self._dtype)
        directions = _arrays.rows(directions, "directions", 3, self._dtype)
        size = origins.shape[0]
        if directions.shape[0] != size:
            raise InvalidArgument(f"directions has {directions.shape[0]} rows; origins has {size}")
        result = RayHits(np.empty(size, np.int64), self._values(size), self._rows(size),
                         self._rows(size))
        limits = _arrays.vector(max_distances, "max_distances", size, self._dtype)
        self._core.cast_rays(origins, directions, limits, *result)
        return result

    def overlapping_sphere(self, centre: Vector, radius: float) -> list[BodyId]:
        """Bodies that overlap a sphere; lengths in [m]."""
        found = self._core.overlapping_sphere(_arrays.number(radius, "radius"),
                                              _arrays.triple(centre, "centre"))
        return [BodyId(*body) for body in found]

    def overlapping_box(self, centre: Vector, half_extents: Vector,
                        orientation: Sequence[float] = (1.0, 0.0, 0.0, 0.0)) -> list[BodyId]:
        """Bodies that overlap a box; lengths in [m]."""
        found = self._core.overlapping_box(_arrays.triple(half_extents, "half_extents"),
                                           _arrays.triple(centre, "centre"),
                                           _arrays.triple(orientation, "orientation", 4))
        return [BodyId(*body) for body in found]

    def _rows(self, size: int) -> np.ndarray:
        return np.empty((size, 3), self._dtype)

    def _values(self, size: int) -> np.ndarray:
        return np.empty(size, self._dtype)

    def __repr__(self) -> str:
        return f"<jfpx.World: {len(self)} bodies at {self.time:g} s, {self._dtype}>"


def _call(force: Callable[[ForceContext], Any], dtype: Any, context: Any) -> None:
    force(ForceContext(context, dtype))


def _of_body(filter: Callable[[BodyId], bool] | None) -> Any:
    return None if filter is None else lambda body: bool(filter(BodyId(*body)))

"""Worlds of rigid bodies."""

from __future__ import annotations

import functools
import json
import math
import os
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from . import _arrays, _device, mpi
from ._character import CharacterHit, CharacterMove, CharacterSettings, CharacterState
from ._errors import Closed, ConcurrentUse, InvalidArgument, InvalidScene
from ._contact_generators import ContactContext
from ._forces import BodyId, BodyState, ForceContext, States, Vector
from ._joints import Joint, JointId, JointState, arguments, joint_of
from ._scene import Scene, no_gravity
from ._view import View, view_of_world

_GROUND_STATES = ("air", "ground", "steep")  # in the order of GroundState of C++


class StepReport(NamedTuple):
    """Result of a step. Times are wall-clock times in milliseconds.

    Attributes
    ----------
    step : int
        Number of completed steps, without undone ones.
    contacts : int
        Contacts that were found, including those of sensors.
    sphere_contacts : int
        Of these, contacts between two spheres.
    generated_contacts : int
        Contacts of contact generators, not included in `contacts`.
    position_iterations : int
        Corrections of positions by the solver worst_first.
    velocity_iterations : int
        Corrections of velocities by the solver worst_first.
    iterations_exhausted : bool
        A loop of the solver stopped at its limit with work left.
    non_finite : bool
        A value of a body is no longer finite, or a coordinate exceeds 1e9 m. The step was undone,
        and so are further ones until the body is removed or gets another state.
    non_finite_body : BodyId or None
        The first such body.
    awake : int
        Movable bodies that are awake after the step.
    backend : str
        "cpu" or "cuda": device of the step, or that found the sphere contacts of a step on the CPU.
    algorithm : str
        Algorithm that found the sphere contacts: "all pairs" or "grid"; "automatic" in a
        step on a GPU.
    choice : str
        Reason for backend and algorithm, as SphereCollider.reason.
    device_failure : str
        Error of a GPU whose work the CPU took over; empty if there was none.
    integrate_ms : float
        Forces and, with the solver worst_first, integration.
    detect_ms : float
        Search for contacts.
    resolve_ms : float
        All other stages. In a step on a GPU, these three are times of the GPU.
    total_ms : float
        The whole step.
    """

    step: int
    contacts: int
    sphere_contacts: int
    generated_contacts: int
    position_iterations: int
    velocity_iterations: int
    iterations_exhausted: bool
    non_finite: bool
    non_finite_body: BodyId | None
    awake: int
    backend: str
    algorithm: str
    choice: str
    device_failure: str
    integrate_ms: float
    detect_ms: float
    resolve_ms: float
    total_ms: float


class WorldContacts(NamedTuple):
    """The E contact points of the last step, in the dtype of the world. Their order is the same on
    all backends.

    Attributes
    ----------
    pairs : array (2, E) of int64
        BodyId.index of a and b. It is not the row of World.states() once a body was removed: the
        row of a body is np.searchsorted(indices, index), with indices = [body.index for body in
        world.bodies].
    normal : array (E, 3)
        Unit vectors from b to a.
    point : array (E, 3)
        [m], in the axes of the world: the middle of the overlap, or a point of b if the bodies met
        in the step.
    distance : array (E,)
        [m]: 0, or negative where the bodies overlap; 0 if they met in the step.
    friction : array (E,)
        Friction coefficient of the pair, >= 0.
    restitution : array (E,)
        Coefficient of restitution of the pair, in [0, 1].
    sensor : array (E,) of bool
        Whether a or b is a sensor.
    """

    pairs: np.ndarray
    normal: np.ndarray
    point: np.ndarray
    distance: np.ndarray
    friction: np.ndarray
    restitution: np.ndarray
    sensor: np.ndarray


class ContactForces(NamedTuple):
    """Forces of E contact points: their mean over the last substep of a step, in the dtype of the
    world. A point that pushed in the step but not in its last substep, as in a rebound, has none.

    Attributes
    ----------
    pairs : array (2, E) of int64
        BodyId.index of a and b, as in WorldContacts.
    normal : array (E, 3)
        Unit vectors from b to a.
    arm_a : array (E, 3)
        [m], in the axes of the world: from the centre of mass of a to the point.
    arm_b : array (E, 3)
        [m]: from the centre of mass of b to the point.
    force : array (E, 3)
        [N], in the axes of the world: on a at the point, of normal force and friction; b has the
        opposite force.
    torque : array (E, 3)
        [N m]: on a in addition to that of the force, of rolling and spinning friction.
    parts : array (2, E) of int64
        Of a and b, as in RayHit; 0 for contacts of contact generators.
    """

    pairs: np.ndarray
    normal: np.ndarray
    arm_a: np.ndarray
    arm_b: np.ndarray
    force: np.ndarray
    torque: np.ndarray
    parts: np.ndarray


BEGIN, STAY, END = 0, 1, 2
"""Values of ContactEvents.phase."""


class HitEvents(NamedTuple):
    """Pairs of bodies that hit each other in the last step: they pushed each other apart, and
    approached with at least the `hit_speed` of the world before. Sorted by (pairs[0], pairs[1]).
    Floating-point arrays have the dtype of the world.

    Attributes
    ----------
    pairs : array (2, H) of int64
        BodyId.index of a and b, a < b, as in WorldContacts. The bodies may have been removed.
    normal : array (H, 3)
        Unit vectors from b to a, at the fastest points of the contacts.
    point : array (H, 3)
        The fastest points [m] at the start of the step, in the axes of the world.
    approach_speed : array (H,)
        [m/s], > 0, of these points along the normals, at the start of the step.
    parts : array (2, H) of int64
        Of a and b, as in RayHit.
    """

    pairs: np.ndarray
    normal: np.ndarray
    point: np.ndarray
    approach_speed: np.ndarray
    parts: np.ndarray


class ContactEvents(NamedTuple):
    """Pairs of bodies that began to touch, stay in contact or ceased to touch in the last step,
    sorted by (pairs[0], pairs[1]). Floating-point arrays have the dtype of the world.

    Attributes
    ----------
    phase : array (E,) of int64
        BEGIN, STAY or END.
    pairs : array (2, E) of int64
        BodyId.index of a and b, a < b, as in WorldContacts. Bodies of END may have been removed.
    contacts : array (E,) of int64
        Numbers of contact points, > 0.
    normal : array (E, 3)
        Unit vectors from b to a, at the deepest points.
    point : array (E, 3)
        The deepest points [m], in the axes of the world.
    distance : array (E,)
        [m], <= 0, at the deepest points.
    """

    phase: np.ndarray
    pairs: np.ndarray
    contacts: np.ndarray
    normal: np.ndarray
    point: np.ndarray
    distance: np.ndarray


class RayHit(NamedTuple):
    """Point where a ray enters a body. A ray that starts in a body, or on its surface, hits it at
    distance 0 with a normal opposite to the ray.

    Attributes
    ----------
    body : BodyId
        The body that is hit.
    distance : float
        [m], >= 0, from the origin of the ray.
    point : three numbers
        [m], in the axes of the world.
    normal : three numbers
        Unit vector, outwards.
    part : int
        Number of the part in the "parts" of a compound, of the triangle of a mesh, or of the
        triangle of a heightfield, as in HeightfieldDef; 0 for other shapes.
    """

    body: BodyId
    distance: float
    point: tuple[float, ...]
    normal: tuple[float, ...]
    part: int


class RayHits(NamedTuple):
    """First hits of R rays. Floating-point arrays have the dtype of the world.

    Attributes
    ----------
    bodies : array (R,) of int64
        BodyId.index, as in WorldContacts; -1: no hit.
    distance : array (R,)
        [m], >= 0; infinity: no hit.
    point : array (R, 3)
        [m]; zero: no hit.
    normal : array (R, 3)
        Unit vectors, outwards; zero: no hit.
    part : array (R,) of int64
        As in RayHit; 0 also where `bodies` is -1.
    """

    bodies: np.ndarray
    distance: np.ndarray
    point: np.ndarray
    normal: np.ndarray
    part: np.ndarray


class ShapeHit(NamedTuple):
    """Where a moving solid first touches a body. A solid that overlaps the body at the start has the
    fraction 0, and the point, the normal and the distance of the deepest contact.

    Attributes
    ----------
    body : BodyId
        The body that is hit.
    fraction : float
        Of the translation, in [0, 1].
    point : three numbers
        [m], in the axes of the world.
    normal : three numbers
        Unit vector, from the body to the solid.
    distance : float
        [m], <= 0: negative depth of an overlap at the start; otherwise 0.
    part : int
        Of the body, as in RayHit.
    """

    body: BodyId
    fraction: float
    point: tuple[float, ...]
    normal: tuple[float, ...]
    distance: float
    part: int


class ShapeHits(NamedTuple):
    """First hits of C casts of a solid. Floating-point arrays have the dtype of the world.

    Attributes
    ----------
    bodies : array (C,) of int64
        BodyId.index, as in WorldContacts; -1: no hit.
    fraction : array (C,)
        Of the translation, in [0, 1]; infinity: no hit.
    point : array (C, 3)
        [m]; zero: no hit.
    normal : array (C, 3)
        Unit vectors, from the body to the solid; zero: no hit.
    distance : array (C,)
        [m], <= 0: negative depth of an overlap at the start; otherwise 0.
    part : array (C,) of int64
        As in RayHit; 0 also where `bodies` is -1.
    """

    bodies: np.ndarray
    fraction: np.ndarray
    point: np.ndarray
    normal: np.ndarray
    distance: np.ndarray
    part: np.ndarray


class BodyDistance(NamedTuple):
    """The closest points of a body and a point or a solid: query_point = point + normal * distance.

    Attributes
    ----------
    body : BodyId
        The body.
    distance : float
        [m]; of an overlap < 0: negative depth.
    point : three numbers
        [m], in the axes of the world, of the surface of the body.
    query_point : three numbers
        [m], of the surface of the solid, or the point.
    normal : three numbers
        Unit vector, from the body to the solid.
    part : int
        Of the body, as in RayHit.
    """

    body: BodyId
    distance: float
    point: tuple[float, ...]
    query_point: tuple[float, ...]
    normal: tuple[float, ...]
    part: int


class BodyDistances(NamedTuple):
    """The closest bodies of Q points or solids. Floating-point arrays have the dtype of the world.

    Attributes
    ----------
    bodies : array (Q,) of int64
        BodyId.index, as in WorldContacts; -1: there is no body.
    distance : array (Q,)
        [m]; of an overlap < 0: negative depth; infinity: no body.
    point : array (Q, 3)
        [m], of the surfaces of the bodies; zero: no body.
    query_point : array (Q, 3)
        [m], of the surfaces of the solids; zero: no body.
    normal : array (Q, 3)
        Unit vectors, from the body to the solid; zero: no body.
    part : array (Q,) of int64
        As in RayHit; 0 also where `bodies` is -1.
    """

    bodies: np.ndarray
    distance: np.ndarray
    point: np.ndarray
    query_point: np.ndarray
    normal: np.ndarray
    part: np.ndarray


class DebugLines(NamedTuple):
    """L lines of World.debug_lines().

    Attributes
    ----------
    lines : array (L, 2, 3)
        [m], both ends of each line, in the dtype of the world.
    colors : array (L, 3) of uint8
        Red, green and blue.
    """

    lines: np.ndarray
    colors: np.ndarray


class World:
    """Rigid bodies and their motion. The states after a step are the same to the last bit for every
    backend, algorithm and number of threads.

    One thread may use a world at a time: while step() or run() of one thread works, without
    Python's global lock, every call of another raises ConcurrentUse, and so does every call by a
    force of the world. After close(), every call but close() raises Closed. `dtype` and `report`
    raise nothing.

    Any call may raise OutOfMemory. If the states are on a GPU, a call that reads states or contacts
    or that changes the world may raise DeviceError. The docstrings of the methods contain the other
    exceptions. There, a body is unknown if its id is not of a living body of this world.

    Parameters
    ----------
    scene : Scene, dict or str
        A scene, its fields, or the name of a scene.
    dtype : "float32" or "float64", optional
        Precision, where `scene` is not a Scene: "float32" if absent. Otherwise it must be that of
        the scene.
    backend : "auto", "cpu" or "cuda"
        Device of the steps. With the solver soft_step, "cuda" makes all parts of a step on the GPU,
        and "auto" moves the world there and back, whichever takes less time. With the solver
        worst_first, only the search for contacts can use the GPU.
    algorithm, device
        As for SphereCollider.
    devices : sequence of int, optional
        Numbers of the GPUs that share the world, at most 8, as in available_gpus(), instead of
        `device`. The backend "auto" is then "cuda", the solver is soft_step, and the GPUs must be
        linked. The bits do not depend on them.
    threads : int in [0, 256]
        Number of threads of the CPU; 0: one per core.
    hit_speed : float
        [m/s], > 0: the least approach speed of hit_events(), for example 1. Infinity: there are no
        hit events.
    communicator : mpi4py.MPI.Intracomm, jfpx.mpi.Communicator or a similar object, optional
        The processes that hold the world together, each with a World of the same scene. All of them
        make the same calls of it in the same order, with the same arguments, also those that only
        read, and get the same results as without a communicator, to the last bit. The solver is
        soft_step and the backend the CPU. An exception on one rank leaves the others waiting: `python
        -m mpi4py program.py` then ends all of them. Of a communicator of mpi4py, a duplicate is
        used, which close() frees on all ranks; see jfpx.mpi for other objects. A copy of the world,
        by pickle or copy.deepcopy(), has no communicator.

    Raises
    ------
    InvalidScene
        A field of `scene` is unknown or out of range.
    InvalidArgument
        An option is out of its range, there is no scene of this name, `scene` has another type, or
        `dtype` is not that of the scene. With several ranks, the backend is "cuda" or the solver
        worst_first. With `devices`, the backend is "cpu", the solver worst_first, or there are
        several ranks. `communicator` is of another type.
    BackendUnavailable
        The backend was requested by name, or by `devices`, and cannot be used.
    OutOfMemory, DeviceError
    """

    def __init__(self, scene: Scene | dict[str, Any] | str, *, dtype: Any = None,
                 backend: str = "auto", algorithm: str = "auto", threads: int = 1,
                 device: int = 0, devices: Sequence[int] = (), hit_speed: float = math.inf,
                 communicator: Any = None) -> None:
        if dtype is not None:
            _arrays.precision_of(dtype)
        if isinstance(scene, str):
            scene = Scene.named(scene, dtype=dtype or "float32")
        elif isinstance(scene, dict):
            scene = Scene(scene, dtype=dtype or "float32")
        elif not isinstance(scene, Scene):
            raise InvalidArgument(f"scene is {type(scene).__name__}; it must be a Scene, a dict "
                                  "or a name; Scene.load() reads a file")
        elif dtype is not None and np.dtype(dtype) != scene.dtype:
            raise InvalidArgument(f"dtype is {dtype}; that of the scene is {scene.dtype}")
        self._dtype = scene.dtype
        options = _arrays.options(backend, algorithm, threads, device)
        devices = _arrays.device_numbers(devices)
        hit_speed = _arrays.number(hit_speed, "hit_speed")
        ranks = mpi.communicator_of(communicator)
        self._core = _arrays.precision_of(self._dtype).World(scene._scene, *options, devices, hit_speed, *ranks)
        self._duplicate = None if ranks[0] is communicator else ranks[0]  # is freed with the world
        self._options = {"backend": backend, "algorithm": algorithm, "threads": threads, "device": device,
                         "devices": devices, "hit_speed": hit_speed}
        self._device = devices[0] if devices else device
        self._report: StepReport | None = None
        self._followers: list[Callable[[], None]] = []  # called after each step

    def __reduce__(self) -> Any:
        """The scene, the options and a snapshot: pickle and copy.deepcopy() make a world that
        continues with the same bits, without a communicator. A world with functions as forces cannot
        be copied: the copy raises InvalidSnapshot."""
        scene = self.scene
        try:
            scene.to_json()
        except InvalidScene:  # restore() has replaced the solver by one for which the joints are invalid
            scene = Scene({"bodies": []}, dtype=self._dtype)
        return _restored, (type(self), scene, self._options, self.snapshot())

    # Steps

    def step(self) -> StepReport:
        """Advances the world by the dt of its scene. A step in which a value is no longer finite
        raises nothing: the step is undone, and StepReport.non_finite is set.

        Raises
        ------
        Exception
            An exception of a force or contact generator that is a function. It undoes the step. With several ranks, also
            one of the communicator, which leaves them in different states.
        OutOfMemory, DeviceError
            The state is then as before the step.
        ConcurrentUse, Closed
        """
        self._report = _report(self._core.step())
        for follower in self._followers:
            follower()
        return self._report

    def run(self, steps: int, *, after_step: Callable[[StepReport], Any] | None = None) -> StepReport:
        """Makes many steps, and returns the report of the last.

        If a body runs away, nothing is raised: the run stops early, before the step in which a
        value is no longer finite, and the report has `non_finite` and `non_finite_body`.

        Parameters
        ----------
        steps : int in [1, 2^63 - 1]
            Number of steps.
        after_step : function, optional
            Called with the report of every step. It may use the world. An exception ends the run.

        Raises
        ------
        InvalidArgument
            `steps` is not an integer or is out of its range.
        KeyboardInterrupt
            Ctrl-C was pressed. It ends the run between two steps.
        OutOfMemory, DeviceError, ConcurrentUse, Closed, and exceptions of forces
            As step(). The steps before are kept.
        """
        steps = _arrays.count(steps, "steps", 1, 2**63 - 1)
        if after_step is None and not self._followers:
            self._report = _report(self._core.run(steps))
            return self._report
        if after_step is not None:
            _arrays.function(after_step, "after_step")
        for _ in range(steps):
            report = self.step()
            if after_step is not None:
                after_step(report)
            if report.non_finite:
                break
        return report

    def enqueue_steps(self, count: int, stream: Any = None) -> None:
        """Enqueues steps on the GPU, after earlier work of a stream and before its later work, and
        returns without waiting. The states are those of step(), to the last bit. Arrays of
        device_states() stay valid, and change in place.

        If a contact list is full, a body runs away or a force must wake a body, the GPU leaves this
        step and all later ones to the host. The arrays on the GPU then have older states, until
        finish_steps() or any call that reads or changes the world, which make these steps. Copies
        that later work of the stream or of a graph has made keep the older states. With functions
        as forces, the host makes the steps at once; a world that sleeps needs none.

        While the stream is being captured, the steps become part of its CUDA graph. The world must
        then have made a step on the GPU, and `device_version` must have been read after the last
        change; the graph is valid as long as that has the same value.

        Parameters
        ----------
        count : int in [0, 2^32 - 1]
            Number of steps.
        stream : optional
            A stream of PyTorch or CuPy, an object with `__cuda_stream__()`, or the address of a
            CUDA stream. None: the current stream of PyTorch, if that uses a GPU, or of CuPy,
            otherwise the default stream.

        Raises
        ------
        InvalidArgument
            An argument is out of its range, or the stream is being captured and the world needs the
            host for its steps.
        BackendUnavailable
            As device_states().
        OutOfMemory, DeviceError, ConcurrentUse, Closed
        """
        self._core.enqueue_steps(_arrays.count(count, "count", 0, 2**32 - 1),
                                 _device.stream_address(stream, self._device))

    def finish_steps(self) -> StepReport:
        """Waits for all steps of enqueue_steps() and of graphs, makes those that the GPU has left
        to the host, and returns the report of the last, without times of the stages.

        Raises
        ------
        OutOfMemory, DeviceError, ConcurrentUse, Closed
        """
        self._report = _report(self._core.finish_steps())
        return self._report

    @property
    def device_version(self) -> int:
        """A number that changes when a captured graph of steps becomes invalid: when bodies or
        forces are added or removed, when the world moves to the host, and when lists of contacts
        need more memory. Sends changes of the world to the GPU. Raises as device_states()."""
        return self._core.device_version()

    @property
    def report(self) -> StepReport | None:
        """Report of the last step(), run() or finish_steps() that returned; None before the
        first."""
        return self._report

    @property
    def dtype(self) -> np.dtype:
        """Type of all floating-point arrays: float32 or float64."""
        return self._dtype

    @property
    def time(self) -> float:
        """Number of completed steps times dt [s]."""
        return self._core.time()

    @property
    def scene(self) -> Scene:
        """A copy of the scene of which the world was made. restore() replaces its name and its
        settings, but not its bodies."""
        return Scene._of(self._core.scene(), self._dtype)

    def state_hash(self) -> int:
        """Hash of all states, in [0, 2^64 - 1]: equal hashes mean equal states to the last bit.
        Worlds of float32 and float64 have different hashes. Raises DeviceError."""
        return self._core.state_hash()

    def snapshot(self) -> bytes:
        """All that the following steps depend on, except for Python functions, as bytes. Equal
        states have equal bytes, on all backends. Raises OutOfMemory, DeviceError."""
        return self._core.snapshot()

    def restore(self, snapshot: Any) -> None:
        """Replaces the state by that of a snapshot of this or of another world of the same dtype.
        The following steps are those that the other world would have made, to the last bit. The ids
        of bodies and the contacts are those of the snapshot; contact_events() has none until the
        next step. If the snapshot was taken of a world with Python functions as forces or
        contact generators, add the same functions first, so that they have the same numbers.

        Raises
        ------
        InvalidSnapshot
            The bytes are damaged, or of another version or dtype, or the world has other functions
            as forces or contact generators. The world is then unchanged.
        InvalidArgument
            `snapshot` is neither bytes nor an object with a buffer, such as a memoryview.
        OutOfMemory
            The world is then unchanged.
        DeviceError
        """
        if not isinstance(snapshot, bytes):
            try:
                snapshot = bytes(memoryview(snapshot))
            except TypeError:
                raise InvalidArgument(f"snapshot is of type {type(snapshot).__name__}; it must be bytes, or "
                                      "an object with a buffer") from None
        self._core.restore(snapshot)

    def close(self) -> None:
        """Frees the world now. Later calls raise Closed. Also at the end of a `with` statement.
        Raises ConcurrentUse during a step. With several ranks, all of them close the world."""
        self._core.close()
        if self._duplicate is not None:
            self._duplicate.close()

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
        """Living bodies in the order of their indices, as a new list."""
        return [BodyId(*body) for body in self._core.bodies()]

    def body_at(self, index: int) -> BodyId:
        """The living body with an index in [0, 2^32 - 1]. Raises InvalidArgument if there is
        none."""
        return BodyId(*self._core.body_at(_arrays.count(index, "index", 0, 2**32 - 1)))

    def __contains__(self, body: BodyId) -> bool:
        """Whether the id is of a living body of this world. Raises InvalidArgument if it is no
        id."""
        return self._core.contains(_arrays.body(body))

    def add(self, body: dict[str, Any]) -> BodyId:
        """Adds a body, with the fields of a body in a Scene, and returns its id.
        contacts() has none until the next step. Raises InvalidScene for a field that is unknown or
        out of range; the world is then unchanged."""
        return self.add_scene(Scene({"bodies": [body]}, dtype=self._dtype))[0]

    def add_scene(self, scene: Scene) -> list[BodyId]:
        """Adds the bodies of a scene, and returns their ids in its order; its settings and its
        ignored pairs have no effect. Raises InvalidArgument if the dtype of the scene is not that
        of the world."""
        _arrays.instance(scene, "scene", Scene, ", such as Scene({...})")
        if scene.dtype != self._dtype:
            raise InvalidArgument(f"the scene has dtype {scene.dtype}; the world has {self._dtype}")
        return [BodyId(*body) for body in self._core.add(scene._scene)]

    def add_spheres(self, positions: Any, radii: Any, *, masses: Any = 1.0,
                    velocities: Any = (0.0, 0.0, 0.0), acceleration: Any = (0.0, -9.81, 0.0),
                    friction: Any = 0.5, restitution: Any = 0.0) -> list[BodyId]:
        """Adds a movable sphere for each row of an array, and returns their ids in this order.
        Parameters and exceptions are those of Scene.add_spheres(). If one of the spheres is invalid,
        the world is unchanged."""
        scene = Scene(dtype=self._dtype)
        scene.add_spheres(positions, radii, masses=masses, velocities=velocities, acceleration=acceleration,
                          friction=friction, restitution=restitution)
        return self.add_scene(scene)

    def remove(self, body: BodyId) -> None:
        """Removes a body and wakes the bodies in contact with it. contacts() has none until the
        next step. Raises InvalidArgument for an unknown body."""
        self._core.remove(_arrays.body(body))

    def definition(self, body: BodyId) -> dict[str, Any]:
        """Returns all fields of a body in its current state, in the form that add() and replace()
        take. Raises InvalidArgument for an unknown body."""
        return dict(json.loads(self._core.definition(_arrays.body(body)).to_json())["bodies"][0])

    def replace(self, body: BodyId, definition: dict[str, Any]) -> None:
        """Gives a body another definition, with the fields of a body in a Scene: another shape, a
        mass of 0 instead of a mass, or any other fields. Its id, its joints and its ignored pairs
        remain; its contacts end, and contacts() has none until the next step. Wakes the body and
        the bodies in contact with it::

            fields = world.definition(body)
            world.replace(body, fields | {"shape": {"type": "sphere", "radius": 2}})

        Raises InvalidArgument for an unknown body, or if a joint would have no movable body, and
        InvalidScene for a field that is unknown or out of range; the world is then unchanged."""
        scene = Scene({"bodies": [definition]}, dtype=self._dtype)
        self._core.replace(_arrays.body(body), scene._scene)

    def states(self) -> States:
        """States of all bodies as new arrays (N, 3) and (N, 4) of the dtype of the world, in the
        order of `bodies`. Raises OutOfMemory, DeviceError."""
        states = States.empty(len(self), self._dtype)
        self._core.write_states(*states)
        return states

    def save_states(self, path: str | os.PathLike[str]) -> None:
        """Writes the states to a file for ``numpy.load(path, mmap_mode="r")``: an array (N,) of
        records in the order of `bodies`, with the fields index and generation (BodyId), position
        [m], orientation (w, x, y, z), velocity [m/s] and angular_velocity [rad/s]. Several ranks
        write one file together, on a file system that they share, without collecting the states.
        The path has the complete file or is unchanged. Raises FileError, DeviceError, OutOfMemory."""
        self._core.save_states(_arrays.path(path))

    def device_states(self) -> States:
        """States in the memory of the GPU that makes the steps, without a copy: other libraries
        read them with their `from_dlpack()`, and jfpx takes them as they are.

        Row i is that of the body with BodyId.index i; rows of removed bodies have no meaning. The
        arrays must not be written. step(), run() and changes of the world wait for all work of the
        GPU that may still read the arrays. Afterwards the arrays are not valid: call device_states()
        again. Steps of enqueue_steps() and of graphs, and finish_steps(),
        change the arrays in place, and they stay valid as long as `device_version` is the same. The
        first call after a change copies the world to the GPU.

        Returns
        -------
        States
            Arrays (M, 3) and (M, 4) of the dtype of the world, M > the largest BodyId.index. They
            can be read by other libraries only, and have a `shape`. `__dlpack__()` raises
            InvalidArgument if they are no longer valid, and BufferError if a copy is requested.

        Raises
        ------
        BackendUnavailable
            No GPU steps the world. It needs the solver soft_step and backend="cuda"; "auto"
            suffices from the step on that has started the GPU. The message has the reason.
        OutOfMemory, DeviceError
            The world is then unchanged.
        """
        return States(*self._core.device_states())

    def set_states(self, states: States) -> None:
        """Replaces the states of all bodies, or of none if one is invalid. Wakes the bodies.

        Parameters
        ----------
        states : States
            Arrays in host memory or lists, which are converted to the dtype of the world, with a
            row for each body in the order of `bodies`: positions (N, 3) [m], each coordinate in
            [-1e9, 1e9]; orientations (N, 4), unit quaternions (w, x, y, z) to a thousandth of the
            squared length, which are normalized; velocities (N, 3) [m/s] and angular_velocities (N,
            3) [rad/s], finite.

        Raises
        ------
        InvalidArgument
            A wrong shape or type, or a value out of its range.
        OutOfMemory, DeviceError
        """
        if not isinstance(states, (tuple, list)) or len(states) != len(States._fields):
            raise InvalidArgument("states is not a States, such as that of World.states()")
        size = len(self)
        arrays = []
        for name, array, columns in zip(States._fields, states, (3, 4, 3, 3)):
            array = _arrays.rows(_arrays.converted(array, name, self._dtype), name, columns)
            if array.shape[0] != size:
                raise InvalidArgument(f"{name} has {array.shape[0]} rows; it must have one for "
                                      f"each of {size} bodies")
            arrays.append(array)
        self._core.set_states(*arrays)

    @property
    def positions(self) -> np.ndarray:
        """A copy of the positions of all bodies [m], (N, 3), in the order of `bodies`. Raises
        OutOfMemory, DeviceError."""
        return self.states().positions

    @property
    def velocities(self) -> np.ndarray:
        """A copy of the velocities of all bodies [m/s], (N, 3), in the order of `bodies`. Raises
        OutOfMemory, DeviceError."""
        return self.states().velocities

    def state(self, body: BodyId) -> BodyState:
        """State of a body. Raises InvalidArgument for an unknown body, DeviceError."""
        return BodyState(*self._core.state(_arrays.body(body)))

    def set_state(self, body: BodyId, state: BodyState) -> None:
        """Replaces the state of a body, and wakes it and the bodies in contact with it. An
        immovable body is moved and stays at rest; a kinematic body continues with the new
        velocities.

        Parameters
        ----------
        body : BodyId
        state : BodyState
            position [m], each coordinate in [-1e9, 1e9]; orientation, a unit quaternion
            (w, x, y, z) to a thousandth of the squared length, which is normalized; velocity [m/s]
            and angular_velocity [rad/s], finite.

        Raises
        ------
        InvalidArgument
            An unknown body, or a value out of its range.
        DeviceError
        """
        try:
            state = BodyState(*state)
        except TypeError:
            raise InvalidArgument(f"state is {state!r}; it must be a BodyState") from None
        self._core.set_state(_arrays.body(body), _arrays.triple(state.position, "position"),
                             _arrays.triple(state.orientation, "orientation", 4),
                             _arrays.triple(state.velocity, "velocity"),
                             _arrays.triple(state.angular_velocity, "angular_velocity"))

    def moving_to(self, body: BodyId, position: Vector,
                  orientation: Vector | None = None) -> BodyState:
        """The state of a body with the velocities that take it to a pose in one step, along the
        shorter arc: to be passed to set_state() before each step of the path of a kinematic body.
        Velocities remain until they are changed, so set them to 0 at the end of the path.

        Parameters
        ----------
        body : BodyId
        position : three numbers
            [m], each in [-1e9, 1e9].
        orientation : four numbers, optional
            Unit quaternion (w, x, y, z), to a thousandth of the squared length; None: the
            orientation does not change.

        Raises
        ------
        InvalidArgument
            An unknown body, or a value out of its range.
        DeviceError
        """
        if orientation is None:
            orientation = self.state(body).orientation
        return BodyState(*self._core.moving_to(_arrays.body(body),
                                               _arrays.triple(position, "position"),
                                               _arrays.triple(orientation, "orientation", 4)))

    def awake(self, body: BodyId) -> bool:
        """Whether a body is awake. A body of mass 0 is awake only if it is kinematic and moves.
        Raises InvalidArgument for an unknown body, DeviceError."""
        return self._core.awake(_arrays.body(body))

    def wake(self, body: BodyId) -> None:
        """Wakes a body; has no effect on one of mass 0. The next step also wakes the bodies in
        contact with it. Raises InvalidArgument for an unknown body."""
        self._core.wake(_arrays.body(body))

    def mass(self, body: BodyId) -> float:
        """Returns the mass of a body [kg], >= 0; 0: immovable or kinematic. Raises InvalidArgument
        for an unknown body."""
        return self._core.mass(_arrays.body(body))

    def set_mass(self, body: BodyId, mass: float) -> None:
        """Sets the mass of a body [kg], finite and > 0; a mass of 0 remains 0. The inertia changes
        in proportion, unless it was given. Wakes the body. Raises InvalidArgument for an unknown
        body or a mass out of range."""
        self._core.set_mass(_arrays.body(body), _arrays.number(mass, "mass"))

    def friction(self, body: BodyId) -> float:
        """Returns the friction coefficient of a body, >= 0. Raises InvalidArgument for an unknown
        body."""
        return self._core.friction(_arrays.body(body))

    def set_friction(self, body: BodyId, friction: float) -> None:
        """Sets the friction coefficient of a body, finite and >= 0, from the next step on. A change
        wakes the body and the bodies in contact with it. Raises InvalidArgument for an unknown body
        or a value out of range."""
        self._core.set_friction(_arrays.body(body), _arrays.number(friction, "friction"))

    def restitution(self, body: BodyId) -> float:
        """Returns the coefficient of restitution of a body, in [0, 1]. Raises InvalidArgument for
        an unknown body."""
        return self._core.restitution(_arrays.body(body))

    def set_restitution(self, body: BodyId, restitution: float) -> None:
        """Sets the coefficient of restitution of a body, in [0, 1], from the next step on. Raises
        InvalidArgument for an unknown body or a value out of range."""
        self._core.set_restitution(_arrays.body(body), _arrays.number(restitution, "restitution"))

    @property
    def gravity(self) -> Any:
        """Raises AttributeError, also if it is set: each body has its own `acceleration`."""
        raise no_gravity()

    @gravity.setter
    def gravity(self, value: Any) -> None:
        raise no_gravity()

    def acceleration(self, body: BodyId) -> tuple[float, ...]:
        """Returns the constant acceleration of a body [m/s^2], three numbers; gravity by default.
        Raises InvalidArgument for an unknown body."""
        return self._core.acceleration(_arrays.body(body))

    def set_acceleration(self, body: BodyId, acceleration: Vector) -> None:
        """Sets the constant acceleration of a body [m/s^2], three finite numbers, from the next
        step on. A change wakes the body. Raises InvalidArgument for an unknown body or a value out
        of range."""
        self._core.set_acceleration(_arrays.body(body), _arrays.triple(acceleration, "acceleration"))

    def damping(self, body: BodyId) -> tuple[float, float]:
        """Returns the fractions of velocity and of angular velocity that a body keeps per second,
        each in (0, 1]. Raises InvalidArgument for an unknown body."""
        return self._core.damping(_arrays.body(body))

    def set_damping(self, body: BodyId, linear: float, angular: float) -> None:
        """Sets the fractions of velocity and of angular velocity that a body keeps per second, each
        in (0, 1], from the next step on. Raises InvalidArgument for an unknown body or a value out
        of range."""
        self._core.set_damping(_arrays.body(body), _arrays.number(linear, "linear"),
                               _arrays.number(angular, "angular"))

    def motion_locks(self, body: BodyId) -> tuple[tuple[bool, bool, bool], tuple[bool, bool, bool]]:
        """Returns the locked axes of a body, see set_motion_locks(): whether it does not move along
        the axes x, y and z of the world, and whether it does not rotate about them. Raises
        InvalidArgument for an unknown body."""
        return self._core.motion_locks(_arrays.body(body))

    def set_motion_locks(self, body: BodyId, linear: Sequence[bool] = (False, False, False),
                         angular: Sequence[bool] = (False, False, False)) -> None:
        """Locks axes of motion of a body: it moves neither along axes of `linear` nor about axes of
        `angular`, each x, y and z of the world, and its velocities along and about them become 0. A
        kinematic body keeps its velocities, which act on the bodies that touch it: a conveyor. A
        change wakes the body; has no effect on an immovable body. A character that does not fall over
        has ``angular=(True, True, True)``, a body of a game in two dimensions
        ``linear=(False, False, True), angular=(True, True, False)``. Raises InvalidArgument for an
        unknown body, and if the solver is worst_first."""
        self._core.set_motion_locks(_arrays.body(body), _arrays.flags(linear, "linear"),
                                    _arrays.flags(angular, "angular"))

    def sensor(self, body: BodyId) -> bool:
        """Whether a body is a sensor: it has contacts, but they are not resolved. Raises
        InvalidArgument for an unknown body."""
        return self._core.sensor(_arrays.body(body))

    def filter(self, body: BodyId) -> tuple[int, int]:
        """Returns category and mask of a body, see set_filter(). Raises InvalidArgument for an
        unknown body."""
        return self._core.filter(_arrays.body(body))

    def set_filter(self, body: BodyId, category: int, mask: int) -> None:
        """Sets category and mask of a body. Two bodies collide if each has a category that is in
        the mask of the other. Both are bits in [0, 2^32 - 1]. A change wakes the body and the
        bodies in contact with it. Raises InvalidArgument for an unknown body or a value out of
        range."""
        self._core.set_filter(_arrays.body(body), _arrays.count(category, "category", 0, 2**32 - 1),
                              _arrays.count(mask, "mask", 0, 2**32 - 1))

    def pair_ignored(self, a: BodyId, b: BodyId) -> bool:
        """Whether two bodies do not collide, whatever their filters. Raises InvalidArgument for an
        unknown body."""
        return self._core.pair_ignored(_arrays.body(a, "a"), _arrays.body(b, "b"))

    def set_pair_ignored(self, a: BodyId, b: BodyId, ignored: bool) -> None:
        """Adds two bodies to the pairs that do not collide, or removes them. A change wakes both
        bodies and the bodies in contact with them. Raises InvalidArgument for an unknown body, and
        if both are the same body."""
        self._core.set_pair_ignored(_arrays.body(a, "a"), _arrays.body(b, "b"), bool(ignored))

    # Forces

    def apply_force(self, body: BodyId, force: Vector, point: Vector | None = None) -> None:
        """Applies a force [N] in world axes in the next step, at a point [m] of the world or at the
        centre of mass. Several calls add up. Wakes the body; has no effect on one of mass 0. Raises
        InvalidArgument for an unknown body or a value that is not finite."""
        force = _arrays.triple(force, "force")
        if point is None:
            self._core.apply_force(_arrays.body(body), force)
        else:
            self._core.apply_force_at_point(_arrays.body(body), force, _arrays.triple(point, "point"))

    def apply_torque(self, body: BodyId, torque: Vector) -> None:
        """Applies a torque [N m] in world axes in the next step. Several calls add up. Wakes the
        body; has no effect on one of mass 0. Raises InvalidArgument for an unknown body or a value
        that is not finite."""
        self._core.apply_torque(_arrays.body(body), _arrays.triple(torque, "torque"))

    def apply_impulse(self, body: BodyId, impulse: Vector, point: Vector | None = None) -> None:
        """Applies an impulse [N s] in world axes at a point [m] of the world or at the centre of
        mass: changes the velocities at once. Wakes the body; has no effect on one of mass 0. Raises
        InvalidArgument for an unknown body, a value that is not finite, or if a velocity would not
        be finite; the body is then unchanged."""
        impulse = _arrays.triple(impulse, "impulse")
        if point is None:
            self._core.apply_impulse(_arrays.body(body), impulse)
        else:
            self._core.apply_impulse_at_point(_arrays.body(body), impulse,
                                              _arrays.triple(point, "point"))

    def apply_angular_impulse(self, body: BodyId, impulse: Vector) -> None:
        """Applies an angular impulse [N m s] in world axes: changes the angular velocity at once.
        Wakes the body; has no effect on one of mass 0. Raises InvalidArgument as
        apply_impulse()."""
        self._core.apply_angular_impulse(_arrays.body(body), _arrays.triple(impulse, "impulse"))

    def add_force(self, force: Any) -> int:
        """Adds a force that acts in every step, and returns its number. Wakes all bodies.

        Parameters
        ----------
        force : Gravity, Drag, Spring, Bungee, Buoyancy, Explosion, or a function
            A function is called with a ForceContext at the start of every step. Calls in the same
            state must have the same result. It must not use the world. Its exceptions undo the
            step and are raised by step().

        Raises
        ------
        InvalidArgument
            A field is out of its range, a body is unknown, or `force` is neither a force of jfpx
            nor a function.
        """
        if isinstance(force, type) and hasattr(force, "_add"):
            raise InvalidArgument(f"force is the class {force.__name__}; it must be an object, "
                                  f"such as {force.__name__}(...)")
        if hasattr(force, "_add"):
            return force._add(self._core)
        if not callable(force):
            raise InvalidArgument(f"force is {type(force).__name__}; it must be a force of jfpx "
                                  "or a function")
        return self._core.add_function(functools.partial(_call, force, ForceContext, self._dtype))

    def add_joint(self, joint: Joint) -> JointId:
        """Adds a joint, which acts from the next step on, and wakes its bodies. Their contacts with
        each other end, unless the joint lets them collide. Joints are removed with their bodies.

        Parameters
        ----------
        joint : DistanceJoint, BallJoint, HingeJoint, SliderJoint, FixedJoint or WheelJoint
            place_joint() computes anchors and axes.

        Raises
        ------
        InvalidArgument
            A field is out of its range, a body is unknown, both bodies are the same or have mass 0,
            or the solver is worst_first.
        """
        return JointId(*self._core.add_joint(*arguments(joint)))

    def set_joint(self, joint_id: JointId, joint: Joint) -> None:
        """Replaces a joint by one of the same type and bodies, for example with another length, and
        wakes its bodies. Raises InvalidArgument as add_joint(), and for an unknown id."""
        self._core.set_joint(_arrays.joint(joint_id), *arguments(joint))

    def remove_joint(self, joint_id: JointId) -> None:
        """Removes a joint and wakes its bodies. Raises InvalidArgument for an unknown id."""
        self._core.remove_joint(_arrays.joint(joint_id))

    @property
    def joints(self) -> list[JointId]:
        """Joints in the order of their indices."""
        return [JointId(*joint_id) for joint_id in self._core.joints()]

    def joint(self, joint_id: JointId) -> Joint:
        """The definition of a joint. Raises InvalidArgument for an unknown id."""
        return joint_of(*self._core.joint(_arrays.joint(joint_id)))

    def joint_state(self, joint_id: JointId) -> JointState:
        """A joint after the last step. Raises InvalidArgument for an unknown id."""
        return JointState(*self._core.joint_state(_arrays.joint(joint_id)))

    def remove_force(self, number: int) -> None:
        """Removes the force with a number of add_force(), and wakes all bodies. Raises
        InvalidArgument for an unknown number."""
        self._core.remove_force(_arrays.count(number, "force", 0, 2**64 - 1))

    @property
    def forces(self) -> list[int]:
        """Numbers of the forces, in the order in which they act."""
        return self._core.forces()

    def add_contact_generator(self, generator: Callable[[ContactContext], Any]) -> int:
        """Adds a contact generator, and returns its number. Wakes all bodies. Steps of a world with
        contact generators run on the CPU.

        Parameters
        ----------
        generator : function
            Is called with a ContactContext in every step, after contact detection. It adds contacts,
            or changes those that were detected. Calls in the same state must have the same result.
            It must not use the world. Its exceptions undo the step and are raised by step().

        Raises
        ------
        InvalidArgument
            `generator` is not a function, or several ranks hold the world.
        """
        _arrays.function(generator, "generator")
        return self._core.add_contact_generator(
            functools.partial(_call, generator, ContactContext, self._dtype))

    def remove_contact_generator(self, number: int) -> None:
        """Removes the contact generator with a number of add_contact_generator(), and wakes all
        bodies. Raises InvalidArgument for an unknown number."""
        self._core.remove_contact_generator(_arrays.count(number, "contact generator", 0, 2**64 - 1))

    @property
    def contact_generators(self) -> list[int]:
        """Numbers of the contact generators, in the order in which they act."""
        return self._core.contact_generators()

    # Contacts and queries

    def contacts(self) -> WorldContacts:
        """Contact points of the last step, as new arrays. There are none before the first step,
        after an undone step, and after bodies were added or removed. The first call after a step
        makes the list. Raises OutOfMemory, DeviceError."""
        size = self._core.contact_count()
        result = WorldContacts(np.empty((2, size), np.int64), self._rows(size), self._rows(size),
                               self._values(size), self._values(size), self._values(size),
                               np.empty(size, bool))
        self._core.write_contacts(*result)
        return result

    def contact_events(self) -> ContactEvents:
        """Changes of the contacts in the last step, as new arrays. There are none before the first
        step and after an undone step. The contacts of a removed body end in the next step. Raises
        OutOfMemory, DeviceError."""
        size = self._core.event_count()
        result = ContactEvents(np.empty(size, np.int64), np.empty((2, size), np.int64),
                               np.empty(size, np.int64), self._rows(size), self._rows(size),
                               self._values(size))
        self._core.write_events(*result)
        return result

    def hit_events(self) -> HitEvents:
        """Pairs of bodies that hit each other in the last step, as new arrays; the `hit_speed` of
        the world is the least speed. There are none before the first step, after an undone step,
        after restore() until the next step, with the solver worst_first, and if `hit_speed` is
        infinite. Raises OutOfMemory, DeviceError."""
        size = self._core.hit_count()
        result = HitEvents(np.empty((2, size), np.int64), self._rows(size), self._rows(size),
                           self._values(size), np.empty((2, size), np.int64))
        self._core.write_hits(*result)
        return result

    def contact_forces(self) -> ContactForces:
        """Forces of the contact points that push at the end of the last step, as new arrays; they
        include those of sleeping bodies. There are none when contacts() has none, after restore()
        until the next step, and with the solver worst_first. The first call after a step makes the list. Raises OutOfMemory,
        DeviceError."""
        size = self._core.force_count()
        result = ContactForces(np.empty((2, size), np.int64), self._rows(size), self._rows(size),
                               self._rows(size), self._rows(size), self._rows(size),
                               np.empty((2, size), np.int64))
        self._core.write_forces(*result)
        return result

    def cast_ray(self, origin: Vector, direction: Vector, max_distance: float = math.inf, *,
                 filter: Callable[[BodyId], bool] | None = None) -> RayHit | None:
        """The first hit of a ray, or None; of bodies at the same distance, that with the lowest
        index. Rays hit all bodies, also sensors, whatever their collision filters.

        Parameters
        ----------
        origin : three numbers
            [m], each in [-1e9, 1e9].
        direction : three numbers
            Finite, of any length but 0.
        max_distance : float
            [m], >= 0; infinity is allowed.
        filter : function, optional
            Called with the BodyId of a body that the ray hits, at most once for each; the body
            counts if the result is true. It must not change the world.

        Raises
        ------
        InvalidArgument
            A number is out of its range.
        OutOfMemory, DeviceError, and exceptions of `filter`
        """
        hit = self._core.cast_ray(_arrays.triple(origin, "origin"),
                                  _arrays.triple(direction, "direction"),
                                  _arrays.number(max_distance, "max_distance"), _of_body(filter))
        return None if hit is None else RayHit(BodyId(*hit[0]), *hit[1:])

    def cast_ray_through(self, origin: Vector, direction: Vector, max_distance: float = math.inf,
                         *, filter: Callable[[BodyId], bool] | None = None) -> list[RayHit]:
        """All hits of a ray, sorted by distance, then by index; one hit per body. Parameters and
        exceptions are those of cast_ray()."""
        hits = self._core.cast_ray_through(_arrays.triple(origin, "origin"),
                                           _arrays.triple(direction, "direction"),
                                           _arrays.number(max_distance, "max_distance"),
                                           _of_body(filter))
        return [RayHit(BodyId(*hit[0]), *hit[1:]) for hit in hits]

    def cast_rays(self, origins: Any, directions: Any, max_distances: Any = math.inf) -> RayHits:
        """The first hits of many rays, as those of cast_ray(). Lists and arrays of other numbers
        are converted to the dtype of the world.

        Parameters
        ----------
        origins : array (R, 3)
            [m], each number in [-1e9, 1e9].
        directions : array (R, 3)
            Finite, of any length but 0.
        max_distances : number or array (R,)
            [m], >= 0; infinity is allowed.

        Raises
        ------
        InvalidArgument
            A wrong shape or type, or a number out of its range; the message then has the ray.
        OutOfMemory, DeviceError
        """
        origins, directions = (
            _arrays.rows(_arrays.converted(array, name, self._dtype), name, 3)
            for array, name in ((origins, "origins"), (directions, "directions")))
        size = origins.shape[0]
        if directions.shape[0] != size:
            raise InvalidArgument(f"directions has {directions.shape[0]} rows; origins has {size}")
        result = RayHits(np.empty(size, np.int64), self._values(size), self._rows(size),
                         self._rows(size), np.empty(size, np.int64))
        limits = _arrays.vector(_arrays.converted(max_distances, "max_distances", self._dtype),
                                "max_distances", size, self._dtype)
        self._core.cast_rays(origins, directions, limits, *result)
        return result

    def cast_shape(self, shape: dict[str, Any], position: Vector, translation: Vector,
                   orientation: Vector = (1.0, 0.0, 0.0, 0.0), *,
                   filter: Callable[[BodyId], bool] | None = None) -> ShapeHit | None:
        """The first body that a solid touches while it moves along a line without turning, or None;
        of bodies at the same fraction, that with the lowest index. Casts hit all bodies, also
        sensors, whatever their collision filters.

        Parameters
        ----------
        shape : dict
            A solid, as the field "shape" of a body in a Scene: {"type": "capsule", "radius": 0.3,
            "half_height": 0.6}.
        position : three numbers
            [m], of the origin of the shape, each in [-1e9, 1e9].
        translation : three numbers
            [m]; the end must be in [-1e9, 1e9], too. Zero finds overlaps only.
        orientation : four numbers
            Unit quaternion (w, x, y, z), to a thousandth of the squared length.
        filter : function, optional
            Called with the BodyId of a body that the solid hits, at most once for each; the body
            counts if the result is true. It must not change the world.

        Raises
        ------
        InvalidScene
            A field of `shape` is unknown, missing or out of its range.
        InvalidArgument
            Another number is out of its range, or `shape` is no solid.
        OutOfMemory, DeviceError, and exceptions of `filter`
        """
        hit = self._core.cast_shape(self._solid(shape), *_pose_and_translation(
            position, translation, orientation), _of_body(filter))
        return None if hit is None else ShapeHit(BodyId(*hit[0]), *hit[1:])

    def cast_shape_through(self, shape: dict[str, Any], position: Vector, translation: Vector,
                           orientation: Vector = (1.0, 0.0, 0.0, 0.0), *,
                           filter: Callable[[BodyId], bool] | None = None) -> list[ShapeHit]:
        """All bodies that a moving solid touches, sorted by fraction, then by index; one hit per
        body. Parameters and exceptions are those of cast_shape()."""
        hits = self._core.cast_shape_through(self._solid(shape), *_pose_and_translation(
            position, translation, orientation), _of_body(filter))
        return [ShapeHit(BodyId(*hit[0]), *hit[1:]) for hit in hits]

    def cast_shapes(self, shape: dict[str, Any], positions: Any, translations: Any,
                    orientations: Any = (1.0, 0.0, 0.0, 0.0)) -> ShapeHits:
        """The first hits of many casts of one solid, as those of cast_shape(). Lists and arrays of
        other numbers are converted to the dtype of the world.

        Parameters
        ----------
        shape : dict
            A solid, as for cast_shape().
        positions : array (C, 3)
            [m], each number in [-1e9, 1e9].
        translations : array (C, 3)
            [m]; the ends must be in [-1e9, 1e9], too.
        orientations : four numbers or array (C, 4)
            Unit quaternions (w, x, y, z).

        Raises
        ------
        InvalidScene
            A field of `shape` is unknown, missing or out of its range.
        InvalidArgument
            A wrong shape or type of an array, or a number out of its range; the message then has
            the cast.
        OutOfMemory, DeviceError
        """
        positions, translations = (
            _arrays.rows(_arrays.converted(array, name, self._dtype), name, 3)
            for array, name in ((positions, "positions"), (translations, "translations")))
        size = positions.shape[0]
        if translations.shape[0] != size:
            raise InvalidArgument(
                f"translations has {translations.shape[0]} rows; positions has {size}")
        turned = self._orientations(orientations, size)
        result = ShapeHits(np.empty(size, np.int64), self._values(size), self._rows(size),
                           self._rows(size), self._values(size), np.empty(size, np.int64))
        self._core.cast_shapes(self._solid(shape), positions, translations, turned, *result)
        return result

    def closest_body(self, position: Vector, shape: dict[str, Any] | None = None,
                     orientation: Vector = (1.0, 0.0, 0.0, 0.0),
                     max_distance: float = math.inf, *,
                     filter: Callable[[BodyId], bool] | None = None) -> BodyDistance | None:
        """The body that is closest to a point or a solid, or None; of bodies at the same distance,
        that with the lowest index. Overlaps have negative distances, so the deepest one is closest.
        All bodies count, also sensors, whatever their collision filters; a one-sided triangle counts
        from its front.

        Parameters
        ----------
        position : three numbers
            [m], of the point or the origin of the shape, each in [-1e9, 1e9].
        shape : dict, optional
            A solid, as for cast_shape(); None: a point.
        orientation : four numbers
            Unit quaternion (w, x, y, z), to a thousandth of the squared length.
        max_distance : float
            [m], >= 0; infinity is allowed. Bodies that are farther do not count.
        filter : function, optional
            Called with the BodyId of a body that is close enough, at most once for each; the body
            counts if the result is true. It must not change the world.

        Raises
        ------
        InvalidScene
            A field of `shape` is unknown, missing or out of its range.
        InvalidArgument
            Another number is out of its range, or `shape` is no solid.
        OutOfMemory, DeviceError, and exceptions of `filter`
        """
        found = self._core.closest_body(
            self._solid_or_point(shape), _arrays.triple(position, "position"),
            _arrays.triple(orientation, "orientation", 4),
            _arrays.number(max_distance, "max_distance"), _of_body(filter))
        return None if found is None else BodyDistance(BodyId(*found[0]), *found[1:])

    def bodies_within(self, position: Vector, max_distance: float,
                      shape: dict[str, Any] | None = None,
                      orientation: Vector = (1.0, 0.0, 0.0, 0.0), *,
                      filter: Callable[[BodyId], bool] | None = None) -> list[BodyDistance]:
        """All bodies up to a distance from a point or a solid, sorted by distance, then by index.
        Parameters and exceptions are those of closest_body()."""
        found = self._core.bodies_within(
            self._solid_or_point(shape), _arrays.triple(position, "position"),
            _arrays.triple(orientation, "orientation", 4),
            _arrays.number(max_distance, "max_distance"), _of_body(filter))
        return [BodyDistance(BodyId(*one[0]), *one[1:]) for one in found]

    def closest_bodies(self, positions: Any, shape: dict[str, Any] | None = None,
                       orientations: Any = (1.0, 0.0, 0.0, 0.0),
                       max_distances: Any = math.inf) -> BodyDistances:
        """The closest bodies of many points, or of one solid at many positions, as those of
        closest_body(). Lists and arrays of other numbers are converted to the dtype of the world.

        Parameters
        ----------
        positions : array (Q, 3)
            [m], each number in [-1e9, 1e9].
        shape : dict, optional
            A solid, as for cast_shape(); None: points.
        orientations : four numbers or array (Q, 4)
            Unit quaternions (w, x, y, z).
        max_distances : number or array (Q,)
            [m], >= 0; infinity is allowed.

        Raises
        ------
        InvalidScene
            A field of `shape` is unknown, missing or out of its range.
        InvalidArgument
            A wrong shape or type of an array, or a number out of its range; the message then has
            the query.
        OutOfMemory, DeviceError
        """
        positions = _arrays.rows(_arrays.converted(positions, "positions", self._dtype),
                                 "positions", 3)
        size = positions.shape[0]
        turned = self._orientations(orientations, size)
        limits = _arrays.vector(_arrays.converted(max_distances, "max_distances", self._dtype),
                                "max_distances", size, self._dtype)
        result = BodyDistances(np.empty(size, np.int64), self._values(size), self._rows(size),
                               self._rows(size), self._rows(size), np.empty(size, np.int64))
        self._core.closest_bodies(self._solid_or_point(shape), positions, turned, limits, *result)
        return result

    def move_character(self, state: CharacterState, dt: float,
                       settings: CharacterSettings = CharacterSettings(), *,
                       filter: Callable[[BodyId], bool] | None = None) -> CharacterMove:
        """Moves a character by `dt` with the velocity of its state, to which the program has added
        gravity, the wanted direction and jumps. Call it once after each step, with the dt of the
        scene. On the ground, the character walks along the surface, climbs steps and slides along
        walls; a downward velocity has no effect there. The world does not change: a program can push
        the bodies that were hit by apply_impulse(). Equal arguments and worlds give equal bits.

        Parameters
        ----------
        state : CharacterState
            State before the move; CharacterState(position) is one in the air.
        dt : float
            [s], > 0
        settings : CharacterSettings
            Shape and abilities.
        filter : function, optional
            Called with the BodyId of a body that is in the way, several times for some; the body is
            an obstacle if the result is true. Sensors never are. It must not change the world.

        Raises
        ------
        InvalidArgument
            A number is out of its range, or the move ends outside [-1e9, 1e9].
        OutOfMemory, DeviceError, and exceptions of `filter`
        """
        state = _arrays.instance(state, "state", CharacterState)
        settings = _arrays.instance(settings, "settings", CharacterSettings)
        if state.ground not in _GROUND_STATES:
            raise InvalidArgument(f'ground is {state.ground!r}; it must be "air", "ground" or "steep"')
        numbers = [_arrays.number(getattr(settings, name), name)
                   for name in ("radius", "half_height", "max_slope", "step_height", "skin")]
        *values, hits = self._core.move_character(
            numbers, _arrays.triple(settings.up, "up"), _arrays.triple(state.position, "position"),
            _arrays.triple(state.velocity, "velocity"), _GROUND_STATES.index(state.ground),
            state.ground_body, _arrays.triple(state.ground_normal, "ground_normal"),
            _arrays.number(dt, "dt"), _of_body(filter))
        position, velocity, ground, body, *others = values
        return CharacterMove(
            CharacterState(position, velocity, _GROUND_STATES[ground],
                           None if body is None else BodyId(*body), *others),
            [CharacterHit(BodyId(*hit[0]), *hit[1:]) for hit in hits])

    def overlapping(self, shape: dict[str, Any], position: Vector,
                    orientation: Vector = (1.0, 0.0, 0.0, 0.0), *,
                    filter: Callable[[BodyId], bool] | None = None) -> list[BodyId]:
        """Bodies that overlap or touch a solid, in the order of `bodies`. Parameters and exceptions
        are those of cast_shape()."""
        found = self._core.overlapping(self._solid(shape), _arrays.triple(position, "position"),
                                       _arrays.triple(orientation, "orientation", 4),
                                       _of_body(filter))
        return [BodyId(*body) for body in found]

    def overlapping_sphere(self, centre: Vector, radius: float) -> list[BodyId]:
        """Bodies that overlap or touch a sphere, in the order of `bodies`. `centre` [m] has numbers
        in [-1e9, 1e9]; `radius` [m] is in (0, 1e9]. Raises InvalidArgument for a number out of its
        range, OutOfMemory, DeviceError."""
        found = self._core.overlapping_sphere(_arrays.number(radius, "radius"),
                                              _arrays.triple(centre, "centre"))
        return [BodyId(*body) for body in found]

    def overlapping_box(self, centre: Vector, half_extents: Vector,
                        orientation: Vector = (1.0, 0.0, 0.0, 0.0)) -> list[BodyId]:
        """Bodies that overlap or touch a box, in the order of `bodies`. `centre` [m] has numbers in
        [-1e9, 1e9], `half_extents` [m] in (0, 1e9]; `orientation` is a unit quaternion
        (w, x, y, z) to a thousandth of the squared length. Raises InvalidArgument for a number out
        of its range, OutOfMemory, DeviceError."""
        found = self._core.overlapping_box(_arrays.triple(half_extents, "half_extents"),
                                           _arrays.triple(centre, "centre"),
                                           _arrays.triple(orientation, "orientation", 4))
        return [BodyId(*body) for body in found]

    def debug_lines(self, *, shapes: bool = True, joints: bool = True, contacts: bool = False,
                    contact_forces: bool = False, velocities: bool = False, axes: bool = False,
                    axis_length: float = 0.25, force_length: float = 0.01,
                    wall_size: float = 20.0, circle_points: int = 24,
                    region: tuple[Vector, Vector] | None = None,
                    filter: Callable[[BodyId], bool] | None = None) -> DebugLines:
        """The world as lines, for plots and renderers. Bodies come in the order of `bodies`, then
        joints and contacts. Colors show which bodies are awake, asleep, immovable, kinematic or sensors.

        Parameters
        ----------
        shapes, joints, contacts, contact_forces, velocities, axes : bool
            What is drawn: surfaces of bodies; lines from the bodies to the anchors of joints;
            points and normals of contacts(); contact_forces(); velocities, as long as the motion in
            0.1 s; axes of bodies.
        axis_length : float
            [m], of axes of joints and bodies and of normals, > 0.
        force_length : float
            [m/N], of contact forces.
        wall_size : float
            [m], > 0: side of the square that is drawn of a half-space or plane.
        circle_points : int
            Of a circle of a round solid, 4 to 1024.
        region : two vectors, optional
            [m], the lower and the upper corner of a box: only bodies that overlap it, their joints,
            and contacts in it.
        filter : function, optional
            Called with the BodyId of a body, which is drawn if the result is true. It must not
            change the world.

        Raises
        ------
        InvalidArgument
            A number is out of its range, or the region is empty.
        OutOfMemory, DeviceError, and exceptions of `filter`
        """
        box = None if region is None else (_arrays.triple(region[0], "region[0]"),
                                           _arrays.triple(region[1], "region[1]"))
        shown = [bool(x) for x in (shapes, joints, contacts, contact_forces, velocities, axes)]
        lengths = tuple(_arrays.number(value, name) for value, name in (
            (axis_length, "axis_length"), (force_length, "force_length"), (wall_size, "wall_size")))
        lines, colors = self._core.debug_lines(
            shown, lengths, _arrays.count(circle_points, "circle_points", 4, 1024), box,
            _of_body(filter))
        return DebugLines(lines.reshape(-1, 2, 3), colors)

    def view(self, *, height: int = 480) -> View:
        """A picture of the bodies in 3D for notebooks, which View.update() and View.follow() bring up
        to date, and which View.save() writes as an HTML file.

        Parameters
        ----------
        height : int in [50, 10000]
            Height in a notebook, in pixels.

        Raises
        ------
        InvalidArgument
            `height` is out of its range.
        OutOfMemory, DeviceError
        """
        return view_of_world(self, height)

    def _solid(self, shape: dict[str, Any]) -> Any:
        """The shape in a scene of one body."""
        return Scene({"bodies": [{"shape": shape, "mass": 0}]}, dtype=self._dtype)._scene

    def _solid_or_point(self, shape: dict[str, Any] | None) -> Any:
        return None if shape is None else self._solid(shape)

    def _orientations(self, orientations: Any, size: int) -> np.ndarray:
        """An array of shape (1, 4) or (size, 4)."""
        turned = _arrays.converted(orientations, "orientations", self._dtype)
        if turned.ndim == 1:
            turned = turned[np.newaxis]
        turned = _arrays.rows(turned, "orientations", 4)
        if turned.shape[0] not in (1, size):
            raise InvalidArgument(f"orientations has {turned.shape[0]} rows; positions has {size}")
        return turned

    def _rows(self, size: int) -> np.ndarray:
        return np.empty((size, 3), self._dtype)

    def _values(self, size: int) -> np.ndarray:
        return np.empty(size, self._dtype)

    def __repr__(self) -> str:
        try:
            return f"<jfpx.World: {len(self)} bodies at {self.time:g} s, {self._dtype}>"
        except (Closed, ConcurrentUse) as error:
            return f"<jfpx.World: {error}>"


def _report(fields: tuple[Any, ...]) -> StepReport:
    report = StepReport(*fields)
    if report.non_finite_body is None:
        return report
    return report._replace(non_finite_body=BodyId(*report.non_finite_body))


def _call(function: Callable[[Any], Any], kind: type, dtype: Any, context: Any) -> None:
    function(kind(context, dtype))


def _of_body(filter: Callable[[BodyId], bool] | None) -> Any:
    if filter is None:
        return None
    _arrays.function(filter, "filter")
    return lambda body: bool(filter(BodyId(*body)))


def _pose_and_translation(position: Vector, translation: Vector,
                          orientation: Vector) -> tuple[Any, Any, Any]:
    return (_arrays.triple(position, "position"), _arrays.triple(translation, "translation"),
            _arrays.triple(orientation, "orientation", 4))


def _restored(kind: type[World], scene: Scene, options: dict[str, Any], snapshot: bytes) -> World:
    world = kind(scene, **options)
    world.restore(snapshot)
    return world

"""Files of runs: recordings, which can be repeated, and trajectories for other programs."""

from __future__ import annotations

import os
from typing import Any, TypeVar

import numpy as np

from . import _arrays, _core
from ._errors import InvalidArgument
from ._forces import States
from ._scene import Scene
from ._view import View
from ._world import World

_Self = TypeVar("_Self", bound="_FileWriter")


class _FileWriter:
    """A file that appears when it is complete."""

    _writer: Any

    def finish(self) -> None:
        """Completes the file. Raises FileError, and Closed if the file is finished or was given up."""
        self._writer.finish()

    def __enter__(self: _Self) -> _Self:
        return self

    def __exit__(self, kind: object, *_: object) -> None:
        if kind is None:
            if self._writer.is_open():
                self.finish()
        else:
            self._writer.discard()


class RecordingWriter(_FileWriter):
    """Writes a recording, which `jfpx replay` and Recording read. The file appears under its name
    when the recording is finished: by finish(), or at the end of a `with` statement that raised
    nothing. Until then, the data are in a file with the suffix .part, which an exception in the
    `with` statement removes.

    Parameters
    ----------
    path : str or path
        The file.
    world : World
        A new world, without forces of add_force(). It must not be changed by other calls than
        step(), because a recording contains only the scene and the states.

    Raises
    ------
    InvalidArgument
        The world has made steps or has forces.
    FileError
        The file cannot be created.
    Closed, ConcurrentUse
        The world is closed, or is in use by another call.
    """

    def __init__(self, path: str | os.PathLike[str], world: World) -> None:
        _arrays.instance(world, "world", World)
        if world._core.steps() != 0:
            raise InvalidArgument("the world has made steps; a recording begins with a new world, "
                                  "such as World(world.scene)")
        self._refuse_functions(world)
        core = _arrays.precision_of(world.dtype)
        self._writer = core.RecordingWriter(_arrays.path(path), world._core)
        self._world = world
        self._steps = 0

    @staticmethod
    def _refuse_functions(world: World) -> None:
        for functions, name in ((world.forces, "forces of add_force()"),
                                (world.contact_generators, "contact generators")):
            if functions:
                raise InvalidArgument(f"the world has {name}, which a recording does not contain; "
                                      "record a world without them")

    def append(self) -> None:
        """Appends the states of the world. Call it once after each step.

        Raises
        ------
        InvalidArgument
            The world has not made exactly one step since the last call, has forces, or has not the
            number of bodies of its scene.
        FileError
            The file cannot be written, for example because the disk is full.
        Closed
            The recording is finished or was given up, or the world is closed.
        ConcurrentUse, OutOfMemory, DeviceError
            As World.states().
        """
        world = self._world
        self._refuse_functions(world)
        made = world._core.steps() - self._steps
        if made != 1 and self._writer.is_open():
            raise InvalidArgument(f"the world has made {made} steps since the last append(); append "
                                  "the states of each step, once")
        self._writer.append(world._core)
        self._steps += 1


class TrajectoryWriter(_FileWriter):
    """Writes the states of a world to a file for other programs. The extension selects the format:
    ".xyz" or ".extxyz" is extended XYZ, a text file that OVITO and ASE read; ".pvd" is an index of
    VTK files for ParaView, one for each frame, in a folder beside it: run.pvd has
    run/run_000000.vtp and so on. The files appear under their names when the trajectory is finished:
    by finish(), or at the end of a `with` statement that raised nothing.

    ::

        with jfpx.TrajectoryWriter("run.pvd", world) as trajectory:
            for _ in range(100):
                trajectory.append()
                world.run(6)

    A frame has a point for each of World.bodies, with the bits of their states: position, id
    (BodyId.index), radius, shape, orientation, velocity and angular velocity. Quaternions are (x, y,
    z, w) in extended XYZ, as in OVITO, and (w, x, y, z) in VTK. The radius of a body that is no
    sphere is the largest distance of its surface from its position, or a bound of it, and 0 for a
    half-space or plane. `shape` is 0 for a sphere, 1 box, 2 half-space, 3 plane, 4 compound, 5
    capsule, 6 triangle mesh, 7 hull, 8 heightfield, 9 cylinder, 10 cone; the geometry of these is
    not in the file.

    Parameters
    ----------
    path : str or path
        The file.
    world : World
        A world, which may be changed between two frames.

    Raises
    ------
    InvalidArgument
        The extension is another one.
    FileError
        The file cannot be created.
    """

    def __init__(self, path: str | os.PathLike[str], world: World) -> None:
        _arrays.instance(world, "world", World)
        self._writer = _arrays.precision_of(world.dtype).TrajectoryWriter(_arrays.path(path))
        self._world = world

    def append(self) -> None:
        """Appends a frame with the states of the world.

        Raises
        ------
        FileError
            The file cannot be written, for example because the disk is full. The trajectory cannot
            be finished then.
        Closed
            The trajectory is finished or was given up, or the world is closed.
        ConcurrentUse, OutOfMemory, DeviceError
            As World.states().
        """
        self._writer.append(self._world._core)


class Recording:
    """Reads a recording of jfpx 0.1 or 0.2, in the precision in which it was written.

    To repeat it, compare the states of a new world::

        recording = jfpx.Recording("run.rec")
        world = jfpx.World(recording.scene)
        for step in range(1, len(recording) + 1):
            world.step()
            same = world.positions.tobytes() == recording.states(step).positions.tobytes()

    Parameters
    ----------
    path : str or path
        The file, which is checked as a whole.

    Raises
    ------
    FileError
        The file cannot be read, is truncated or corrupt, is no recording, or was written by a later
        version.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        path = _arrays.path(path)
        single = _core.f32.recording_precision(path) == "float"
        self._dtype = np.dtype(np.float32 if single else np.float64)
        self._reader = _arrays.precision_of(self._dtype).RecordingReader(path)

    @property
    def scene(self) -> Scene:
        """A copy of the scene at the beginning of the run."""
        return Scene._of(self._reader.scene, self._dtype)

    @property
    def dtype(self) -> np.dtype:
        """Precision of the run: float32 or float64."""
        return self._dtype

    @property
    def engine(self) -> str:
        """Engine of the run: "native", "bullet" or "bullet-stock"."""
        return self._reader.engine

    def __len__(self) -> int:
        """Number of steps."""
        return self._reader.steps

    def view(self, *, every: int = 1, height: int = 480) -> View:
        """A picture of the run in 3D, which notebooks play with a slider and View.save() writes as an
        HTML file. A frame takes about 15 bytes a body in a file, and less for bodies at rest.

        Parameters
        ----------
        every : int in [1, len(self)]
            A frame is shown for each of so many steps.
        height : int in [50, 10000]
            Height in a notebook, in pixels.

        Raises
        ------
        InvalidArgument, FileError
            As states(); or a number is out of its range.
        """
        every = _arrays.count(every, "every", 1, max(len(self), 1))
        scene = self.scene
        states = [self.states(step) for step in range(every, len(self) + 1, every)]
        return scene.view(states or None, interval=every * scene.dt, height=height)

    def states(self, step: int) -> States:
        """States after a step, as new arrays (N, 3) and (N, 4) of `dtype`, in the order of the
        bodies.

        Parameters
        ----------
        step : int in [1, len(self)]

        Raises
        ------
        InvalidArgument
            `step` is not an integer or is out of its range; or the run has added or removed bodies,
            so that their number is not that of the scene.
        FileError
            The file cannot be read any more.
        """
        step = _arrays.count(step, "step", 1, len(self))
        states = States.empty(len(self.scene), self._dtype)
        self._reader.write_states(step, *states)
        return states

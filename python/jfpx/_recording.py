"""Recordings of runs: the scene and the states after every step."""

from __future__ import annotations

import os

import numpy as np

from . import _arrays, _core
from ._forces import States
from ._scene import Scene
from ._world import World


class RecordingWriter:
    """Writes a recording, which `jfpx replay` and Recording read. The file appears under its name
    when the recording is finished: by finish(), or at the end of a `with` statement that raised
    nothing.

    Raises
    ------
    FileError
        The file cannot be written.
    """

    def __init__(self, path: str | os.PathLike[str], world: World) -> None:
        core = _arrays.precision_of(world.dtype)
        self._writer = core.RecordingWriter(os.fspath(path), world._core)
        self._world = world

    def append(self) -> None:
        """Appends the states of the world after a step. The world must have the bodies of its
        scene. Raises InvalidArgument, FileError."""
        self._writer.append(self._world._core)

    def finish(self) -> None:
        """Completes the file. Raises FileError."""
        self._writer.finish()

    def __enter__(self) -> RecordingWriter:
        return self

    def __exit__(self, kind: object, *_: object) -> None:
        if kind is None:
            self.finish()
        else:
            self._writer.discard()


class Recording:
    """Reads a recording of this version, in the precision in which it was written.

    Raises
    ------
    FileError
        The file cannot be read, is truncated or corrupt, or is no recording of this version.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        path = os.fspath(path)
        single = _core.f32.recording_precision(path) == "float"
        self._dtype = np.dtype(np.float32 if single else np.float64)
        self._reader = _arrays.precision_of(self._dtype).RecordingReader(path)

    @property
    def scene(self) -> Scene:
        return Scene._of(self._reader.scene, self._dtype)

    @property
    def dtype(self) -> np.dtype:
        return self._dtype

    @property
    def engine(self) -> str:
        """"native", "bullet" or "bullet-stock"."""
        return self._reader.engine

    def __len__(self) -> int:
        """Number of steps."""
        return self._reader.steps

    def states(self, step: int) -> States:
        """States after a step, from 1 to the number of steps. Raises InvalidArgument."""
        step = _arrays.count(step, "step", 1, len(self))
        states = States.empty(len(self.scene), self._dtype)
        self._reader.write_states(step, *states)
        return states

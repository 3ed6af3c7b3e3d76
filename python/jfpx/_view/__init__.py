"""Pictures of worlds, scenes and recordings in notebooks and HTML files."""

from __future__ import annotations

import contextlib
import os
import time
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from .. import _arrays
from .._errors import FileError, InvalidArgument
from .._forces import States
from . import blob, page
from .geometry import Geometry, groups_of
from .look import look_of, up_of

Frame = tuple[np.ndarray, np.ndarray, np.ndarray]
"""Positions, orientations and whether bodies are awake."""


def _write(path: str, text: str) -> None:
    """Writes a file that appears under its path only when it is complete. Devices and pipes are
    written directly. Raises OSError."""
    target = os.path.realpath(path)
    if os.path.exists(target) and not os.path.isfile(target):
        with open(target, "w", encoding="utf-8") as file:
            file.write(text)
        return
    temporary = f"{target}.{os.getpid()}.tmp"
    try:
        with open(temporary, "w", encoding="utf-8") as file:
            file.write(text)
        os.replace(temporary, target)
    except BaseException:
        with contextlib.suppress(OSError):
            os.remove(temporary)
        raise


class View:
    """A picture of bodies in 3D, of World.view(), Scene.view() or Recording.view(). As the last
    expression of a cell, a notebook (Jupyter, VS Code, Colab) shows it.

    Drag turns the camera; with the right button or Shift, it moves; the wheel zooms after a click;
    a double click resets it. Several frames are played with a slider. Balls have the pattern of pool
    balls, which shows their rotation, and sleeping bodies are dimmer. Joints are not drawn.

    A picture that follows a world needs the package anywidget (`pip install anywidget`). Without it,
    a notebook shows the picture as it is when the cell ends. save() and to_html() need no package.
    """

    def __init__(self, core: Any, frames: Sequence[Frame] | None, *, interval: float, height: int,
                 title: str, world: Any = None) -> None:
        self._core = core
        self._world = world  # whose present state is shown, if there are no frames
        self._frames = frames
        self._interval = interval
        self._height = height
        self._title = title
        self._widget: Any = None
        self._bodies: Any = None
        self._read_scene(frames[0] if frames else self._now())

    def update(self) -> None:
        """Shows the present state of the world, also bodies that were added since, and without those
        that were removed. Has no effect on the view of a scene or recording. Raises what
        World.states() does."""
        if self._frames is not None:
            return
        is_other = self._core.bodies() != self._bodies
        if not is_other and self._widget is None:
            return
        now = self._now()
        if is_other:
            self._read_scene(now)
        if self._widget is not None:
            with self._widget.hold_sync():
                self._widget.scene, self._widget.frame = self._scene, self._blobs([now])[0]

    @contextlib.contextmanager
    def follow(self, *, speed: float | None = 1.0, rate: float = 30.0) -> Iterator[View]:
        """Shows the steps that the world makes in a `with` statement, and at its end the last one::

            view = world.view()
            display(view)
            with view.follow():
                world.run(600)

        Parameters
        ----------
        speed : number or None
            Steps wait, so that this many seconds of the world pass in a second; None: they do not
            wait.
        rate : number
            Largest number of pictures in a second, > 0.

        Raises
        ------
        ImportError
            The package anywidget is not installed.
        InvalidArgument
            The view is not that of a world, or a number is out of its range.
        """
        if self._world is None:
            raise InvalidArgument("the view is not that of a world; World.view() makes one that can follow")
        if speed is not None and not _arrays.number(speed, "speed") > 0:
            raise InvalidArgument(f"speed is {speed}; it must be > 0, or None")
        if not _arrays.number(rate, "rate") > 0:
            raise InvalidArgument(f"rate is {rate}; it must be > 0")
        self.widget  # raises ImportError
        begin, first, shown = time.monotonic(), self._core.time(), -np.inf

        def show() -> None:
            nonlocal shown
            now = time.monotonic()
            if speed is not None:
                due = begin + (self._core.time() - first) / speed
                if due > now:
                    time.sleep(due - now)
                    now = time.monotonic()
            if now - shown >= 1 / rate:
                shown = now
                self.update()

        followers = self._world._followers
        followers.append(show)
        try:
            yield self
        finally:
            followers.remove(show)
            self.update()

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes an HTML file that any browser with WebGL 2 shows, without a network. It has the
        frames of the view, or the present state of a world. Raises FileError."""
        path, text = _arrays.path(path), self.to_html()
        try:
            _write(path, text)
        except OSError as error:
            raise FileError(f"{path}: {error.strerror or error}") from None

    def to_html(self) -> str:
        """The text of the HTML file of save()."""
        self.update()
        return page.html(self._scene, blob.movie_blob(self._blobs()), title=self._title)

    @property
    def widget(self) -> Any:
        """The widget of anywidget that notebooks show, for layouts of ipywidgets. Raises ImportError
        if the package is not installed."""
        if self._widget is None:
            self.update()
            blobs = self._blobs()
            self._widget = page.widget(self._scene, blobs[0], blob.movie_blob(blobs) if len(blobs) > 1 else b"",
                                       self._height)
        return self._widget

    def _repr_mimebundle_(self, **_: Any) -> Any:
        try:
            widget = self.widget
        except ImportError as error:
            return {"text/html": page.frame(self.to_html(), self._height, str(error)), "text/plain": repr(self)}
        return widget._repr_mimebundle_()

    def __len__(self) -> int:
        """Number of frames."""
        return 1 if self._frames is None else len(self._frames)

    def __repr__(self) -> str:
        return f"<jfpx.View of {self._title}: {len(self._geometry.movable)} bodies, {len(self)} frames>"

    def _read_scene(self, first: Frame) -> None:
        """Reads the shapes of the bodies, and sets the look of the picture."""
        self._geometry = Geometry.of(self._core)
        self._bodies = None if self._frames is not None else self._core.bodies()
        self._groups = groups_of(self._geometry)
        frames = self._frames or [first]
        some = [frames[i] for i in sorted({round(k * (len(frames) - 1) / 8) for k in range(9)})]
        self._look = look_of(self._geometry, self._groups, [(p, q) for p, q, _ in some], up_of(self._geometry))
        balls = self._look.balls
        self._origin = (balls[:, :3].min(axis=0) + balls[:, :3].max(axis=0)) / 2 if len(balls) else np.zeros(3)
        self._scene = blob.scene_blob(self._geometry, self._groups, self._look, self._origin, self._interval)

    def _now(self) -> Frame:
        """The present state of the world."""
        states = self._world.states()
        awake = np.empty(len(states.positions), np.uint8)
        self._core.write_awake(awake)
        return states.positions.astype(float), states.orientations.astype(float), awake

    def _blobs(self, frames: Sequence[Frame] | None = None) -> list[bytes]:
        """The given frames as bytes; those of the view, or the present state, if absent."""
        frames = frames or self._frames or [self._now()]
        still = ~self._geometry.movable  # is never dimmed
        return [blob.frame_blob(p, q, np.where(still, 1, awake), self._origin) for p, q, awake in frames]


def view_of_world(world: Any, height: int) -> View:
    """The view of World.view()."""
    scene = world.scene
    return View(world._core, None, interval=scene.dt, height=_height(height), title=scene.name, world=world)


def view_of_scene(scene: Any, states: Any, interval: Any, height: int) -> View:
    """The view of Scene.view()."""
    size = len(scene)
    positions, orientations = np.empty((size, 3), scene.dtype), np.empty((size, 4), scene.dtype)
    scene._scene.write_poses(positions, orientations)
    own = (positions.astype(float), orientations.astype(float), np.ones(size, np.uint8))
    frames = [own] if states is None else [_frame(item, i, own) for i, item in enumerate(_list(states))]
    if not frames:
        raise InvalidArgument("states is empty; it must have at least one frame")
    seconds = scene.dt if interval is None else _arrays.number(interval, "interval")
    if not 0 < seconds < np.inf:
        raise InvalidArgument(f"interval is {interval}; it must be finite and > 0")
    # A copy, because scenes can be changed.
    core = type(scene._scene).from_json(scene.to_json()) if states is not None else scene._scene
    return View(core, frames, interval=seconds, height=_height(height), title=scene.name)


def _height(value: Any) -> int:
    return _arrays.count(value, "height", 50, 10_000)


def _list(states: Any) -> list[Any]:
    if isinstance(states, States):
        return [states]
    if isinstance(states, np.ndarray) and states.ndim != 3:
        raise InvalidArgument(f"states has shape {states.shape}; an array must be (frames, bodies, 3)")
    try:
        return list(states)
    except TypeError:
        raise InvalidArgument(f"states is of type {type(states).__name__}; it must be a list of States, or an "
                              "array of positions (frames, bodies, 3)") from None


def _frame(item: Any, number: int, own: Frame) -> Frame:
    """A frame from States or from positions alone, with the orientations of the scene."""
    size = len(own[0])
    positions, orientations = (item.positions, item.orientations) if isinstance(item, States) else (item, own[1])
    arrays = []
    for name, array, columns in (("positions", positions, 3), ("orientations", orientations, 4)):
        array = _arrays.rows(_arrays.converted(array, name, np.dtype(np.float64)), name, columns)
        if len(array) != size:
            raise InvalidArgument(f"{name} of frame {number} has {len(array)} rows; the scene has {size} bodies")
        arrays.append(array)
    return arrays[0], arrays[1], own[2]

"""Scenes: bodies and settings of a simulation."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping
from typing import Any

import numpy as np

from . import _arrays, _core
from ._errors import InvalidArgument, InvalidScene
from ._view import View, view_of_scene


class Scene:
    """Bodies and the settings of their simulation. A scene is validated when it is made.

    A floor and a ball that falls on it::

        jfpx.Scene({"dt": 1 / 60, "bodies": [
            {"shape": {"type": "half_space", "normal": [0, 1, 0], "offset": 0}, "mass": 0},
            {"shape": {"type": "sphere", "radius": 0.5}, "position": [0, 2, 0], "mass": 1},
        ]})

    to_dict() of a scene shows all fields with their defaults. Gravity is the `acceleration` of each
    body, (0, -9.81, 0) m/s^2 by default.

    Parameters
    ----------
    fields : dict, optional
        The scene as in a JSON file. All fields may be absent.
    dtype : "float32" or "float64"
        Precision of a world that is made from the scene.

    Raises
    ------
    InvalidScene
        A field is unknown or out of range. The message names the body, the field and the range.
    InvalidArgument
        `fields` is not a dict, or `dtype` is neither float32 nor float64.
    """

    def __init__(self, fields: dict[str, Any] | None = None, *, dtype: Any = "float32") -> None:
        self._dtype = np.dtype(dtype) if _arrays.precision_of(dtype) else None
        if fields is not None and not isinstance(fields, Mapping):
            hint = f"; Scene.named({fields!r}) makes a named scene" if isinstance(fields, str) else ""
            raise InvalidArgument(f"fields is of type {type(fields).__name__}; it must be a dict{hint}")
        fields = {"jfpx_scene": 2, "bodies": [], **(fields or {})}
        try:
            text = json.dumps(fields, default=_to_json, allow_nan=False)
        except (TypeError, ValueError) as error:
            reason = _not_finite(fields, "") if isinstance(error, ValueError) else None
            raise InvalidScene(reason or f"the scene has no JSON form: {error}") from None
        self._scene = _arrays.precision_of(dtype).Scene.from_json(text)

    @classmethod
    def from_json(cls, text: str, *, dtype: Any = "float32") -> Scene:
        """Parses JSON text.

        Raises
        ------
        InvalidScene
            The text is not JSON, and the message has line and column; or a field is unknown,
            missing or out of range.
        InvalidArgument
            `text` is not a str, or `dtype` is neither float32 nor float64.
        """
        text = _arrays.instance(text, "text", str)
        return cls._of(_arrays.precision_of(dtype).Scene.from_json(text), dtype)

    @classmethod
    def load(cls, path: str | os.PathLike[str], *, dtype: Any = "float32") -> Scene:
        """Reads a JSON file.

        Raises
        ------
        FileError
            The file cannot be read.
        InvalidScene, InvalidArgument
            As from_json(). The message of InvalidScene begins with the path.
        """
        return cls._of(_arrays.precision_of(dtype).Scene.load(_arrays.path(path)), dtype)

    @classmethod
    def named(cls, name: str, *, spheres: int | None = None, boxes: int | None = None,
              seed: int = 1, dtype: Any = "float32") -> Scene:
        """Generates one of scene_names().

        Parameters
        ----------
        name : str
        spheres, boxes : int in [0, 2^32 - 1], optional
            Numbers of movable bodies; the defaults of the scene if absent.
        seed : int in [0, 2^64 - 1]
            Seed of the scenes that are random.
        dtype : "float32" or "float64"

        Raises
        ------
        InvalidArgument
            There is no scene of this name, a number or `dtype` is out of its range, or `boxes` is
            given for a scene that has no variable number of boxes.
        OutOfMemory
            The scene needs more memory than the machine has.
        """
        limit = 2**32 - 1
        scene = _arrays.precision_of(dtype).Scene.named(
            _arrays.instance(name, "name", str),
            None if spheres is None else _arrays.count(spheres, "spheres", 0, limit),
            None if boxes is None else _arrays.count(boxes, "boxes", 0, limit),
            _arrays.count(seed, "seed", 0, 2**64 - 1))
        return cls._of(scene, dtype)

    @classmethod
    def _of(cls, scene: Any, dtype: Any) -> Scene:
        self = cls.__new__(cls)
        self._scene = scene
        self._dtype = np.dtype(dtype)
        return self

    def add_spheres(self, positions: Any, radii: Any, *, masses: Any = 1.0,
                    velocities: Any = (0.0, 0.0, 0.0), acceleration: Any = (0.0, -9.81, 0.0),
                    friction: Any = 0.5, restitution: Any = 0.0) -> None:
        """Adds a movable sphere for each row of an array; nothing if one of them is invalid.

        Lists and arrays of other numbers are converted to the dtype of the scene.

        Parameters
        ----------
        positions : array (N, 3)
            [m], each coordinate in [-1e9, 1e9].
        radii : number or array (N,)
            [m], in (0, 1e9].
        masses : number or array (N,)
            [kg], finite and >= 0; 0: immovable.
        velocities : three numbers or array (N, 3)
            [m/s], finite.
        acceleration : three numbers or array (N, 3)
            [m/s^2], finite: gravity.
        friction : number or array (N,)
            Friction coefficient, finite and >= 0.
        restitution : number or array (N,)
            Coefficient of restitution, in [0, 1].

        Raises
        ------
        InvalidArgument
            An array has a wrong shape or is not one of numbers.
        InvalidScene
            A value is out of its range. The message has the body.
        """
        positions = _arrays.rows(_arrays.converted(positions, "positions", self._dtype), "positions", 3)
        size = positions.shape[0]
        radii, masses, friction, restitution = (
            _arrays.vector(_arrays.converted(values, name, self._dtype), name, size, self._dtype)
            for values, name in ((radii, "radii"), (masses, "masses"), (friction, "friction"),
                                 (restitution, "restitution")))
        velocities, acceleration = (
            _arrays.vectors(values, name, size, self._dtype)
            for values, name in ((velocities, "velocities"), (acceleration, "acceleration")))
        self._scene.add_spheres(positions, radii, masses, velocities, acceleration, friction, restitution)

    def add_triangle_mesh(self, vertices: Any, triangles: Any = None, *, two_sided: bool = False,
                          **body: Any) -> dict[str, int]:
        """Adds a body of mass 0 with the shape of a surface of triangles. Scenes copy the mesh.

        ::

            scene.add_triangle_mesh(vertices, triangles, position=[0, -1, 0], friction=0.8)
            scene.add_triangle_mesh(trimesh.load("terrain.obj"))

        Parameters
        ----------
        vertices : array (N, 3)
            [m], each coordinate in [-1e9, 1e9]; or an object with the attributes `vertices` and
            `faces`, such as a Trimesh of the package trimesh.
        triangles : array (M, 3) of integers
            Rows of `vertices`, counterclockwise seen from the front.
        two_sided : bool
            Whether bodies collide with the backs of triangles, too.
        **body
            Fields of the body, as in a scene: position, orientation, kinematic, velocity,
            angular_velocity, friction, restitution, ...

        Returns
        -------
        dict
            Numbers of irregularities, which a mesh may have: "degenerate" and "duplicate" triangles,
            which have no contacts; "open_edges" of one triangle; "shared_edges" of three or more
            triangles, on which bodies may catch; "flipped_edges" of two triangles whose fronts are on
            different sides.

        Raises
        ------
        InvalidArgument
            An array has a wrong shape or type, a coordinate is out of its range, or a row of
            `triangles` has an index that is not that of a vertex.
        InvalidScene
            A field of the body is unknown or out of range, or there is no triangle.
        """
        if triangles is None:
            if not (hasattr(vertices, "vertices") and hasattr(vertices, "faces")):
                raise InvalidArgument("triangles is missing; pass arrays of vertices and triangles, or an "
                                      "object with the attributes vertices and faces")
            vertices, triangles = vertices.vertices, vertices.faces
        points = _arrays.rows(_arrays.converted(vertices, "vertices", self._dtype), "vertices", 3)
        report = self._scene.add_triangle_mesh(
            self._without_shape(body), points, _arrays.indices(triangles, "triangles", 3),
            bool(_arrays.instance(two_sided, "two_sided", bool)))
        return dict(zip(("degenerate", "duplicate", "open_edges", "shared_edges", "flipped_edges"), report))

    def add_heightfield(self, heights: Any, spacing: Any = 1.0, *, holes: Any = None,
                        two_sided: bool = False, **body: Any) -> None:
        """Adds a body of mass 0 with the shape of a surface over a regular grid, for terrain. Its
        contacts are those of a triangle mesh; it takes 5 bytes a vertex (9 in float64) instead of
        about 250. Scenes copy the heights.

        ::

            scene.add_heightfield(heights, 0.5, position=[0, -1, 0], friction=0.8)

        Parameters
        ----------
        heights : array (rows, columns)
            [m], each in [-1e9, 1e9]; 2 to 65,536 rows and columns, at most 2^28 heights. In the axes
            of the body, y is the height; x grows with the column and z with the row, and the middle of
            the grid is at x = z = 0.
        spacing : number, or two numbers
            [m], > 0, distance of adjacent vertices; or the distances along x and z.
        holes : array of booleans (rows - 1, columns - 1), optional
            True where a cell, the quadrangle between four vertices, has no surface.
        two_sided : bool
            Whether bodies collide with the lower side, too.
        **body
            Fields of the body, as in a scene: position, orientation, kinematic, velocity,
            angular_velocity, friction, restitution, ...

        Raises
        ------
        InvalidArgument
            An array has a wrong shape or type, or a number is out of its range.
        InvalidScene
            A field of the body is unknown or out of range.
        """
        heights = _arrays.converted(heights, "heights", self._dtype)
        if heights.ndim != 2:
            raise InvalidArgument(f"heights has shape {heights.shape}; it must be (rows, columns)")
        if np.ndim(spacing) == 0:
            spacing = (spacing, spacing)
        elif np.shape(spacing) != (2,):
            raise InvalidArgument(f"spacing has shape {np.shape(spacing)}; it must be a number or (2,)")
        spacing_x, spacing_z = (_arrays.number(s, "spacing") for s in spacing)
        cells: list[int] = []
        if holes is not None:
            mask = np.asarray(_arrays.to_host(holes, "holes") if hasattr(holes, "dtype") else holes)
            expected = (heights.shape[0] - 1, heights.shape[1] - 1)
            if mask.shape != expected or mask.dtype != bool:
                raise InvalidArgument(f"holes has shape {mask.shape} and dtype {mask.dtype}; it must be "
                                      f"{expected} and bool")
            rows, columns = np.nonzero(mask)
            cells = (rows * heights.shape[1] + columns).tolist()
        self._scene.add_heightfield(
            self._without_shape(body), np.ascontiguousarray(heights), spacing_x, spacing_z, cells,
            bool(_arrays.instance(two_sided, "two_sided", bool)))

    def _without_shape(self, body: dict[str, Any]) -> Any:
        """A scene of a body of mass 0 with the given fields."""
        if "shape" in body:
            raise InvalidArgument("shape is given; the shape of the body is that of the method")
        return Scene({"bodies": [{"mass": 0, **body, "shape": {"type": "sphere", "radius": 1}}]},
                     dtype=self._dtype)._scene

    @property
    def gravity(self) -> Any:
        """Raises AttributeError, also if it is set: each body has its own `acceleration`."""
        raise no_gravity()

    @gravity.setter
    def gravity(self, value: Any) -> None:
        raise no_gravity()

    @property
    def dtype(self) -> np.dtype:
        """Precision of a world that is made from the scene: float32 or float64."""
        return self._dtype

    @property
    def name(self) -> str:
        """Name of the scene; "unnamed" by default."""
        return self._scene.name

    @property
    def dt(self) -> float:
        """Length of a step [s], > 0."""
        return self._scene.dt

    def __len__(self) -> int:
        """Number of bodies."""
        return self._scene.bodies

    def to_json(self) -> str:
        """The scene as JSON text; from_json() makes an equal scene of it."""
        return self._scene.to_json()

    def to_dict(self) -> dict[str, Any]:
        """All fields of the scene, also those that had been absent; Scene() makes an equal scene of
        them."""
        return json.loads(self.to_json())

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes a JSON file: the path has the complete file or is unchanged. Raises FileError."""
        self._scene.save(_arrays.path(path))

    def view(self, states: Any = None, *, interval: float | None = None, height: int = 480) -> View:
        """A picture of the bodies in 3D for notebooks, which View.save() writes as an HTML file. A list
        of states is played with a slider::

            states = []
            for _ in range(300):
                world.step()
                states.append(world.states())
            world.scene.view(states)

        Parameters
        ----------
        states : list of States, or array (F, N, 3), optional
            Frames, with a row for each body of the scene; an array has positions [m] alone. The
            initial state if absent.
        interval : number, optional
            Seconds between two frames; `dt` if absent.
        height : int in [50, 10000]
            Height in a notebook, in pixels.

        Raises
        ------
        InvalidArgument
            An array has a wrong shape or type, `states` is empty, or a number is out of its range.
        """
        return view_of_scene(self, states, interval, height)

    def __eq__(self, other: object) -> bool:
        """Whether dtype and all fields are equal."""
        if not isinstance(other, Scene):
            return NotImplemented
        return self._dtype == other._dtype and self._scene.equals(other._scene)

    __hash__ = None  # type: ignore[assignment]  # scenes can be changed

    def __reduce__(self) -> Any:
        return _from_json, (self.to_json(), self._dtype.name)

    def __repr__(self) -> str:
        return f"<jfpx.Scene {self.name!r}: {len(self)} bodies, {self._dtype}>"


def _from_json(text: str, dtype: str) -> Scene:
    return Scene.from_json(text, dtype=dtype)


def no_gravity() -> AttributeError:
    """The exception of Scene.gravity and World.gravity."""
    return AttributeError("there is no gravity of all bodies: each has its own acceleration, (0, -9.81, 0) by "
                          "default; see the field \"acceleration\" of a body, add_spheres(acceleration=...) "
                          "and World.set_acceleration()")


def _to_json(value: Any) -> Any:
    """NumPy's numbers and arrays, for json.dumps()."""
    if isinstance(value, (np.ndarray, np.generic)):
        return value.tolist()
    raise TypeError(f"{value!r} is neither a number, a text, a list nor a dict")


def _not_finite(value: Any, path: str) -> str | None:
    """A message with the path of the first number of a scene that is not finite."""
    if isinstance(value, (np.ndarray, np.generic)):
        value = value.tolist()
    if isinstance(value, float) and not math.isfinite(value):
        return f"{path} is {value}; it must be finite"
    items: Any = ()
    if isinstance(value, Mapping):
        items = ((f"{path}.{key}" if path else str(key), item) for key, item in value.items())
    elif isinstance(value, (list, tuple)):
        items = ((f"{path}[{i}]", item) for i, item in enumerate(value))
    messages = (_not_finite(item, name) for name, item in items)
    return next((message for message in messages if message), None)


def centred(shape: Mapping[str, Any]) -> dict[str, Any]:
    """A compound or hull, translated so that its centre of mass is the origin of its axes, as a
    movable body requires::

        hammer = jfpx.centred({"type": "compound", "parts": [
            {"shape": {"type": "cylinder", "radius": 0.02, "half_height": 0.15}},
            {"shape": {"type": "box", "half_extents": [0.06, 0.02, 0.02]}, "position": [0, 0.15, 0],
             "density": 8}]})
        world.add({"shape": hammer, "position": [0, 1, 0]})

    Parameters
    ----------
    shape : dict
        As the field "shape" of a body in a Scene.

    Returns
    -------
    dict
        All fields of the shape. Other shapes are centred, and returned as they are.

    Raises
    ------
    InvalidScene
        A field is unknown or out of range.
    """
    scene = Scene({"bodies": [{"shape": shape, "mass": 0}]}, dtype="float64")
    centred_shape: dict[str, Any] = json.loads(scene._scene.centred().to_json())["bodies"][0]["shape"]
    return centred_shape


def scene_names() -> dict[str, str]:
    """Names of the scenes of Scene.named(), each with a line of description."""
    return dict(_core.f32.scene_names())

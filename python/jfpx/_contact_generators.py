"""Contact generators: functions that add contacts to a step and change those that were detected."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from . import _arrays
from ._errors import InvalidArgument
from ._forces import BodyId, Vector, _StepView


class DetectedContacts(NamedTuple):
    """The E detected contacts of a step before they are solved, in the dtype of the world. Sensors
    have none. Their order is the same for all numbers of threads.

    Attributes
    ----------
    pairs : array (2, E) of int64
        BodyId.index of a and b, as in WorldContacts.
    parts : array (2, E) of int64
        Of a and b: number of the part of a compound, or of the triangle of a mesh or heightfield;
        0 for other shapes.
    normal : array (E, 3)
        Unit vectors from b to a.
    point : array (E, 3)
        [m], in the axes of the world: the middle of the overlap or gap, at the deepest point.
    distance : array (E,)
        [m], of the deepest point; positive for a gap that may close during the step.
    friction : array (E,)
        Friction coefficient, >= 0.
    restitution : array (E,)
        Coefficient of restitution, in [0, 1].
    """

    pairs: np.ndarray
    parts: np.ndarray
    normal: np.ndarray
    point: np.ndarray
    distance: np.ndarray
    friction: np.ndarray
    restitution: np.ndarray


class ContactContext(_StepView):
    """The world after contact detection, for a contact generator. Valid during the call: afterwards,
    every use raises InvalidArgument. A body is unknown if its id is not of a living body of the
    world."""

    def detected(self) -> DetectedContacts:
        """The detected contacts, as new arrays, with the changes of this step. The first call in a
        step makes the list."""
        size = self._core.detected_count()
        result = DetectedContacts(np.empty((2, size), np.int64), np.empty((2, size), np.int64),
                                  np.empty((size, 3), self._dtype),
                                  np.empty((size, 3), self._dtype), np.empty(size, self._dtype),
                                  np.empty(size, self._dtype), np.empty(size, self._dtype))
        self._core.write_detected(*result)
        return result

    def change(self, *, friction: Any = None, restitution: Any = None, ignored: Any = None) -> None:
        """Changes the detected contacts for this step.

        Parameters
        ----------
        friction, restitution : array (E,), a number or None
            New values, >= 0 and in [0, 1], in the order of detected(), which are converted to the
            dtype of the world. None: no change.
        ignored : array (E,) of bool, a bool or None
            Whether the solver ignores a contact. It is then not in World.contacts(), has no event
            and wakes no body.

        Raises
        ------
        InvalidArgument
            A shape or type is wrong. Values out of their ranges undo the step and are raised by
            step().
        """
        size = self._core.detected_count()
        if friction is not None:
            self._core.set_frictions(self._values(friction, "friction", size))
        if restitution is not None:
            self._core.set_restitutions(self._values(restitution, "restitution", size))
        if ignored is not None:
            flags = np.asarray(ignored)
            if flags.dtype != bool:
                raise InvalidArgument(f"ignored has dtype {flags.dtype}; it must be bool")
            self._core.set_ignored(self._values(flags.astype(self._dtype), "ignored", size))

    def add(self, a: BodyId, b: BodyId, normal: Vector, point: Vector, distance: float,
            friction: float = 0.0, restitution: float = 0.0) -> None:
        """Adds a contact of two bodies, one of which may have mass 0.

        Parameters
        ----------
        a, b : BodyId
        normal : three numbers
            Unit vector: direction of the impulse on a; b receives the opposite.
        point : three numbers
            [m], in the axes of the world, where the contact acts.
        distance : float
            [m], <= 0: the bodies are separated by -distance.
        friction : float
            >= 0
        restitution : float
            In [0, 1].

        Raises
        ------
        InvalidArgument
            A body is unknown, both are the same, or a value is out of its range.
        """
        self._core.add(_arrays.body(a, "a"), _arrays.body(b, "b"),
                       _arrays.triple(normal, "normal"), _arrays.triple(point, "point"),
                       _arrays.number(distance, "distance"), _arrays.number(friction, "friction"),
                       _arrays.number(restitution, "restitution"))

    def _values(self, values: Any, name: str, size: int) -> np.ndarray:
        if hasattr(values, "dtype"):
            values = _arrays.converted(values, name, self._dtype)
        array = _arrays.vector(values, name, size, self._dtype)
        return np.ascontiguousarray(np.broadcast_to(array, (size,)))

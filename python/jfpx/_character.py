"""Values of World.move_character()."""

from __future__ import annotations

from typing import NamedTuple

from ._forces import BodyId


class CharacterSettings(NamedTuple):
    """Shape and abilities of a character: an upright capsule.

    Attributes
    ----------
    radius : float
        [m], > 0.
    half_height : float
        [m], > 0, half the length of the segment of the capsule.
    up : three numbers
        Direction of the axis, of any length.
    max_slope : float
        [rad], from 0 to 1.5: the steepest ground on which the character stands and walks.
    step_height : float
        [m], >= 0: the highest step that it climbs or descends.
    skin : float
        [m], > 0 and less than the radius: the distance that is kept from all surfaces.
    """

    radius: float = 0.3
    half_height: float = 0.6
    up: tuple[float, ...] = (0.0, 1.0, 0.0)
    max_slope: float = 0.8
    step_height: float = 0.4
    skin: float = 0.02


class CharacterState(NamedTuple):
    """State of a character. state._replace(velocity=...) makes another one.

    Attributes
    ----------
    position : three numbers
        [m], of the middle of the capsule, each in [-1e9, 1e9].
    velocity : three numbers
        [m/s]. On the ground: relative to the ground, and the result of a move is horizontal. In the
        air: in the world.
    ground : str
        "ground": the character stands or walks; "steep": it slides down ground that is steeper than
        max_slope; "air": it touches no ground.
    ground_body : BodyId or None
        The body below.
    ground_normal : three numbers
        Unit vector of the surface below; zero in the air.
    ground_velocity : three numbers
        [m/s], of the body below at the feet; zero in the air.
    ground_part : int
        Of the body below, as in RayHit; 0 in the air.
    """

    position: tuple[float, ...]
    velocity: tuple[float, ...] = (0.0, 0.0, 0.0)
    ground: str = "air"
    ground_body: BodyId | None = None
    ground_normal: tuple[float, ...] = (0.0, 0.0, 0.0)
    ground_velocity: tuple[float, ...] = (0.0, 0.0, 0.0)
    ground_part: int = 0


class CharacterHit(NamedTuple):
    """A body that blocked the move of a character.

    Attributes
    ----------
    body : BodyId
        The body.
    point : three numbers
        [m], in the axes of the world, of the surface of the body.
    normal : three numbers
        Unit vector, from the body to the character.
    approach_speed : float
        [m/s], >= 0, of character and body along the normal, before the hit.
    part : int
        Of the body, as in RayHit.
    """

    body: BodyId
    point: tuple[float, ...]
    normal: tuple[float, ...]
    approach_speed: float
    part: int


class CharacterMove(NamedTuple):
    """Result of World.move_character().

    Attributes
    ----------
    state : CharacterState
        The state after the move.
    hits : list of CharacterHit
        Bodies that blocked it, in the order of the move: the fastest hit of each.
    """

    state: CharacterState
    hits: list[CharacterHit]

"""What is wrong with the bodies after a run, measured for all engines in the same way."""

import copy
import math

import numpy as np

import scenes


def rotate(q, v):
    """Vectors v (N, 3) rotated by quaternions q (N, 4) as w, x, y, z."""
    u = q[:, 1:]
    return v + 2 * np.cross(u, np.cross(u, v) + q[:, :1] * v)


def deepest_penetration(scene, states):
    """Of all pairs, in m, by the collision detection of jfpx in float64; None without jfpx."""
    try:
        import jfpx
    except ImportError:
        return None
    positions, orientations = (np.asarray(x, float) for x in states[:2])
    orientations = orientations / np.linalg.norm(orientations, axis=1, keepdims=True)
    posed = dict(scene, dt=1e-9, bodies=copy.copy(scene["bodies"]))
    movable = [i for i, body in enumerate(scene["bodies"]) if body["mass"] > 0]
    for i, position, orientation in zip(movable, positions.tolist(), orientations.tolist()):
        posed["bodies"][i] = dict(scene["bodies"][i], position=position, orientation=orientation)
    world = jfpx.World(jfpx.Scene(posed, dtype="float64"), backend="cpu")
    world.step()
    distances = world.contacts().distance
    return max(0.0, -float(np.min(distances))) if len(distances) else 0.0


def joint_error(scene, states):
    """Largest distance of the two points of a joint, in m."""
    movable = np.array([body["mass"] > 0 for body in scene["bodies"]])
    positions, orientations = (np.array([body[key] for body in scene["bodies"]], float)
                               for key in ("position", "orientation"))
    positions[movable], orientations[movable] = states[0], states[1]
    ends = []
    for body, anchor in (("a", "anchor_a"), ("b", "anchor_b")):
        rows = [joint[body] for joint in scene["joints"]]
        ends.append(positions[rows] + rotate(orientations[rows], np.array([joint[anchor] for joint in scene["joints"]])))
    return float(np.max(np.linalg.norm(ends[0] - ends[1], axis=1)))


def lost_bodies(name, states):
    """Number of bodies whose centres are more than 0.5 m below the ground, outside of a box, or not finite."""
    positions = np.where(np.isfinite(states[0]), states[0], -1e9)
    x, y, z = positions.T
    ground = np.array([scenes.height(a, b) if abs(a) < 20 and abs(b) < 20 else 1e9
                       for a, b in zip(x, z)]) if name == "terrain" else np.zeros(len(y))
    outside = y < (-1e6 if name == "net" else ground - 0.5)
    if name in ("balls", "pit", "hulls"):
        outside |= (np.minimum(x, z) < -1) | (np.maximum(x, z) > 18)
    return int(np.sum(outside))


def measures(name, scene, states):
    """Measures of the states after a run, in mm and mm/s."""
    states = [np.asarray(x, float) for x in states]
    result = {"lost": lost_bodies(name, states)}
    if not all(np.isfinite(x).all() for x in states):
        return result
    deepest = deepest_penetration(scene, states)
    result["deepest"] = None if deepest is None else 1e3 * deepest
    result["speed"] = 1e3 * math.sqrt(np.mean(np.sum(states[2] ** 2, axis=1)))
    if name == "pyramid":
        start = np.array([body["position"] for body in scene["bodies"] if body["mass"] > 0])
        result["moved"] = 1e3 * float(np.max(np.linalg.norm(states[0] - start, axis=1)))
    if scene["joints"]:
        result["joints"] = 1e3 * joint_error(scene, states)
    return result


def number(value):
    return f"{value:.0f}" if value >= 10 else f"{value:.2g}"


def words(m):
    """A cell of the table: deepest penetration, speed, and what is special."""
    if "speed" not in m:
        return f"{m['lost']} bodies lost"
    cells = [] if m["deepest"] is None else [number(m["deepest"])]
    cells.append(number(m["speed"]))
    if "moved" in m:
        cells.append(number(m["moved"]) if m["moved"] < 500 else "falls")
    if "joints" in m:
        cells.append(number(m["joints"]))
    if m["lost"]:
        cells.append(f"{m['lost']} lost")
    return "; ".join(cells)

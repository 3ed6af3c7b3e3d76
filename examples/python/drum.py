"""A drum of triangles turns bodies of all shapes over and over. Writes the scene, which jfpx-view shows.

    python drum.py [--bodies 300] [--steps 300] [--save drum.json]
"""

import argparse
import itertools
import math

import numpy as np

import jfpx

RADIUS, DEPTH = 4.0, 2.4  # [m], of the drum, whose axis is z
SIDES, LIFTERS, LIFT = 96, 8, 0.7  # corners of its circle; ribs, and their height [m]
SPEED = 1.1  # [rad/s]


def drum():
    """Vertices and triangles of a tube with ribs inside. Both sides of its triangles collide."""
    angles = np.arange(SIDES) * 2 * math.pi / SIDES
    radii = np.where(np.arange(SIDES) % (SIDES // LIFTERS) == 0, RADIUS - LIFT, RADIUS)
    ring = np.stack([radii * np.cos(angles), radii * np.sin(angles)], axis=1)
    vertices = np.concatenate([np.column_stack([ring, np.full(SIDES, z)]) for z in (-DEPTH / 2, DEPTH / 2)])
    i = np.arange(SIDES)
    j = (i + 1) % SIDES
    return vertices, np.concatenate([np.stack([i, j, i + SIDES], axis=1), np.stack([j, j + SIDES, i + SIDES], axis=1)])


def shapes(generator):
    """Balls, boxes, capsules, cylinders, cones and stones of random sizes, in turn."""
    while True:
        size = generator.uniform(0.7, 1.1)
        points = generator.normal(size=(14, 3))
        stone = 0.24 * size * points / np.linalg.norm(points, axis=1, keepdims=True)
        yield {"type": "sphere", "radius": 0.2 * size}
        yield {"type": "box", "half_extents": (size * generator.uniform(0.13, 0.24, 3)).tolist()}
        yield {"type": "capsule", "radius": 0.13 * size, "half_height": 0.16 * size}
        yield {"type": "cylinder", "radius": 0.2 * size, "half_height": 0.15 * size}
        yield {"type": "cone", "radius": 0.22 * size, "half_height": 0.2 * size}
        # The centre of mass must be the origin: twice as many points, mirrored, have it there.
        yield {"type": "hull", "vertices": np.concatenate([stone, -stone]).tolist()}


def scene(bodies, seed):
    """The drum between two walls; the one in front is seen from the bodies' side alone."""
    generator = np.random.default_rng(seed)
    walls = [{"shape": {"type": "half_space", "normal": [0, 0, side], "offset": -DEPTH / 2}, "mass": 0, "friction": 0.2}
             for side in (1, -1)]
    places = [(x, y, z) for y, x, z in itertools.product(np.arange(-2.2, 2.8, 0.55), np.arange(-2.2, 2.3, 0.55),
                                                         np.arange(-0.8, 0.9, 0.55))]
    movable = [{"shape": shape, "position": [float(c) for c in place], "mass": 1, "friction": 0.6,
                "orientation": (turn / np.linalg.norm(turn)).tolist()}
               for shape, place, turn in zip(shapes(generator), places[:bodies], generator.normal(size=(bodies, 4)))]
    result = jfpx.Scene({"name": "drum", "bodies": walls + movable})
    result.add_triangle_mesh(*drum(), two_sided=True, kinematic=True, angular_velocity=[0, 0, SPEED], friction=0.8)
    return result


parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
parser.add_argument("--bodies", type=int, default=300)
parser.add_argument("--seed", type=int, default=1)
parser.add_argument("--steps", type=int, default=300)
parser.add_argument("--save", metavar="FILE.json", help="file for the scene")
options = parser.parse_args()

made = scene(options.bodies, options.seed)
if options.save:
    made.save(options.save)
    print(f"{options.save}: jfpx-view {options.save} shows the drum")
world = jfpx.World(made, threads=0)
report = world.run(options.steps)
positions = world.positions[2:-1]
outside = np.hypot(positions[:, 0], positions[:, 1]) > RADIUS
print(f"{report.contacts} contacts after {report.step} steps; bodies that left the drum: {outside.sum()}")

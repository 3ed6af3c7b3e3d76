"""The scenes of the comparison, in the format of a scene of jfpx (docs/scenes.md), which each engine's
adapter translates. All solids have 1000 kg/m^3 and friction 0.5, and nothing rebounds or sleeps."""

import itertools
import math
import random

import numpy as np

STEPS = 300
DENSITY = 1000.0
FRICTION = 0.5


def hull_volume(points):
    """Volume of the convex hull of a few points around the origin, no four in a plane, by all triples."""
    points = np.array(points)
    volume = 0.0
    for i, j, k in itertools.combinations(range(len(points)), 3):
        normal = np.cross(points[j] - points[i], points[k] - points[i])
        side = (points - points[i]) @ normal
        side[[i, j, k]] = 0
        if (side <= 0).all() or (side >= 0).all():
            volume += abs(np.dot(points[i], normal)) / 6
    return volume


def volume(shape):
    kind = shape["type"]
    if kind == "sphere":
        return 4 / 3 * math.pi * shape["radius"] ** 3
    if kind == "box":
        return 8 * math.prod(shape["half_extents"])
    if kind == "capsule":
        r = shape["radius"]
        return math.pi * r * r * (2 * shape["half_height"] + 4 / 3 * r)
    return hull_volume(shape["vertices"])


def solid(shape, position, orientation=(1, 0, 0, 0), mass=None):
    return {"shape": shape, "mass": DENSITY * volume(shape) if mass is None else mass,
            "position": list(position), "orientation": list(orientation), "friction": FRICTION}


def fixed_box(half_extents, position):
    return solid({"type": "box", "half_extents": list(half_extents)}, position, mass=0)


def open_box(low, high, height):
    """A floor at y = 0, and four walls around a rectangle."""
    (x0, z0), (x1, z1) = low, high
    x, z, hx, hz = (x0 + x1) / 2, (z0 + z1) / 2, (x1 - x0) / 2 + 2, (z1 - z0) / 2
    y = height / 2
    return [fixed_box((hx, 1, hz + 2), (x, -1, z)),
            fixed_box((1, y, hz + 2), (x0 - 1, y, z)), fixed_box((1, y, hz + 2), (x1 + 1, y, z)),
            fixed_box((hx, y, 1), (x, y, z0 - 1)), fixed_box((hx, y, 1), (x, y, z1 + 1))]


def scene(bodies, joints=()):
    return {"jfpx_scene": 2, "dt": 1 / 60, "solver": "soft_step", "sleep": {"enabled": False},
            "bodies": bodies, "joints": list(joints)}


def balls(n=16):
    """A lattice of n^3 balls that falls in a box which is a little wider."""
    rng = random.Random(1)
    bodies = open_box((-1, -1), (n * 1.05 + 0.2, n * 1.05 + 0.2), 40)
    for y, x, z in itertools.product(range(n), repeat=3):
        bodies.append(solid({"type": "sphere", "radius": 0.5},
                            (x * 1.05 + 0.04 * rng.random(), 0.6 + y * 1.05, z * 1.05 + 0.04 * rng.random())))
    return scene(bodies)


def pyramid(rows=40):
    """A pyramid of boxes of 1 m that touch each other."""
    bodies = [fixed_box((100, 1, 100), (0, -1, 0))]
    for i in range(rows):
        for j in range(i, rows):
            bodies.append(solid({"type": "box", "half_extents": [0.5, 0.5, 0.5]},
                                ((i + 1) * 0.5 + (j - i) - rows * 0.5, i + 0.5, 0)))
    return scene(bodies)


def pit(n=12):
    """n^3 boxes of different sizes that fall into a pit."""
    rng = random.Random(4)
    bodies = open_box((-1, -1), (n * 1.1, n * 1.1), 40)
    for y, x, z in itertools.product(range(n), repeat=3):
        size = [0.4 + 0.1 * rng.random() for _ in range(3)]
        bodies.append(solid({"type": "box", "half_extents": size},
                            (x * 1.1 + 0.05 * rng.random(), 1 + y * 1.2, z * 1.1 + 0.05 * rng.random())))
    return scene(bodies)


def hulls(n=10):
    """n^3 convex hulls of 16 points that fall into a pit. Opposite points make the origin their centre of mass."""
    rng = random.Random(7)
    shapes = []
    for _ in range(16):
        points = []
        for _ in range(8):
            p = np.array([rng.gauss(0, 1) for _ in range(3)])
            p *= (0.4 + 0.15 * rng.random()) / np.linalg.norm(p)
            points += [p.tolist(), (-p).tolist()]
        shapes.append({"type": "hull", "vertices": points})
    masses = [DENSITY * volume(shape) for shape in shapes]
    bodies = open_box((-1, -1), (n * 1.2, n * 1.2), 40)
    for y, x, z in itertools.product(range(n), repeat=3):
        kind = rng.randrange(len(shapes))
        bodies.append(solid(shapes[kind], (x * 1.2 + 0.05 * rng.random(), 1 + y * 1.2, z * 1.2 + 0.05 * rng.random()),
                            mass=masses[kind]))
    return scene(bodies)


# Limbs of a figure: centre, radius, half height, along x, parent, joint with the parent.
FIGURE = (((0, 1.0, 0), 0.15, 0.05, False, None, None),
          ((0, 1.25, 0), 0.15, 0.06, False, 0, (0, 1.1, 0)),
          ((0, 1.62, 0), 0.10, 0.03, False, 1, (0, 1.5, 0)),
          ((-0.18, 0.65, 0), 0.07, 0.18, False, 0, (-0.18, 0.9, 0)),
          ((0.18, 0.65, 0), 0.07, 0.18, False, 0, (0.18, 0.9, 0)),
          ((-0.18, 0.2, 0), 0.06, 0.14, False, 3, (-0.18, 0.42, 0)),
          ((0.18, 0.2, 0), 0.06, 0.14, False, 4, (0.18, 0.42, 0)),
          ((-0.37, 1.4, 0), 0.06, 0.13, True, 1, (-0.18, 1.4, 0)),
          ((0.37, 1.4, 0), 0.06, 0.13, True, 1, (0.18, 1.4, 0)),
          ((-0.74, 1.4, 0), 0.05, 0.13, True, 7, (-0.56, 1.4, 0)),
          ((0.74, 1.4, 0), 0.05, 0.13, True, 8, (0.56, 1.4, 0)))


def ragdolls(figures=100):
    """Figures of eleven capsules and ten ball joints without limits, which fall onto the ground in four layers."""
    bodies, joints = [fixed_box((100, 1, 100), (0, -1, 0))], []
    side = math.isqrt(figures // 4)
    half = math.sqrt(0.5)
    for figure in range(figures):
        layer, column = divmod(figure, side * side)
        at = np.array([1.9 * (column % side) + 0.3 * layer, 0.1 + 2.0 * layer, 0.8 * (column // side) + 0.1 * layer])
        first = len(bodies)
        for centre, radius, half_height, along_x, parent, anchor in FIGURE:
            shape = {"type": "capsule", "radius": radius, "half_height": half_height}
            turn = (half, 0, 0, half) if along_x else (1, 0, 0, 0)
            bodies.append(solid(shape, (at + centre).tolist(), turn))
            if parent is None:
                continue
            a, b = len(bodies) - 1, first + parent
            joints.append({"type": "ball", "a": a, "b": b,
                           "anchor_a": to_body_axes(np.subtract(anchor, centre), along_x),
                           "anchor_b": to_body_axes(np.subtract(anchor, FIGURE[parent][0]), FIGURE[parent][3])})
    return scene(bodies, joints)


def net(n=100):
    """A net of n x n balls, each of which has ball joints with its neighbours, held at one side. It swings down."""
    bodies, joints = [], []
    for row, column in itertools.product(range(n), repeat=2):
        bodies.append(solid({"type": "sphere", "radius": 0.4}, (column, 0, row), mass=0 if row == 0 else None))
        i = len(bodies) - 1
        for has_neighbor, b, axis in ((row * column > 0, i - 1, (0.5, 0, 0)), (row > 0, i - n, (0, 0, 0.5))):
            if has_neighbor:
                joints.append({"type": "ball", "a": i, "b": b, "anchor_a": [-x for x in axis], "anchor_b": list(axis)})
    return scene(bodies, joints)


def to_body_axes(v, along_x):
    """The vector in the axes of a limb, which is turned by 90 degrees about z if it lies along x."""
    return [float(v[1]), float(-v[0]), float(v[2])] if along_x else [float(c) for c in v]


def height(x, z):
    return 0.012 * (x * x + z * z) + 0.25 * math.sin(1.1 * x) * math.cos(0.9 * z)


def terrain(cells=40, bodies_on_it=1000):
    """Balls and boxes that fall into a hilly bowl, a mesh of 3,200 triangles with cells of 1 m."""
    rng = random.Random(3)
    n = cells + 1
    grid = [i - cells / 2 for i in range(n)]
    vertices = [[x, height(x, z), z] for z in grid for x in grid]
    triangles = []
    for z, x in itertools.product(range(cells), repeat=2):
        i = z * n + x
        triangles += [[i, i + n, i + 1], [i + 1, i + n, i + n + 1]]
    mesh = {"type": "triangle_mesh", "vertices": vertices, "triangles": triangles}
    bodies = [solid(mesh, (0, 0, 0), mass=0)]
    for i in range(bodies_on_it):
        layer, place = divmod(i, 100)
        x, z = 1.6 * (place % 10 - 4.5) + 0.2 * rng.random(), 1.6 * (place // 10 - 4.5) + 0.2 * rng.random()
        shape = ({"type": "sphere", "radius": 0.3 + 0.2 * rng.random()} if i % 2 else
                 {"type": "box", "half_extents": [0.25 + 0.2 * rng.random() for _ in range(3)]})
        bodies.append(solid(shape, (x, 3.5 + 1.3 * layer, z)))
    return scene(bodies)


SCENES = {
    "balls": (balls, "4,096 balls fall in a box"),
    "pyramid": (pyramid, "pyramid of 820 boxes"),
    "pit": (pit, "1,728 boxes fall into a pit"),
    "hulls": (hulls, "1,000 convex hulls fall into a pit"),
    "ragdolls": (ragdolls, "100 figures of 11 capsules with ball joints"),
    "net": (net, "net of 10,000 balls with 19,701 ball joints"),
    "terrain": (terrain, "500 balls and 500 boxes on 3,200 triangles"),
}

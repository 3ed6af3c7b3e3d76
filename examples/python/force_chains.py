"""Force chains: grains between two panes come to rest, and lines show the forces of their contacts.

    python force_chains.py [--grains 900] [--steps 900] [--picture chains.png]
"""

import argparse

import numpy as np

import jfpx

WIDTH, LARGEST = 30.0, 0.5  # [m]: distance of the side walls, and the largest radius


def scene(grains, seed):
    """Grains of several sizes above the floor, between side walls and smooth panes that a large grain just fits."""
    generator = np.random.default_rng(seed)
    walls = [{"shape": {"type": "half_space", "normal": normal, "offset": offset}, "mass": 0, "friction": friction}
             for normal, offset, friction in (([0, 1, 0], 0, 0.5), ([1, 0, 0], 0, 0.5), ([-1, 0, 0], -WIDTH, 0.5),
                                              ([0, 0, 1], -LARGEST, 0), ([0, 0, -1], -LARGEST, 0))]
    columns = int(WIDTH / (2.1 * LARGEST))
    rows = -(-grains // columns)
    x, y = np.meshgrid((np.arange(columns) + 0.5) * WIDTH / columns, (np.arange(rows) + 0.5) * 2.1 * LARGEST)
    centres = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)[:grains]
    radii = LARGEST * generator.uniform(0.6, 1, grains)
    centres[:, :2] += generator.uniform(-0.02, 0.02, (grains, 2))
    result = jfpx.Scene({"name": "force chains", "bodies": walls})
    result.add_spheres(centres, radii, masses=2500 * 4 / 3 * np.pi * radii ** 3, friction=0.5)
    return result, radii


parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
parser.add_argument("--grains", type=int, default=900)
parser.add_argument("--seed", type=int, default=1)
parser.add_argument("--steps", type=int, default=900)
parser.add_argument("--picture", metavar="FILE.png")
options = parser.parse_args()

made, radii = scene(options.grains, options.seed)
world = jfpx.World(made, threads=0)
report = world.run(options.steps)
forces = world.contact_forces()
walls = len(world) - options.grains

# In a contact of a grain and a wall, a is the grain. All walls together carry the weight.
of_wall = forces.pairs[1] < walls
weight = 9.81 * sum(world.mass(body) for body in world.bodies[walls:])
print(f"{len(forces.force)} contacts push, {report.awake} grains are awake; "
      f"floor and walls carry {forces.force[of_wall, 1].sum() / weight:.3f} of the weight")

if options.picture:
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot
    from matplotlib.collections import EllipseCollection, LineCollection

    positions = world.positions
    strength = np.linalg.norm(forces.force, axis=1)
    inside = ~of_wall & (strength > 0)
    a, b = positions[forces.pairs[0, inside]], positions[forces.pairs[1, inside]]
    share = strength[inside] / strength[inside].mean()
    order = np.argsort(share)
    figure, axes = pyplot.subplots(figsize=(11, 6.5))
    axes.add_collection(EllipseCollection(2 * radii, 2 * radii, np.zeros_like(radii), offsets=positions[walls:, :2], units="xy",
                                          transOffset=axes.transData, facecolors="0.93", edgecolors="0.8", linewidths=0.5))
    lines = LineCollection(np.stack([a, b], axis=1)[order, :, :2], linewidths=np.minimum(1.2 * share[order], 7), cmap="inferno_r",
                           capstyle="round")
    lines.set_array(np.minimum(share[order], 4))
    axes.add_collection(lines)
    figure.colorbar(lines, label="force of a contact, by the mean", shrink=0.7)
    axes.set(xlim=(0, WIDTH), ylim=(0, positions[walls:, 1].max() + 1), aspect="equal", xticks=[], yticks=[])
    figure.savefig(options.picture, dpi=110, bbox_inches="tight")
    print(f"picture: {options.picture}")

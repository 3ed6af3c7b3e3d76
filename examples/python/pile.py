"""A pile of spheres falls and comes to rest: heights, contacts and awake bodies over time. Uses a GPU
where that is faster, or always with `--backend cuda`; the result has the same bits without one.

    python pile.py [--spheres 2000] [--steps 300] [--backend auto|cpu|cuda] [--picture FILE.png]
"""

# %% The world
import argparse

import numpy as np

import jfpx

parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
parser.add_argument("--spheres", type=int, default=2000)
parser.add_argument("--steps", type=int, default=300)
parser.add_argument("--backend", choices=["auto", "cpu", "cuda"], default="auto")
parser.add_argument("--picture", help="file for the curves; needs matplotlib")
options = parser.parse_args()

for row in jfpx.available_backends():
    print(f"{row['backend']}: {row['device'] if row['usable'] else row['reason']}")
scene = jfpx.Scene.named("pile", spheres=options.spheres)
world = jfpx.World(scene, backend=options.backend, threads=0)
movable = np.array([world.mass(body) > 0 for body in world.bodies])

# %% Steps
times, heights, contacts, awake = [], [], [], []
for _ in range(options.steps):
    report = world.step()
    times.append(world.time)
    heights.append(world.positions[movable, 1].mean())
    contacts.append(report.contacts)
    awake.append(report.awake)
print(f"after {world.time:.1f} s: mean height {heights[-1]:.3f} m, {contacts[-1]} contacts, "
      f"{awake[-1]} bodies awake, hash {world.state_hash():016x}")

# %% The same on one thread of the CPU
again = jfpx.World(scene, backend="cpu")
again.run(options.steps)
assert again.state_hash() == world.state_hash()
print("one thread of the CPU gives the same bits")

# %% Picture
if options.picture:
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(3, sharex=True, figsize=(6, 6))
    for axis, values, label in zip(axes, (heights, contacts, awake),
                                   ("mean height [m]", "contacts", "awake bodies")):
        axis.plot(times, values)
        axis.set_ylabel(label)
    axes[-1].set_xlabel("time [s]")
    figure.tight_layout()
    figure.savefig(options.picture, dpi=120)

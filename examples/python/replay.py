"""Records a run, repeats it bit by bit, and shows how a small change of one velocity grows.

    python replay.py [--picture FILE.png]
"""

# %% A recording
import argparse
import pathlib
import tempfile

import numpy as np

import jfpx

parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
parser.add_argument("--picture", help="file for the distances; needs matplotlib")
options = parser.parse_args()
steps = 240
scene = jfpx.Scene.named("pile", spheres=150)

with tempfile.TemporaryDirectory() as folder:
    path = pathlib.Path(folder) / "pile.rec"
    world = jfpx.World(scene)
    with jfpx.RecordingWriter(path, world) as writer:
        for _ in range(steps):
            world.step()
            writer.append()
    recording = jfpx.Recording(path)
    recorded = [recording.states(step) for step in range(1, steps + 1)]

# %% The same run has the same bits in every step
world = jfpx.World(recording.scene, threads=2)
for states in recorded:
    world.step()
    assert world.states().positions.tobytes() == states.positions.tobytes()
print(f"{steps} steps were repeated bit by bit")

# %% A small change grows
world = jfpx.World(recording.scene)
states = world.states()
first = next(i for i, body in enumerate(world.bodies) if world.mass(body) > 0)
states.velocities[first, 0] += np.float32(1e-6)
world.set_states(states)
distances = []
for states in recorded:
    world.step()
    distances.append(np.abs(world.positions - states.positions).max())
changed = next(step for step, distance in enumerate(distances, 1) if distance > 0)
print(f"a change of 1 um/s is seen in step {changed}; after {steps} steps, a body is "
      f"{distances[-1]:.2g} m away")

# %% Picture
if options.picture:
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    plt.semilogy(np.arange(1, steps + 1), np.maximum(distances, 1e-9))
    plt.xlabel("step")
    plt.ylabel("largest distance [m]")
    plt.savefig(options.picture, dpi=120)

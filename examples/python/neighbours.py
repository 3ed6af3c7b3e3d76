"""Neighbours of random points: how many there are, and that every method agrees on them.

    python neighbours.py [--picture FILE.png]
"""

# %% Points, and their pairs within a cutoff
import argparse

import numpy as np

import jfpx

parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
parser.add_argument("--picture", help="file for a histogram; needs matplotlib")
options = parser.parse_args()

points = np.random.default_rng(1).random((20_000, 3), dtype=np.float32)
cutoff = 0.05
pairs = jfpx.find_pairs(points, cutoff)
print(f"{len(points)} points have {pairs.shape[1]} pairs within {cutoff}")

# %% Rows: the neighbours of each point
rows = jfpx.find_pairs(points, cutoff, half=False, output="csr")
neighbours = np.diff(rows.offsets)
print(f"a point has {neighbours.mean():.2f} neighbours on average, at most {neighbours.max()}")

# %% In a periodic cell, all points have the same surroundings
periodic = jfpx.find_pairs(points, cutoff, periodic=(1, 1, 1), half=False, output="csr")
everywhere = np.diff(periodic.offsets)
expected = len(points) * 4 / 3 * np.pi * cutoff**3
print(f"in a periodic cell {everywhere.mean():.2f}; a gas has {expected:.2f}")
assert abs(everywhere.mean() - expected) < 0.2

# %% Any number of threads gives the same bits
for threads in (1, 2, 0):
    same = jfpx.find_pairs(points, cutoff, threads=threads)
    assert same.tobytes() == pairs.tobytes()
print("all numbers of threads give the same bits")

# %% Picture
if options.picture:
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    bins = np.arange(everywhere.max() + 2) - 0.5
    plt.hist([neighbours, everywhere], bins, label=["box", "periodic cell"])
    plt.xlabel("neighbours within the cutoff")
    plt.ylabel("points")
    plt.legend()
    plt.savefig(options.picture, dpi=120)

"""Times of jfpx.find_pairs() against other libraries, and of a world against the command, as tables in
Markdown. What is not installed is left out. All libraries search the same points, and their numbers of
pairs are compared: libraries that round differently may differ by the pairs at the cutoff.

    python bench/python/neighbours.py [cpu] [cuda] [world]
"""

import csv
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time

import numpy as np

import jfpx


def points_of(n, neighbours, seed=1):
    """Uniform points in the unit cube, and the cutoff with that many neighbours on average."""
    cutoff = float(np.float32((3 * neighbours / (4 * np.pi * n)) ** (1 / 3)))
    return np.random.default_rng(seed).random((n, 3), dtype=np.float32), cutoff


def median_ms(call, synchronize=lambda: None, repeats=15):
    """Median time of a call after three others."""
    times = []
    for i in range(repeats + 3):
        synchronize()
        begin = time.perf_counter()
        call()
        synchronize()
        if i >= 3:
            times.append(1e3 * (time.perf_counter() - begin))
    return statistics.median(times)


def row(*cells):
    print("| " + " | ".join(f"{cell:.3g}" if isinstance(cell, float) else str(cell)
                            for cell in cells) + " |")


def cpu():
    try:
        from scipy.spatial import cKDTree
    except ImportError:
        print("SciPy is not installed")
        return
    print("\n## NumPy, one thread, ms\n\n| points | neighbours | pairs | SciPy's pairs | jfpx | SciPy | "
          "ratio |\n|---|---|---|---|---|---|---|")
    for neighbours in (3, 30):
        x, cutoff = points_of(100_000, neighbours)
        own = median_ms(lambda: jfpx.find_pairs(x, cutoff))
        other = median_ms(lambda: cKDTree(x).query_pairs(cutoff, output_type="ndarray"), repeats=5)
        row(len(x), neighbours, jfpx.find_pairs(x, cutoff).shape[1],
            len(cKDTree(x).query_pairs(cutoff, output_type="ndarray")), own, other, other / own)
    x, cutoff = points_of(10, 3)
    print(f"\n10 points: {1e3 * median_ms(lambda: jfpx.find_pairs(x, cutoff), repeats=2000):.1f} us")


def warp_search(x, cutoff):
    """Function that counts the pairs a < b with the HashGrid of Warp."""
    import warp as wp

    @wp.kernel
    def count(grid: wp.uint64, points: wp.array(dtype=wp.vec3), radius: float,
              counts: wp.array(dtype=int)):
        i = wp.hash_grid_point_id(grid, wp.tid())
        p = points[i]
        n = int(0)
        for j in wp.hash_grid_query(grid, p, radius):
            if j > i and wp.length(p - points[j]) <= radius:
                n += 1
        counts[i] = n

    points = wp.from_torch(x, dtype=wp.vec3)
    side = max(1, min(256, int(1 / cutoff)))
    grid = wp.HashGrid(side, side, side)
    counts = wp.zeros(len(x), dtype=int)

    def search():
        grid.build(points, cutoff)
        wp.launch(count, len(x), [grid.id, points, cutoff, counts])
        return counts

    return search


def cuda():
    import torch

    wait = torch.cuda.synchronize
    print(f"\n## {torch.cuda.get_device_name()}, tensors of PyTorch, ms\n\n`Warp` builds its grid and "
          "counts, without a list of pairs.\n\n| points | neighbours | pairs | jfpx | Warp | its pairs | "
          "ratio | torch_cluster | its pairs | ratio | brute force | its pairs |\n"
          "|---|---|---|---|---|---|---|---|---|---|---|---|")
    for n in (10_000, 100_000, 1_000_000):
        for neighbours in (3, 30):
            host, cutoff = points_of(n, neighbours)
            x = torch.from_numpy(host).cuda()
            own = median_ms(lambda: jfpx.find_pairs(x, cutoff), wait)
            cells = [n, neighbours, jfpx.find_pairs(x, cutoff).shape[1], own]
            try:
                search = warp_search(x, cutoff)
                other = median_ms(search, wait)
                cells += [other, int(search().numpy().sum()), other / own]
            except ImportError:
                cells += ["-"] * 3
            try:
                from torch_cluster import radius_graph
                most = 16 * neighbours + 64
                other = median_ms(lambda: radius_graph(x, cutoff, max_num_neighbors=most), wait)
                cells += [other, radius_graph(x, cutoff, max_num_neighbors=most).shape[1] // 2,
                          other / own]
            except ImportError:
                cells += ["-"] * 3
            if n <= 100_000:  # float64, in bands of rows
                def brute_force():
                    y = x.double()
                    total = 0
                    for begin in range(0, n, 2000):
                        near = torch.cdist(y[begin:begin + 2000], y,
                                           compute_mode="donot_use_mm_for_euclid_dist") <= cutoff
                        total += int(near.sum())
                    return (total - n) // 2
                cells += [median_ms(brute_force, wait, 1), brute_force()]
            else:
                cells += ["-"] * 2
            row(*cells)
    x = torch.rand((448, 3), device="cuda")
    collider = jfpx.SphereCollider()
    out = torch.empty((2, 100_000), dtype=torch.int32, device="cuda")
    count = torch.empty(2, dtype=torch.int64, device="cuda")
    collider.reserve(x, 448, 100_000)
    print(f"\n448 points: find_pairs() {1e3 * median_ms(lambda: jfpx.find_pairs(x, 0.1), wait, 2000):.1f}"
          " us; with out and count "
          f"{1e3 * median_ms(lambda: collider.find_pairs(x, 0.1, out=out, count=count), wait, 2000):.1f}"
          " us")


def steps_of_python(spheres, steps):
    """Times of the steps of a pile [ms], and the hash of its end."""
    pile = jfpx.World(jfpx.Scene.named("pile", spheres=spheres), backend="cpu", threads=0)
    times = []
    for _ in range(steps):
        begin = time.perf_counter()
        pile.step()
        times.append(1e3 * (time.perf_counter() - begin))
    return times, f"{pile.state_hash():016x}"


def steps_of_command(command, spheres, steps):
    """The same of `jfpx run`."""
    with tempfile.NamedTemporaryFile() as file:
        out = subprocess.run(
            [command, "run", "pile", "--backend", "cpu", "--spheres", str(spheres), "--steps",
             str(steps), "--threads", "0", "--csv", file.name, "--hash", "--quiet"],
            check=True, stdout=subprocess.PIPE, text=True).stdout
        with open(file.name, newline="") as table:
            return [float(row["total_ms"]) for row in csv.DictReader(table)], out.split()[-1]


def world():
    """A pile from Python against the command, which is on PATH or named by JFPX_COMMAND."""
    command = os.environ.get("JFPX_COMMAND") or shutil.which("jfpx")
    if command is None:
        print("the command jfpx is not on PATH")
        return
    print("\n## Pile of 100,000 on the CPU, one thread per core, ms a step\n\nMedian of steps 11 to "
          "60; the two take turns.\n\n| run | Python | command | ratio | equal hashes |\n"
          "|---|---|---|---|---|")
    for run in range(1, 4):
        own, own_hash = steps_of_python(100_000, 60)
        other, other_hash = steps_of_command(command, 100_000, 60)
        own, other = statistics.median(own[10:]), statistics.median(other[10:])
        row(run, own, other, own / other, own_hash == other_hash)


if __name__ == "__main__":
    for part in sys.argv[1:] or ["cpu"]:
        {"cpu": cpu, "cuda": cuda, "world": world}[part]()

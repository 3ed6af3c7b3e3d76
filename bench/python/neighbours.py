"""Times of jfpx.find_pairs() against other libraries, and of a world against the command, as tables in
Markdown. What is not installed is left out. All libraries search the same points, and must find the same
number of pairs.

    python bench/python/neighbours.py [cpu] [cuda] [world] [world-cuda]
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
    """Uniform points in the unit cube, and the cutoff with that many neighbours on average.

    Coordinates are multiples of a unit, and the cutoff is 400 to 800 units: squares of distances are
    integers that float32 represents, and none is the square of the cutoff, so that rounding decides
    no pair."""
    cutoff = (3 * neighbours / (4 * np.pi * n)) ** (1 / 3)
    unit = 2.0 ** np.ceil(np.log2(cutoff / 800))
    x = np.floor(np.random.default_rng(seed).random((n, 3)) / unit) * unit
    cutoff = unit * np.sqrt(np.floor((cutoff / unit) ** 2) + 0.5)
    return x.astype(np.float32), float(np.float32(cutoff))


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
    wp.init()

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


def radius_graph_search(x, cutoff, neighbours):
    """Function that lists the neighbours of each point, both orders in int64, with PyTorch Geometric."""
    import torch_cluster  # noqa: F401 (PyTorch Geometric calls it)
    from torch_geometric.nn import radius_graph

    return lambda: radius_graph(x, cutoff, max_num_neighbors=16 * neighbours + 64)


def brute_force(x, cutoff):
    """The number of pairs in float64, from bands of the matrix of distances."""
    import torch

    x = x.double()
    total = 0
    for begin in range(0, len(x), 2000):
        near = torch.cdist(x[begin:begin + 2000], x,
                           compute_mode="donot_use_mm_for_euclid_dist") <= cutoff
        total += int(near.sum())
    return (total - len(x)) // 2


def pairs_of_tree(x, cutoff):
    """The number of pairs in float64, from SciPy, or "-"."""
    try:
        from scipy.spatial import cKDTree
    except ImportError:
        return "-"
    tree = cKDTree(x)
    return (int(tree.count_neighbors(tree, cutoff)) - len(x)) // 2


def compared(own, make_search, count, wait, repeats=15):
    """Cells of a table: median time and number of pairs of another library, and the ratio to `own`."""
    try:
        search = make_search()
    except ImportError:
        return ["-"] * 3
    other = median_ms(search, wait, repeats)
    return [other, count(search()), other / own]


def cuda():
    import torch

    wait = torch.cuda.synchronize
    print(f"\n## {torch.cuda.get_device_name()}, tensors of PyTorch, ms\n\n`Warp` builds its grid and "
          "counts, without a list of pairs. SciPy's pairs are those of float64.\n\n"
          "| points | neighbours | pairs | SciPy's pairs | jfpx | both orders, int64 | periodic | Warp | its pairs "
          "| ratio | radius_graph | its pairs | ratio | brute force | its pairs |\n"
          "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|")
    for n in (10_000, 100_000, 1_000_000):
        for neighbours in (3, 30):
            host, cutoff = points_of(n, neighbours)
            x = torch.from_numpy(host).cuda()
            own = median_ms(lambda: jfpx.find_pairs(x, cutoff), wait)
            both = median_ms(lambda: jfpx.find_pairs(x, cutoff, half=False, index_dtype="int64"), wait)
            periodic = median_ms(lambda: jfpx.find_pairs(x, cutoff, periodic=(1, 1, 1)), wait)
            cells = [n, neighbours, jfpx.find_pairs(x, cutoff).shape[1], pairs_of_tree(host, cutoff),
                     own, both, periodic]
            cells += compared(own, lambda: warp_search(x, cutoff),
                              lambda counts: int(counts.numpy().sum()), wait)
            cells += compared(both, lambda: radius_graph_search(x, cutoff, neighbours),
                              lambda edges: edges.shape[1] // 2, wait,
                              repeats=1 if n == 1_000_000 else 15)  # tests all pairs
            if n <= 100_000:
                cells += [median_ms(lambda: brute_force(x, cutoff), wait, 1), brute_force(x, cutoff)]
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


def steps_of_python(backend, spheres, steps):
    """Times of the steps of a pile [ms], and the hash of its end."""
    pile = jfpx.World(jfpx.Scene.named("pile", spheres=spheres), backend=backend, threads=0)
    times = []
    for _ in range(steps):
        begin = time.perf_counter()
        pile.step()
        times.append(1e3 * (time.perf_counter() - begin))
    return times, f"{pile.state_hash():016x}"


def steps_of_command(command, backend, spheres, steps):
    """The same of `jfpx run`."""
    with tempfile.NamedTemporaryFile() as file:
        out = subprocess.run(
            [command, "run", "pile", "--backend", backend, "--spheres", str(spheres), "--steps",
             str(steps), "--threads", "0", "--csv", file.name, "--hash", "--quiet"],
            check=True, stdout=subprocess.PIPE, text=True).stdout
        with open(file.name, newline="") as table:
            return [float(row["total_ms"]) for row in csv.DictReader(table)], out.split()[-1]


def world(backend="cpu"):
    """A pile from Python against the command, which is on PATH or named by JFPX_COMMAND."""
    command = os.environ.get("JFPX_COMMAND") or shutil.which("jfpx")
    if command is None:
        print("the command jfpx is not on PATH")
        return
    print(f"\n## Pile of 100,000, backend {backend}, one thread per core, ms a step\n\nMedian of steps 11 "
          "to 60; the two take turns.\n\n| run | Python | command | ratio | equal hashes |\n"
          "|---|---|---|---|---|")
    for run in range(1, 4):
        own, own_hash = steps_of_python(backend, 100_000, 60)
        other, other_hash = steps_of_command(command, backend, 100_000, 60)
        own, other = statistics.median(own[10:]), statistics.median(other[10:])
        row(run, own, other, own / other, own_hash == other_hash)


if __name__ == "__main__":
    for part in sys.argv[1:] or ["cpu"]:
        {"cpu": cpu, "cuda": cuda, "world": world, "world-cuda": lambda: world("cuda")}[part]()

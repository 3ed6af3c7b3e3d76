"""Times of jfpx.find_pairs() against other libraries, and of a world against the command, as tables in
Markdown. What is not installed is left out. All libraries search the same points, and must find the same
number of pairs.

    python bench/python/neighbours.py [cpu] [cells] [batches] [cuda] [cuda-periodic] [stages] [world] [world-cuda]

`cuda` compares with Warp, with PyTorch Geometric if --geometric is given, and with brute force, all on
the device; `cuda-periodic` with open searches and nvalchemi-toolkit-ops. `stages` divides the time of a
call on the device.
"""

import argparse
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


def median_ms(call, synchronize=lambda: None, repeats=15, waits_after=True):
    """Median time of a call after three others."""
    times = []
    for i in range(repeats + 3):
        synchronize()
        begin = time.perf_counter()
        call()
        if waits_after:
            synchronize()
        if i >= 3:
            times.append(1e3 * (time.perf_counter() - begin))
    return statistics.median(times)


def medians_in_turns(searches, repeats, warm_up=0, synchronize=lambda: None):
    """Median times of searches by name, which take turns, so that other load of the machine has the same
    effect on each, and their last results."""
    times, results = {name: [] for name in searches}, {}
    for i in range(warm_up + repeats):
        for name, search in searches.items():
            synchronize()
            begin = time.perf_counter()
            results[name] = search()
            synchronize()
            if i >= warm_up:
                times[name].append(1e3 * (time.perf_counter() - begin))
    return {name: statistics.median(values) for name, values in times.items()}, results


def row(*cells):
    print("| " + " | ".join(f"{cell:.3g}" if isinstance(cell, float) else str(cell)
                            for cell in cells) + " |", flush=True)


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


def lists_of(positions, cutoff, cell):
    """Functions that find half lists (matscipy: full ones) with shifts, by library."""
    lists = {"jfpx": lambda: jfpx.find_neighbors(positions, cutoff, cell=cell).pairs.shape[1]}
    try:
        import vesin
        calculator = vesin.NeighborList(cutoff=cutoff, full_list=False)
        lists["vesin"] = lambda: len(calculator.compute(positions, cell, True, "ijS")[0])
    except ImportError:
        pass
    try:
        from matscipy.neighbours import neighbour_list
        lists["matscipy"] = lambda: len(neighbour_list("ijS", cutoff=cutoff, positions=positions, cell=cell,
                                                       pbc=[True] * 3)[0]) // 2
    except ImportError:
        pass
    if np.array_equal(cell, np.eye(3)):
        lists["find_pairs"] = lambda: jfpx.find_pairs(positions, cutoff, periodic=(1, 1, 1))[0].shape[1]
        try:
            from scipy.spatial import cKDTree
            lists["SciPy"] = lambda: len(cKDTree(positions, boxsize=1).query_pairs(cutoff, output_type="ndarray"))
        except ImportError:
            pass
    return lists


def cells():
    """Neighbor lists in cells of two shapes; all libraries take turns."""
    libraries = ("jfpx", "find_pairs", "vesin", "matscipy", "SciPy")
    print("\n## Periodic cells, float64, one thread, ms\n\nMedians; the libraries take turns. `find_pairs` is that of "
          "jfpx. matscipy lists both orders, SciPy has no shifts.\n\n"
          "| cell | points | neighbours | pairs | " + " | ".join(libraries) + " | fastest other / jfpx |\n"
          + "|---" * (5 + len(libraries)) + "|", flush=True)
    for name, cell in (("cube", np.eye(3)), ("triclinic", np.array([[1, 0, 0], [0.4, 1, 0], [-0.3, 0.45, 1]]))):
        for n in (10_000, 100_000):
            positions = np.random.default_rng(1).random((n, 3)) @ cell
            for neighbours in (3, 30, 100):
                cutoff = (3 * neighbours / (4 * np.pi * n)) ** (1 / 3)
                lists = lists_of(positions, cutoff, cell)
                if n * neighbours > 2_000_000:
                    lists.pop("matscipy", None)  # takes minutes
                medians, pairs = medians_in_turns(lists, 5 if n * neighbours <= 300_000 else 3)
                assert len(set(pairs.values())) == 1, pairs
                others = [medians[library] for library in ("vesin", "matscipy", "SciPy") if library in medians]
                row(name, n, neighbours, pairs["jfpx"], *(medians.get(library, "-") for library in libraries),
                    min(others) / medians["jfpx"] if others else "-")


def batches():
    """Many small systems, each with a cell of its own, in one call and in a loop that joins the results."""
    systems, points = 5000, 20
    rng = np.random.default_rng(1)
    cells = 5 * (np.eye(3) + rng.uniform(-0.2, 0.2, (systems, 3, 3)))
    x = (rng.random((systems, points, 3)) @ cells).reshape(-1, 3)
    numbers = np.repeat(np.arange(systems), points)

    def loop(cutoff, cells, half):
        parts = []
        for k in range(systems):
            found = jfpx.find_neighbors(x[k * points:(k + 1) * points], cutoff,
                                        cell=None if cells is None else cells[k], half=half)
            parts.append((found.pairs + k * points, found.shifts))
        return np.concatenate([pairs for pairs, _ in parts], axis=1), np.concatenate([shifts for _, shifts in parts])

    print(f"\n## {systems} systems of {points} points, float64, one thread, ms\n\nMedians; both take turns. Triclinic "
          "cells of about 5 x 5 x 5.\n\n| cells | lists | cutoff | pairs | loop | batch | ratio |\n|---|---|---|---|---|---|---|",
          flush=True)
    for name, own_cells in (("none", None), ("own", cells)):
        for cutoff in (1.5, 2, 3):
            for half in (True, False):
                times = [], []
                for _ in range(5):
                    begin = time.perf_counter()
                    expected = loop(cutoff, own_cells, half)
                    middle = time.perf_counter()
                    found = jfpx.find_neighbors(x, cutoff, cell=own_cells, batch=numbers, half=half)
                    times[1].append(1e3 * (time.perf_counter() - middle))
                    times[0].append(1e3 * (middle - begin))
                    assert np.array_equal(found.pairs, expected[0]) and np.array_equal(found.shifts, expected[1])
                own, other = statistics.median(times[1]), statistics.median(times[0])
                row(name, "half" if half else "full", cutoff, found.pairs.shape[1], other, own, other / own)


def warp_search(x, cutoff, lists):
    """Function that counts the pairs a < b of each point with the HashGrid of Warp, and with `lists`
    also lists them: a scan of the numbers, and a second search that writes."""
    import torch
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

    @wp.kernel
    def fill(grid: wp.uint64, points: wp.array(dtype=wp.vec3), radius: float,
             ends: wp.array(dtype=int), size: int, pairs: wp.array(dtype=int)):
        i = wp.hash_grid_point_id(grid, wp.tid())
        p = points[i]
        at = int(0)
        if i > 0:
            at = ends[i - 1]
        for j in wp.hash_grid_query(grid, p, radius):
            if j > i and wp.length(p - points[j]) <= radius:
                pairs[at] = i
                pairs[size + at] = j
                at += 1

    points = wp.from_torch(x, dtype=wp.vec3)
    side = max(1, min(256, int(1 / cutoff)))
    grid = wp.HashGrid(side, side, side)
    counts, ends = wp.zeros(len(x), dtype=int), wp.zeros(len(x), dtype=int)

    def search():
        grid.build(points, cutoff)
        wp.launch(count, len(x), [grid.id, points, cutoff, counts])
        if not lists:
            return counts
        wp.utils.array_scan(counts, ends, inclusive=True)
        size = int(ends[-1:].numpy()[0])
        pairs = torch.empty((2, size), dtype=torch.int32, device=x.device)
        wp.launch(fill, len(x), [grid.id, points, cutoff, ends, size, wp.from_torch(pairs.view(-1))])
        return pairs

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


def has_pairs_of_sample(x, cutoff, pairs, sample=128):
    """Whether points of a sample have as many neighbours as by brute force in float64."""
    import torch

    points = torch.linspace(0, len(x) - 1, sample, dtype=torch.int64, device=x.device)
    near = torch.cdist(x[points].double(), x.double(),
                       compute_mode="donot_use_mm_for_euclid_dist") <= cutoff
    counts = torch.bincount(pairs.flatten(), minlength=len(x))
    return bool((counts[points] == near.sum(1) - 1).all())


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


def cuda(geometric):
    import torch

    wait = torch.cuda.synchronize
    print(f"\n## {torch.cuda.get_device_name()}, tensors of PyTorch, ms\n\n`Warp` builds its grid, counts "
          "the pairs of each point, scans, and lists them in no order; `its count` ends after counting. "
          "SciPy's pairs are those of float64; `sample`: 128 points have as many neighbours as by brute "
          "force in float64.\n\n"
          "| points | neighbours | pairs | SciPy's pairs | sample | jfpx | Warp | its pairs | Warp / jfpx "
          "| its count | both orders, int64 | periodic | radius_graph | its pairs | ratio | brute force | its pairs |\n"
          "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|", flush=True)
    for n in (10_000, 100_000, 1_000_000):
        for neighbours in (3, 30, 100):
            host, cutoff = points_of(n, neighbours)
            x = torch.from_numpy(host).cuda()
            own = median_ms(lambda: jfpx.find_pairs(x, cutoff), wait, repeats=60)
            both = median_ms(lambda: jfpx.find_pairs(x, cutoff, half=False, index_dtype="int64"), wait)
            periodic = median_ms(lambda: jfpx.find_pairs(x, cutoff, periodic=(1, 1, 1)), wait)
            pairs = jfpx.find_pairs(x, cutoff)
            cells = [n, neighbours, pairs.shape[1], pairs_of_tree(host, cutoff),
                     has_pairs_of_sample(x, cutoff, pairs), own]
            cells += compared(own, lambda: warp_search(x, cutoff, lists=True),
                              lambda pairs: pairs.shape[1], wait, repeats=60)
            cells += compared(own, lambda: warp_search(x, cutoff, lists=False), lambda _: "", wait)[:1]
            cells += [both, periodic]
            cells += compared(both, lambda: radius_graph_search(x, cutoff, neighbours),
                              lambda edges: edges.shape[1] // 2, wait,
                              repeats=1 if n == 1_000_000 else 15) if geometric else ["-"] * 3
            if n <= 10_000:  # 100 times as long with 10 times as many points
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


def nvalchemi_lists(x, cutoff, neighbours, cell):
    """Functions of nvalchemi-toolkit-ops that list half of the neighbours with their shifts, each with a
    prepared state, by the form of the result: rows of equal length, or pairs."""
    import torch
    from nvalchemiops.torch.neighbors import neighbor_list, prepare_neighbor_list

    periodic = torch.ones(3, dtype=torch.bool, device="cuda")
    lists = {}
    for form, pairs in (("matrix", False), ("pairs", True)):
        state = prepare_neighbor_list(x, cutoff, cell=cell, pbc=periodic, half_fill=True, return_neighbor_list=pairs,
                                      max_neighbors=2 * neighbours + 32, fixed_cell=True)
        lists[form] = lambda state=state: neighbor_list(x, cutoff, cell=cell, pbc=periodic, state=state)
    return lists


def periodic_on_device():
    """Searches in a periodic cell with shifts; the libraries take turns."""
    import torch

    wait = torch.cuda.synchronize
    print(f"\n## {torch.cuda.get_device_name()}, periodic cell, tensors of PyTorch, ms\n\nMedians; the searches take turns. "
          "nvalchemi-toolkit-ops with a prepared state: `matrix` are rows of equal length, `pairs` a list as that of jfpx.\n\n"
          "| points | neighbours | pairs | open | periodic | ratio | matrix | pairs | its pairs | matrix / jfpx | pairs / jfpx |\n"
          "|---|---|---|---|---|---|---|---|---|---|---|", flush=True)
    for n in (10_000, 100_000, 1_000_000):
        for neighbours in (3, 30, 100):
            host, cutoff = points_of(n, neighbours)
            x, cell = torch.from_numpy(host).cuda(), torch.eye(3, device="cuda")
            searches = {"open": lambda: jfpx.find_pairs(x, cutoff),
                        "periodic": lambda: jfpx.find_pairs(x, cutoff, periodic=(1, 1, 1))}
            try:
                searches.update(nvalchemi_lists(x, cutoff, neighbours, cell))
            except ImportError:
                pass
            repeats = 60 if n * neighbours <= 3_000_000 else 15
            medians, results = medians_in_turns(searches, repeats, warm_up=5, synchronize=wait)
            cells = [n, neighbours, results["periodic"][0].shape[1], medians["open"], medians["periodic"],
                     medians["periodic"] / medians["open"]]
            if "pairs" in medians:
                cells += [medians["matrix"], medians["pairs"], results["pairs"][0].shape[1],
                          medians["matrix"] / medians["periodic"], medians["pairs"] / medians["periodic"]]
            row(*cells)


def kernels_of(call, calls=20):
    """Kernels, copies and memsets of a call, and their time on the device [us], by the profiler of
    PyTorch."""
    import torch
    from torch.profiler import ProfilerActivity, profile

    with profile(activities=[ProfilerActivity.CUDA]) as profiled:
        for _ in range(calls):
            call()
        torch.cuda.synchronize()
    events = [event for event in profiled.events()
              if event.device_type == torch.autograd.DeviceType.CUDA]
    times = {}
    for event in events:
        name = event.name.replace("(anonymous namespace)::", "").split("(")[0].split("::")[-1]
        times[name] = times.get(name, 0) + event.device_time_total / calls
    listed = ", ".join(f"{name} {time:.1f}" for name, time in
                       sorted(times.items(), key=lambda item: -item[1]))
    return len(events) / calls, sum(times.values()), listed


def stages():
    """Where the time of a call goes. The function of the binding takes the same addresses as the call,
    and writes to the same arrays, so that the difference is the overhead of Python."""
    import torch

    from jfpx import _device

    wait = torch.cuda.synchronize
    print("\n## Stages of a call, us\n\n`call` includes the end of all kernels; `return` does not. "
          "`overhead` is the time of a call without that of the function of the C++ library.\n\n"
          "| points | neighbours | call | return | C++ | its return | overhead | launches | device | kernels |\n"
          "|---|---|---|---|---|---|---|---|---|---|", flush=True)
    for n in (448, 10_000, 100_000, 1_000_000):
        for neighbours in (3, 30):
            host, cutoff = points_of(n, neighbours)
            x = torch.from_numpy(host).cuda()
            call = lambda: jfpx.find_pairs(x, cutoff)
            search = _device.DeviceSearch(x, None)
            search.set_radii(cutoff / 2)
            core = search.collider({})
            size = call().shape[1]
            out = torch.empty(2 * size, dtype=torch.int32, device="cuda")
            direct = lambda: core.find_pairs(search._spheres, out.data_ptr(), False, size, search.stream)
            times = [1e3 * median_ms(function, wait, 300) for function in (call, direct)]
            returns = [1e3 * median_ms(function, wait, 300, waits_after=False)
                       for function in (call, direct)]
            try:
                launches, device, listed = kernels_of(call)
            except (AttributeError, RuntimeError) as error:
                launches, device, listed = "-", "-", str(error)
            row(n, neighbours, times[0], returns[0], times[1], returns[1], times[0] - times[1], launches,
                device, listed)


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


def main():
    parts = {"cpu": cpu, "cells": cells, "batches": batches, "cuda": None, "cuda-periodic": periodic_on_device,
             "stages": stages, "world": world, "world-cuda": lambda: world("cuda")}
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("parts", nargs="*", choices=[*parts, []], default=[], metavar="part")
    parser.add_argument("--geometric", action="store_true", help="also PyTorch Geometric")
    options = parser.parse_args()
    parts["cuda"] = lambda: cuda(options.geometric)
    for part in options.parts or ["cpu"]:
        parts[part]()


if __name__ == "__main__":
    main()

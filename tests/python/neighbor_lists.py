"""Compares jfpx.find_neighbors() with ASE and vesin, in crystals, molecules and liquids. What is not
installed is left out. Usage: PYTHONPATH=FOLDER_OF_JFPX python neighbor_lists.py [--require N]
"""
import argparse
import sys

import numpy as np

import jfpx

CUTOFFS = (1.27, 2.71, 4.13, 6.31)  # between the shells of the crystals


def systems():
    """Names, positions, cells and flags."""
    rng = np.random.default_rng(3)
    half = np.ones((3, 3)) - np.eye(3)
    yield "diamond", [[0, 0, 0], [0.8925] * 3], 1.785 * half, [True] * 3
    yield "fcc", [[7, -3, 0.2]], 2.025 * half, [True] * 3
    yield "bcc", [[0, 0, 0]], 1.435 * (np.ones((3, 3)) - 2 * np.eye(3)), [True] * 3
    hexagonal = np.array([[2.46, 0, 0], [-1.23, 2.1304, 0], [0, 0, 6.7]])
    graphite = np.array([[0, 0, 0], [1 / 3, 2 / 3, 0], [0, 0, 0.5], [2 / 3, 1 / 3, 0.5]]) @ hexagonal
    yield "graphite", graphite, hexagonal, [True] * 3
    yield "graphene", graphite[:2], np.diag([1, 1, 0]) @ hexagonal, [True, True, False]
    skewed = np.array([[4.1, 0, 0], [21.7, 3.9, 0], [-17.3, 30.1, 4.4]])
    yield "skewed", rng.random((12, 3)) @ skewed, skewed, [True] * 3
    triclinic = np.array([[6.7, 0.3, -0.2], [2.9, 5.8, 0.4], [-1.7, 2.2, 7.1]])
    yield "triclinic", rng.random((30, 3)) @ triclinic, triclinic, [True] * 3
    molecules = np.array([[0, 0, 0], [0.757, 0.586, 0], [-0.757, 0.586, 0]])
    water = (rng.random((60, 1, 3)) * 12.4 + molecules).reshape(-1, 3)
    yield "water", water, 12.4 * np.eye(3), [True] * 3
    yield "water, far from the cell", water + 12.4 * rng.integers(-40, 40, (180, 3)), 12.4 * np.eye(3), [True] * 3
    yield "wire", rng.random((9, 3)) * 3, np.diag([1.9, 0, 0]), [True, False, False]
    yield "molecule", rng.random((40, 3)) * 7, np.zeros((3, 3)), [False] * 3


def of_ase(positions, cell, pbc, cutoff):
    from ase.neighborlist import primitive_neighbor_list
    return primitive_neighbor_list("ijSdD", pbc, cell, positions, cutoff)


def of_vesin(positions, cell, pbc, cutoff):
    from vesin import NeighborList
    return NeighborList(cutoff=cutoff, full_list=True).compute(positions, cell, pbc, "ijSdD")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--require", type=int, default=1, metavar="N", help="libraries that must be installed [1]")
    arguments = parser.parse_args()
    libraries, failed = 0, 0
    for name, search in [("ASE", of_ase), ("vesin", of_vesin)]:
        compared = pairs = 0
        try:
            for system, positions, cell, pbc in systems():
                positions = np.asarray(positions, float)
                for cutoff in CUTOFFS:
                    i, j, shifts, distances, vectors = search(positions, np.asarray(cell, float), pbc, cutoff)
                    order = np.lexsort((*np.transpose(shifts)[::-1], j, i))
                    own = jfpx.find_neighbors(positions, cutoff, cell=cell, pbc=pbc, half=False, distances=True,
                                              vectors=True)
                    same = (np.array_equal(own.pairs, np.array([i, j])[:, order])
                            and np.array_equal(own.shifts, shifts[order])
                            and np.allclose(own.distances, distances[order], rtol=1e-9)
                            and np.allclose(own.vectors, vectors[order], atol=1e-9))
                    compared += 1
                    pairs += len(i)
                    if not same:
                        failed += 1
                        print(f"{name}: {system}, cutoff {cutoff}: DIFFERS: {len(i)} pairs, and {len(own.shifts)}")
        except ImportError:
            print(f"{name}: not installed")
            continue
        libraries += 1
        print(f"{name}: {compared} cases with {pairs} pairs compared")
    if libraries < arguments.require:
        print(f"only {libraries} libraries are installed; {arguments.require} are required")
    return 1 if failed or libraries < arguments.require else 0


if __name__ == "__main__":
    sys.exit(main())

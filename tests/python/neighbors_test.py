"""Neighbor lists in cells of any shape, against a loop over images in float64."""

import itertools
import subprocess
import sys

import numpy as np
import pytest

import jfpx

EYE = np.eye(3)


def brute_force(positions, cutoff, cell, pbc, half, r_min=0.0):
    """Rows (i, j, shift) in order, and their vectors. Positions and cells are multiples of 1/8, so that
    all sums and squares are exact in both types."""
    positions, cell = positions.astype(np.float64), np.where(np.reshape(pbc, (3, 1)), cell, 0.0)
    # A shift along a vector is that of the coordinates along it, up to cutoff / height.
    duals = np.linalg.pinv(cell).T
    coordinates = positions @ duals.T
    spread = np.ptp(coordinates, axis=0) if len(positions) else np.zeros(3)
    reach = np.ceil(spread + (cutoff + 1e-6) * np.linalg.norm(duals, axis=1)).astype(int) * np.asarray(pbc)
    rows, vectors = [], []
    for shift in itertools.product(*(range(-r, r + 1) for r in reach)):
        delta = positions[None, :] - positions[:, None] + np.array(shift) @ cell
        distance = np.sqrt((delta**2).sum(axis=-1))
        near = (distance <= cutoff) & (distance >= r_min)
        if not any(shift):
            np.fill_diagonal(near, False)
        for i, j in np.argwhere(near):
            if not half or i < j or (i == j and shift > (0, 0, 0)):
                rows.append((i, j, *shift))
                vectors.append(delta[i, j])
    order = sorted(range(len(rows)), key=rows.__getitem__)
    return (np.array([rows[k] for k in order], int).reshape(-1, 5),
            np.array([vectors[k] for k in order]).reshape(-1, 3))


def random_cell(rng, skew):
    cell = np.round((rng.uniform(-1, 1, (3, 3)) + 3 * EYE) * 8) / 8
    cell[1] /= 2
    cell[2] += skew * cell[1]
    return np.round(cell * 8) / 8


@pytest.mark.parametrize("pbc", list(itertools.product([False, True], repeat=3)))
@pytest.mark.parametrize("skew", [0, 2])
def test_neighbors_equal_brute_force(rng, dtype, pbc, skew):
    for n, side, cutoff in [(0, 1, 1.0), (1, 1, 3.0), (20, 4, 1.25), (8, 2, 2.5)]:
        cell = random_cell(rng, skew)
        positions = (rng.integers(-8 * side, 8 * side, (n, 3)) / 8).astype(dtype)
        for half, r_min in [(True, 0.0), (False, 0.0), (False, 1.0)]:
            rows, vectors = brute_force(positions, cutoff, cell, pbc, half, r_min)
            found = jfpx.find_neighbors(positions, cutoff, cell=cell, pbc=pbc, half=half, r_min=r_min,
                                        distances=True, vectors=True, threads=0)
            np.testing.assert_array_equal(found.pairs, rows[:, :2].T)
            np.testing.assert_array_equal(found.shifts, rows[:, 2:])
            np.testing.assert_array_equal(found.vectors, vectors.astype(dtype))
            np.testing.assert_array_equal(found.distances, np.sqrt((found.vectors**2).sum(axis=1)))
            assert found.vectors.dtype == found.distances.dtype == dtype
            assert found.pairs.dtype == found.shifts.dtype == np.int32


def test_neighbors_in_an_orthogonal_cell_are_the_pairs_of_find_pairs(rng, dtype):
    lengths = (2.0, 1.5, 3.0)
    positions = rng.uniform(-20, 20, (2000, 3)).astype(dtype)
    for half in (True, False):
        pairs, shifts = jfpx.find_pairs(positions, 0.3, periodic=lengths, half=half)
        found = jfpx.find_neighbors(positions, dtype.type(0.3), cell=lengths, half=half)
        np.testing.assert_array_equal(found.pairs, pairs)
        np.testing.assert_array_equal(found.shifts, shifts)
    pairs = jfpx.find_pairs(positions, 2.0)
    found = jfpx.find_neighbors(positions, 2.0, index_dtype="int64")
    np.testing.assert_array_equal(found.pairs, pairs)
    assert found.pairs.dtype == np.int64 and not found.shifts.any()
    assert found.distances is None and found.vectors is None


def test_shifts_follow_a_point_that_moves_by_cell_vectors(rng):
    cell = random_cell(rng, 2)
    positions = rng.integers(0, 40, (200, 3)) / 8
    moved = rng.integers(-500, 500, (200, 3))
    first = jfpx.find_neighbors(positions, 1.5, cell=cell, vectors=True)
    second = jfpx.find_neighbors(positions + moved @ cell, 1.5, cell=cell, vectors=True)
    i, j = second.pairs
    shifts = second.shifts + moved[j] - moved[i]
    order = np.lexsort((*shifts.T[::-1], j, i))
    np.testing.assert_array_equal(first.pairs, second.pairs[:, order])
    np.testing.assert_array_equal(first.shifts, shifts[order])
    np.testing.assert_array_equal(first.vectors, second.vectors[order])


def test_vectors_are_rounded_once():
    """Shift 1 in a cell of 10^9: two points that are 0.25 apart through the boundary."""
    length = 1e9 + 2.0**-20
    positions = np.array([[length - 0.125, 0, 0], [0.125, 0, 0]])
    found = jfpx.find_neighbors(positions, 1.0, cell=(length, None, None), distances=True)
    assert found.shifts.tolist() == [[1, 0, 0]] and found.distances.tolist() == [0.125 + length - positions[0, 0]]


def random_systems(rng, dtype):
    """Positions, the number of the system of each, and the cells and flags of the systems; some have no points."""
    sizes = rng.integers(0, 9, 24) * rng.integers(0, 3, 24)
    sizes[[5, 11]] = 0, 300
    numbers = np.repeat(np.arange(24), sizes)
    cells = np.stack([random_cell(rng, k % 3) for k in range(24)])
    pbc = rng.random((24, 3)) < 0.7
    return rng.uniform(-5, 5, (len(numbers), 3)).astype(dtype), numbers, cells, pbc


def loop_over_systems(positions, numbers, cells, pbc, cutoff, **options):
    """The result of a call for each system."""
    parts = []
    for k, cell in enumerate(cells):
        first = np.searchsorted(numbers, k)
        found = jfpx.find_neighbors(positions[numbers == k], cutoff, cell=cell,
                                    pbc=None if pbc is None else pbc[k], **options)
        parts.append(found._replace(pairs=found.pairs + first))
    return jfpx.Neighbors(np.concatenate([part.pairs for part in parts], axis=1),
                          *(np.concatenate([part[k] for part in parts]) for k in range(1, 4)))


def assert_equal(found, expected):
    for name, array, other in zip(found._fields, found, expected):
        np.testing.assert_array_equal(array, other, err_msg=name)


@pytest.mark.parametrize("half", [True, False])
def test_a_batch_has_the_neighbors_of_a_loop(rng, dtype, half):
    positions, numbers, cells, pbc = random_systems(rng, dtype)
    options = dict(half=half, r_min=0.25, distances=True, vectors=True)
    loop = loop_over_systems(positions, numbers, cells, pbc, 1.5, **options)
    assert np.ptp(loop.shifts, axis=0).all() and len(loop.shifts) > 300
    for threads in (1, 3):
        found = jfpx.find_neighbors(positions, 1.5, cell=cells, pbc=pbc, batch=numbers, threads=threads, **options)
        assert_equal(found, loop)
        assert found.pairs.dtype == np.int32 and found.vectors.dtype == dtype
    offsets = np.append(0, np.bincount(numbers, minlength=24).cumsum())
    assert_equal(jfpx.find_neighbors(positions, 1.5, cell=cells, pbc=pbc, batch=offsets, **options), loop)
    # One cell, or the same flags, for all; without a cell; without flags.
    for cell, flags in [(cells[0], pbc), (cells, (True, False, True)), (cells[0], False), (None, None),
                        (cells * pbc[:, :, None], None)]:
        found = jfpx.find_neighbors(positions, 1.5, cell=cell, pbc=flags, batch=numbers, **options)
        assert_equal(found, loop_over_systems(
            positions, numbers, [None] * 24 if cell is None else np.broadcast_to(cell, (24, 3, 3)),
            None if flags is None else np.broadcast_to(flags, (24, 3)), 1.5, **options))


def test_a_batch_takes_the_arrays_of_torch(rng):
    torch = pytest.importorskip("torch")
    arrays = random_systems(rng, np.dtype(np.float32))
    found = jfpx.find_neighbors(torch.from_numpy(arrays[0]), 1.5, batch=torch.from_numpy(arrays[1]),
                                cell=torch.from_numpy(arrays[2]), pbc=torch.from_numpy(arrays[3]),
                                index_dtype=torch.int64)
    expected = jfpx.find_neighbors(arrays[0], 1.5, batch=arrays[1], cell=arrays[2], pbc=arrays[3])
    assert found.pairs.dtype == torch.int64
    assert_equal(jfpx.Neighbors(found.pairs.numpy(), found.shifts.numpy()), expected)


def test_a_batch_may_be_empty_and_numbers_may_have_gaps(rng):
    for batch, cell in [([], None), (np.empty(0, int), EYE), ([0], None), ([], np.empty((0, 3, 3))), ([0, 0], EYE[None])]:
        found = jfpx.find_neighbors(np.empty((0, 3)), 1.0, cell=cell, batch=batch)
        assert found.pairs.shape == (2, 0) and found.shifts.shape == (0, 3)
    assert jfpx.find_neighbors(np.zeros((1, 3)), 1.0, batch=[0]).pairs.shape == (2, 0)
    found = jfpx.find_neighbors(np.zeros((4, 3)), 1.0, batch=np.array([2, 2, 7, 2**62], np.uint64))
    assert found.pairs.tolist() == [[0], [1]]


@pytest.mark.parametrize("half", [True, False])
def test_radii_and_species_have_the_pairs_of_brute_force(rng, dtype, half):
    matrix = np.array([[1.5, 0, 0.5], [0, 0, 1], [0.5, 1, 0.25]])
    labels = np.array(["H", "O", "Cu"])
    for n, side in [(1, 1), (15, 2), (60, 4)]:
        cell, pbc = random_cell(rng, 1), rng.random(3) < 0.7
        positions = (rng.integers(-8 * side, 8 * side, (n, 3)) / 8).astype(dtype)
        radii, species = rng.integers(0, 9, n) / 8, rng.integers(0, 3, n)
        options = dict(cell=cell, pbc=pbc, half=half)
        all_rows, vectors = brute_force(positions, 2.5, cell, pbc, half)
        i, j = all_rows[:, :2].T
        distances = np.sqrt((vectors**2).sum(axis=1))

        def expect(found, limits):
            rows = all_rows[(distances <= limits) & (limits > 0)]
            np.testing.assert_array_equal(found.pairs, rows[:, :2].T)
            np.testing.assert_array_equal(found.shifts, rows[:, 2:])

        expect(jfpx.find_neighbors(positions, 0, radii=radii.astype(dtype), **options), radii[i] + radii[j])
        expect(jfpx.find_neighbors(positions, 0.5, radii=radii.tolist(), **options), radii[i] + radii[j] + 0.5)
        expect(jfpx.find_neighbors(positions, 0.25, radii=0.75, **options), np.full(len(i), 1.75))
        expect(jfpx.find_neighbors(positions, matrix, species=species, **options), matrix[species[i], species[j]])
        cutoffs = {("H", "H"): 1.5, ("Cu", "H"): 0.5, ("O", "Cu"): 1, ("Cu", "Cu"): 0.25, ("U", "H"): 9}
        expect(jfpx.find_neighbors(positions, cutoffs, species=labels[species], **options),
               matrix[species[i], species[j]])


def test_a_batch_takes_radii_and_species(rng, dtype):
    positions, numbers, cells, pbc = random_systems(rng, dtype)
    species = rng.integers(0, 2, len(numbers))
    matrix = np.array([[1.25, 0.5], [0.5, 0.75]])
    found = jfpx.find_neighbors(positions, matrix, species=species, cell=cells, pbc=pbc, batch=numbers, distances=True)
    largest = jfpx.find_neighbors(positions, 1.25, cell=cells, pbc=pbc, batch=numbers, distances=True)
    kept = largest.distances <= matrix.astype(dtype)[tuple(species[largest.pairs])]
    np.testing.assert_array_equal(found.pairs, largest.pairs[:, kept])
    np.testing.assert_array_equal(found.shifts, largest.shifts[kept])
    found = jfpx.find_neighbors(positions, 0.25, radii=0.5, cell=cells, pbc=pbc, batch=numbers, distances=True)
    np.testing.assert_array_equal(found.pairs, largest.pairs[:, largest.distances <= 1.25])
    for empty in (dict(cutoff=0, radii=np.empty(0, dtype)), dict(cutoff=matrix, species=[]),
                  dict(cutoff={(1, 1): 1}, species=[])):
        assert jfpx.find_neighbors(np.empty((0, 3), dtype), **empty, batch=[]).pairs.shape == (2, 0)


class Atoms:
    """The attributes of an ase.Atoms."""

    def __init__(self, numbers, positions, cell, pbc):
        self.numbers, self.symbols = np.array(numbers), [{1: "H", 8: "O"}[number] for number in numbers]
        self.positions, self.cell, self.pbc = np.array(positions, float), np.array(cell, float), np.array(pbc)


def test_atoms_give_positions_cell_and_flags(rng):
    cell = random_cell(rng, 1)
    atoms = Atoms(rng.choice([1, 8], 30), rng.uniform(-4, 4, (30, 3)), cell, [True, False, True])
    arguments = dict(half=False, distances=True)
    found = jfpx.find_neighbors(atoms, 2, **arguments)
    assert_equal(found, jfpx.find_neighbors(atoms.positions, 2, cell=cell, pbc=atoms.pbc, **arguments))
    assert found.shifts[:, 0].any() and not found.shifts[:, 1].any()
    assert_equal(jfpx.find_neighbors(atoms, 2, pbc=False, **arguments),
                 jfpx.find_neighbors(atoms.positions, 2, cell=cell, pbc=False, **arguments))
    assert_equal(jfpx.find_neighbors(atoms, 2, cell=2 * cell, **arguments),
                 jfpx.find_neighbors(atoms.positions, 2, cell=2 * cell, pbc=atoms.pbc, **arguments))
    rows = (atoms.numbers == 8).astype(int)
    by_matrix = jfpx.find_neighbors(atoms, [[2.0, 1.5], [1.5, 0]], species=rows)
    assert by_matrix.pairs.shape[1] > 10
    for cutoffs in ({("H", "H"): 2, ("O", "H"): 1.5}, {(1, 1): 2, (1, 8): 1.5}):
        assert_equal(jfpx.find_neighbors(atoms, cutoffs), by_matrix)


def test_lists_of_atoms_are_those_of_ase(rng):
    ase = pytest.importorskip("ase")
    from ase.neighborlist import neighbor_list
    for pbc in (True, (True, False, True), False):
        atoms = ase.Atoms("HO" * 20, positions=rng.uniform(-4, 4, (40, 3)), cell=random_cell(rng, 1), pbc=pbc)
        radii = rng.uniform(0.3, 1.2, 40)
        for cutoff, options in [(2.5, {}), ({("H", "H"): 1.1, ("O", "H"): 2.2}, {}), (list(radii), dict(radii=radii))]:
            i, j, shifts, distances = neighbor_list("ijSd", atoms, cutoff)
            order = np.lexsort((*shifts.T[::-1], j, i))
            found = jfpx.find_neighbors(atoms, 0 if options else cutoff, half=False, distances=True, **options)
            np.testing.assert_array_equal(found.pairs, np.array([i, j])[:, order])
            np.testing.assert_array_equal(found.shifts, shifts[order])
            np.testing.assert_allclose(found.distances, distances[order])


def test_cells_have_the_forms_of_other_libraries(rng):
    positions = rng.uniform(0, 2, (50, 3))

    class Cell:  # as that of ASE
        def __array__(self, dtype=None, copy=None):
            return np.diag([2.0, 2.0, 0.0])

    first = jfpx.find_neighbors(positions, 0.5, cell=Cell())
    assert first.shifts[:, 0].any() and not first.shifts[:, 2].any()
    for cell, pbc in [((2, 2, None), None), ([[2, 0, 0], [0, 2, 0], [0, 0, 0]], None),
                      (np.diag([2, 2, 9]), (True, True, False)), ((2, 2, 0), np.array([True, True, False])),
                      (2 * EYE, (1, 1, 0))]:
        found = jfpx.find_neighbors(positions, 0.5, cell=cell, pbc=pbc)
        np.testing.assert_array_equal(found.pairs, first.pairs)
        np.testing.assert_array_equal(found.shifts, first.shifts)
    assert not jfpx.find_neighbors(positions, 0.5, cell=2 * EYE, pbc=False).shifts.any()
    assert not jfpx.find_neighbors(positions, 0.5, cell=np.zeros((3, 3)), pbc=[False] * 3).shifts.any()


def test_neighbors_have_the_kind_of_the_positions():
    found = jfpx.find_neighbors([[0, 0, 0], [1, 0, 0]], 1, distances=True)
    assert isinstance(found, jfpx.Neighbors)
    assert found.pairs.tolist() == [[0], [1]] and found.distances.tolist() == [1]
    torch = pytest.importorskip("torch")
    found = jfpx.find_neighbors(torch.rand(5, 3), 2, cell=torch.eye(3), vectors=True)
    assert all(torch.is_tensor(array) for array in (found.pairs, found.shifts, found.vectors))


@pytest.mark.parametrize("arguments, message", [
    (dict(batch=[0, 1, 0, 1]), "batch does not ascend; sort the points by it"),
    (dict(batch=[0, 0, 1]), "batch has 3 elements; it must have the number of the system of each of 4 points"),
    (dict(batch=[0, 0, 2, 4]), "append 4 to offsets of systems, or number the systems without gaps"),
    (dict(batch=[-1, 0, 0, 0]), "batch contains -1"),
    (dict(batch=[0.0, 0, 0, 0]), "batch has .* dtype float64"),
    (dict(batch=[[0, 0, 0, 0]]), r"batch has shape \(1, 4\)"),
    (dict(batch=[0, 3, 1, 1, 4]), "offset 2 is 1"),
    (dict(batch=[0, 0, 1, 1], cell=[EYE]), "batch has the system 1, and there are cells of 1 systems"),
    (dict(batch=[0, 2, 4], cell=[EYE] * 3), "there are 3 periodic cells; there must be one for each of 2 systems"),
    (dict(batch=[0, 0, 1, 1], cell=[EYE, 0 * EYE], pbc=True), "system 1: cell vector 0 is zero"),
    (dict(batch=[0, 0, 1, 1], cell=[EYE] * 2, pbc=[[True] * 3] * 3), "cell has 2 systems, and pbc 3"),
    (dict(cell=[EYE]), r"cell has shape \(1, 3, 3\); it must be \(3, 3\)"),
    (dict(batch=[0, 0, 1, 1], cell=[[1, 1, 1], [2, 2, 2]]), r"cell has shape \(2, 3\); .* or \(systems, 3, 3\)"),
    (dict(cutoff=np.ones(4)), r"cutoff has shape \(4,\); .* radii of the points are the argument radii"),
    (dict(cutoff=EYE), "cutoff is a matrix, and there are no species"),
    (dict(cutoff=EYE[:2], species=[0, 1, 0, 1]), r"cutoff has shape \(2, 3\)"),
    (dict(cutoff=EYE, species=[0, 1]), r"species has shape \(2,\) .*; it must be integers \(4,\)"),
    (dict(cutoff=EYE, species=[0.0, 1, 0, 1]), "species has .* dtype float64"),
    (dict(cutoff=EYE, species=[0, 1, 0, 3]), r"species contains 3; it must be in \[0, 2\]"),
    (dict(cutoff=EYE, species=[0, 1, 0, -1]), "species contains -1"),
    (dict(cutoff=[[0, 1], [2, 0]], species=[0, 0, 1, 1]), "cutoff of species 0 and 1 is 1, and in the other order 2"),
    (dict(cutoff=[[0, -1], [-1, 0]], species=[0, 0, 1, 1]), "cutoff of species 0 and 1 is -1"),
    (dict(cutoff=EYE, species=[0] * 4, radii=1), "radii and species exclude each other"),
    (dict(species=[0] * 4), "with species, it must be a matrix"),
    (dict(cutoff={(1, 1): 1}), "cutoff is a dict, and there are no species"),
    (dict(cutoff={1: 1}, species=[1] * 4), "cutoff has the key 1; it must be a pair of species"),
    (dict(cutoff={(1, 1): "far"}, species=[1] * 4), r"cutoff of \(1, 1\) is 'far'"),
    (dict(cutoff={(1, 2): 1, (2, 1): 2}, species=[1, 2] * 2), r"cutoff of \(2, 1\) is 2, and in the other order 1"),
    (dict(cutoff=0, radii=[1, 1, 1, -1]), "radius 3 is -1; it must be 0, or from"),
    (dict(cutoff=0, radii=np.ones(3)), r"radii has shape \(3,\)"),
    (dict(cutoff=-1, radii=1), "cutoff is -1; it must be 0, or from"),
    (dict(cell=EYE, pbc=[[True] * 3]), r"pbc has shape \(1, 3\)"),
    (dict(cell=EYE, pbc=[True, [True]]), r"pbc is \[True, \[True\]\]"),
    (dict(cell=np.eye(2)), r"cell has shape \(2, 2\); it must be \(3, 3\)"),
    (dict(cell=[1, 2, 3, 90, 90, 90]), r"cell has shape \(6,\)"),
    (dict(cell=(True, True, True)), "cell is not an array of numbers: it has bool"),
    (dict(cell="cubic"), "cell"),
    (dict(cell=(1, None, "x")), "cell is 'x'; it must be a number"),
    (dict(cell=np.diag([1, 0, 1]), pbc=True), "cell vector 1 is zero"),
    (dict(cell=np.full((3, 3), np.nan)), "cell vector 0: x is nan"),
    (dict(cell=np.ones((3, 3))), "linearly dependent"),
    (dict(pbc=True), "pbc is True, and there is no cell"),
    (dict(cell=EYE, pbc=(10, 10, 10)), r"pbc is \(10, 10, 10\); it must be a bool or three bools"),
    (dict(cell=EYE, pbc=(True, False)), "pbc has 2 flags"),
    (dict(cutoff=0), "cutoff is 0; it must be from"),
    (dict(cutoff=-1), "cutoff is -1"),
    (dict(cutoff="far"), "cutoff is 'far'"),
    (dict(r_min=2), "least distance is 2"),
    (dict(positions=np.full((1, 3), np.inf)), "point 0: x is inf"),
    (dict(positions=np.full((1, 3), 1e7), cell=EYE), "within 2\\^22 cells"),
    (dict(positions=np.zeros((3, 2))), r"positions has shape \(3, 2\)"),
    (dict(threads=300), "threads is 300"),
    (dict(index_dtype="int8"), "index_dtype is 'int8'"),
])
def test_bad_input_of_find_neighbors_is_a_named_exception(arguments, message):
    arguments = {"positions": np.zeros((4, 3)), "cutoff": 1.0, **arguments}
    with pytest.raises(jfpx.InvalidArgument, match=message):
        jfpx.find_neighbors(**arguments)


def test_a_matrix_as_periodic_names_find_neighbors():
    with pytest.raises(jfpx.InvalidArgument, match=r"find_neighbors\(cell=\)"):
        jfpx.find_pairs(np.zeros((4, 3)), 1.0, periodic=EYE)


def test_ctrl_c_ends_a_search_for_neighbors():
    # Alone, the search takes minutes: almost all distances are between 0 and r_min.
    code = """
import os, signal, threading
import numpy as np, jfpx
points = np.random.default_rng(1).normal(size=(500_000, 3))
points /= np.linalg.norm(points, axis=1)[:, None]
try:
    threading.Timer(0.5, os.kill, (os.getpid(), signal.SIGINT)).start()
    jfpx.find_neighbors(points, 2.0, r_min=1.9999999)
except KeyboardInterrupt:
    print("KeyboardInterrupt")
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=100)
    assert done.stdout == "KeyboardInterrupt\n", done.stderr

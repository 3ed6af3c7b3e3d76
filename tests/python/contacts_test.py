"""Contacts and pairs, against brute force in float64."""

import gc
import pickle
import resource
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

import jfpx
from oracle import check_pairs, half_pairs, pairs_of, touching


def random_spheres(rng, n, dtype, contacts=6):
    """Spheres of different radii, of which each touches some others."""
    side = (n * 4.2 / contacts) ** (1 / 3)
    return (rng.random((n, 3)) * side).astype(dtype), rng.uniform(0.2, 0.8, n).astype(dtype)


@pytest.mark.parametrize("n", [0, 1, 2, 50, 700])
def test_contacts_equal_brute_force(rng, dtype, n):
    positions, radii = random_spheres(rng, n, dtype)
    contacts = jfpx.find_contacts(positions, radii)
    check_pairs(contacts.pairs, *half_pairs(positions, radii))
    a, b = contacts.pairs
    assert contacts.pairs.dtype == np.int32
    assert contacts.normal.dtype == contacts.distance.dtype == dtype
    delta = positions[a].astype(np.float64) - positions[b]
    length = np.linalg.norm(delta, axis=1)
    tolerance = 32 * np.finfo(dtype).eps
    np.testing.assert_allclose(contacts.normal, delta / length[:, None], atol=tolerance * 16)
    np.testing.assert_allclose(contacts.distance, length - radii[a] - radii[b],
                               atol=tolerance * max(1, np.abs(positions).max(initial=0)))
    assert (contacts.distance <= 0).all()


def test_one_radius_for_all_equals_an_array_of_it(rng, dtype):
    positions, _ = random_spheres(rng, 300, dtype)
    one = jfpx.find_contacts(positions, 0.4)
    many = jfpx.find_contacts(positions, np.full(300, 0.4, dtype))
    assert len(one.distance) > 0
    for x, y in zip(one, many):
        assert x.tobytes() == y.tobytes()


def test_threads_and_algorithms_have_the_same_bits(rng, dtype):
    positions, radii = random_spheres(rng, 3000, dtype)
    expected = jfpx.find_contacts(positions, radii)
    for algorithm in ("all_pairs", "grid"):
        for threads in (1, 3, 0):
            collider = jfpx.SphereCollider(dtype, backend="cpu", algorithm=algorithm,
                                           threads=threads)
            for x, y in zip(expected, collider.find_contacts(positions, radii)):
                assert x.tobytes() == y.tobytes()
            assert collider.algorithm == algorithm.replace("_", " ")
            assert collider.backend == "cpu"
    assert jfpx.SphereCollider(algorithm="auto").algorithm == "automatic"


def test_cutoff_is_inclusive_and_exact(dtype):
    cutoff = dtype.type(0.3)
    points = np.zeros((3, 3), dtype)
    points[1, 0] = cutoff
    points[2, 1] = np.nextafter(cutoff, dtype.type(1))
    assert jfpx.find_pairs(points, cutoff).tolist() == [[0], [1]]


def test_pairs_equal_brute_force(rng, dtype):
    positions, radii = random_spheres(rng, 600, dtype)
    check_pairs(jfpx.find_pairs(positions, 0.9), *half_pairs(positions, 0.45))
    check_pairs(jfpx.find_pairs(positions, radii=radii), *half_pairs(positions, radii))


def test_full_list_has_each_pair_in_both_orders(rng, dtype):
    positions, radii = random_spheres(rng, 400, dtype)
    half = jfpx.find_contacts(positions, radii)
    full = jfpx.find_contacts(positions, radii, half=False)
    pairs = list(zip(*half.pairs.tolist()))
    expected = {pair: (n, d) for pair, n, d in zip(pairs, half.normal, half.distance)}
    expected |= {(b, a): (-n, d) for (a, b), (n, d) in expected.items()}
    assert list(zip(*full.pairs.tolist())) == sorted(expected)
    for pair, normal, distance in zip(zip(*full.pairs.tolist()), full.normal, full.distance):
        np.testing.assert_array_equal(normal, expected[pair][0])
        assert distance == expected[pair][1]


@pytest.mark.parametrize("half", [True, False])
def test_rows_are_the_pairs(rng, dtype, half):
    positions, radii = random_spheres(rng, 400, dtype)
    contacts = jfpx.find_contacts(positions, radii, half=half)
    rows = jfpx.find_contacts(positions, radii, half=half, output="csr")
    assert rows.offsets.dtype == np.int64 and len(rows.offsets) == 401
    np.testing.assert_array_equal(np.repeat(np.arange(400), np.diff(rows.offsets)),
                                  contacts.pairs[0])
    np.testing.assert_array_equal(rows.columns, contacts.pairs[1])
    np.testing.assert_array_equal(rows.normal, contacts.normal)
    np.testing.assert_array_equal(rows.distance, contacts.distance)
    alone = jfpx.find_pairs(positions, radii=radii, half=half, output="csr")
    np.testing.assert_array_equal(alone.offsets, rows.offsets)
    np.testing.assert_array_equal(alone.columns, rows.columns)


def test_query_finds_pairs_of_both_sets_only(rng, dtype):
    positions, radii = random_spheres(rng, 500, dtype)
    query, query_radii = random_spheres(rng, 80, dtype)
    found = jfpx.find_pairs(positions, radii=radii, query=query, query_radii=query_radii)
    touch, decided = touching(query, query_radii, positions, radii)
    check_pairs(found, pairs_of(touch & decided), pairs_of(~decided))
    rows = jfpx.find_pairs(positions, 0.7, query=query, output="csr")
    assert len(rows.offsets) == 81
    found = np.stack([np.repeat(np.arange(80), np.diff(rows.offsets)), rows.columns])
    touch, decided = touching(query, 0.35, positions, 0.35)
    check_pairs(found, pairs_of(touch & decided), pairs_of(~decided))


def test_systems_of_a_batch_are_independent(rng, dtype):
    positions, radii = random_spheres(rng, 300, dtype)
    batch = np.array([0, 100, 100, 101, 300])
    found = jfpx.find_contacts(positions, radii, batch=batch)
    expected = [jfpx.find_contacts(positions[i:j], radii[i:j]) for i, j in zip(batch, batch[1:])]
    np.testing.assert_array_equal(
        found.pairs, np.concatenate([e.pairs + i for e, i in zip(expected, batch)], axis=1))
    np.testing.assert_array_equal(found.normal, np.concatenate([e.normal for e in expected]))
    assert found.pairs.shape[1] > 0


def test_periodic_pairs_are_those_of_the_nearest_images(rng, dtype):
    lengths = np.array([6, 7.5, 5])
    positions = (rng.random((300, 3)) * 3 * lengths - lengths).astype(dtype)
    delta = positions[:, None].astype(np.float64) - positions[None]
    for axes in ((True, True, True), (True, False, False)):
        cell = [length if on else None for length, on in zip(lengths, axes)]
        cells = np.where(axes, np.round(delta / lengths), 0)
        gap = np.linalg.norm(delta - cells * lengths, axis=2) - 1.5
        upper = np.triu(np.ones((300, 300), bool), 1)
        decided = np.abs(gap) > 1e-4
        found = jfpx.find_pairs(positions, 1.5, periodic=cell)
        check_pairs(found.pairs, pairs_of((gap < 0) & decided & upper), pairs_of(~decided & upper))
        a, b = found.pairs
        assert len(a) > 100 and found.shifts.any()
        np.testing.assert_array_equal(found.shifts, cells[a, b])
        contacts = jfpx.find_contacts(positions, 0.75, periodic=cell)
        np.testing.assert_array_equal(contacts.pairs, found.pairs)
        np.testing.assert_allclose(contacts.distance, gap[a, b], atol=1e-4)
        moved = positions[b] + contacts.shifts * lengths
        direction = positions[a] - moved
        direction /= np.linalg.norm(direction, axis=1, keepdims=True)
        np.testing.assert_allclose(contacts.normal, direction, atol=2e-3)
        rows = jfpx.find_pairs(positions, 1.5, periodic=cell, half=False, output="csr")
        assert len(rows.columns) == 2 * len(a) and rows.shifts.sum() == 0
        row = np.repeat(np.arange(300), np.diff(rows.offsets))
        np.testing.assert_array_equal(rows.shifts, cells[row, rows.columns])


def test_periodic_pairs_of_a_query_are_those_of_both_sets(rng, dtype):
    cell = (6, None, 5)
    positions = (rng.random((300, 3)) * 15 - 5).astype(dtype)
    all_pairs = jfpx.find_pairs(positions, 1.5, periodic=cell)
    between = (all_pairs.pairs[0] < 80) & (all_pairs.pairs[1] >= 80)
    found = jfpx.find_pairs(positions[80:], 1.5, query=positions[:80], periodic=cell)
    np.testing.assert_array_equal(found.pairs, all_pairs.pairs[:, between] - [[0], [80]])
    np.testing.assert_array_equal(found.shifts, all_pairs.shifts[between])
    assert len(found.shifts) > 50
    rows = jfpx.find_pairs(positions[80:], 1.5, query=positions[:80], periodic=cell, output="csr")
    np.testing.assert_array_equal(rows.columns, found.pairs[1])
    np.testing.assert_array_equal(np.repeat(np.arange(80), np.diff(rows.offsets)), found.pairs[0])


@pytest.mark.parametrize("cells", [[[6, None, 5], [4, 5, 6], [9, 9, 9]], [6, 7, None]])
def test_periodic_systems_have_the_pairs_of_their_cells(rng, dtype, cells):
    offsets = [0, 100, 100, 300]
    positions = (rng.random((300, 3)) * 15 - 5).astype(dtype)
    found = jfpx.find_pairs(positions, 1.5, batch=offsets, periodic=cells)
    expected = [jfpx.find_pairs(positions[begin:end], 1.5, periodic=cell) for begin, end, cell in zip(
        offsets, offsets[1:], cells if isinstance(cells[0], list) else [cells] * 3)]
    np.testing.assert_array_equal(found.pairs, np.concatenate(
        [system.pairs + begin for system, begin in zip(expected, offsets)], axis=1))
    np.testing.assert_array_equal(found.shifts, np.concatenate([s.shifts for s in expected]))
    rows = jfpx.find_contacts(positions, 0.75, batch=offsets, periodic=cells, half=False, output="csr")
    assert len(rows.columns) == 2 * len(found.shifts) > 200


def test_strided_arrays_are_taken(rng, dtype):
    positions, radii = random_spheres(rng, 200, dtype)
    expected = jfpx.find_contacts(positions, radii)
    wide = np.zeros((200, 5), dtype)
    wide[:, 1:4] = positions
    record = np.zeros(200, [("tag", "i1"), ("x", dtype, 3)])
    record["x"] = positions
    for same in (wide[:, 1:4], np.asfortranarray(positions), record["x"],
                 np.ascontiguousarray(positions[::-1])[::-1]):
        got = jfpx.find_contacts(same, np.repeat(radii, 3)[::3])
        np.testing.assert_array_equal(got.pairs, expected.pairs)
        np.testing.assert_array_equal(got.distance, expected.distance)


def test_read_only_arrays_and_lists_are_taken(rng, dtype):
    positions, radii = random_spheres(rng, 60, dtype)
    expected = jfpx.find_contacts(positions, radii)
    positions.flags.writeable = False
    np.testing.assert_array_equal(jfpx.find_contacts(positions, radii).pairs, expected.pairs)
    listed = jfpx.find_contacts([[0, 0, 0], [1.5, 0, 0], [0, 3, 0]], [1, 1, 1])
    assert listed.pairs.tolist() == [[0], [1]]
    assert listed.normal.tolist() == [[-1, 0, 0]] and listed.distance.tolist() == [-0.5]


class OnlyDlpack:
    """An array of another library, which has DLPack alone."""

    def __init__(self, array):
        self._array = array

    def __dlpack__(self, **options):
        return self._array.__dlpack__(**options)

    def __dlpack_device__(self):
        return self._array.__dlpack_device__()


def test_arrays_with_dlpack_are_taken(rng, dtype):
    positions, radii = random_spheres(rng, 100, dtype)
    expected = jfpx.find_contacts(positions, radii)
    got = jfpx.find_contacts(OnlyDlpack(positions), OnlyDlpack(radii))
    np.testing.assert_array_equal(got.pairs, expected.pairs)
    assert expected.pairs.shape[1] > 0


def test_results_of_torch_are_tensors(rng, dtype):
    torch = pytest.importorskip("torch")
    positions, radii = random_spheres(rng, 100, dtype)
    expected = jfpx.find_contacts(positions, radii)
    tensor = torch.from_numpy(positions).requires_grad_()
    got = jfpx.find_contacts(tensor, torch.from_numpy(radii), index_dtype="int64")
    assert all(isinstance(part, torch.Tensor) for part in got)
    assert got.pairs.dtype == torch.int64
    np.testing.assert_array_equal(got.pairs.numpy(), expected.pairs)


def test_out_receives_the_contacts(rng, dtype):
    positions, radii = random_spheres(rng, 200, dtype)
    expected = jfpx.find_contacts(positions, radii)
    size = len(expected.distance)
    collider = jfpx.SphereCollider(dtype)
    for index in (np.int32, np.int64):
        out = jfpx.Contacts(np.full((2, size + 3), -1, index), np.zeros((size + 3, 3), dtype),
                            np.zeros(size + 3, dtype))
        assert collider.find_contacts(positions, radii, out=out) == size
        np.testing.assert_array_equal(out.pairs[:, :size], expected.pairs)
        np.testing.assert_array_equal(out.normal[:size], expected.normal)
        np.testing.assert_array_equal(out.distance[:size], expected.distance)
        assert (out.pairs[:, size:] == -1).all()
        pairs = np.full((2, size), -1, index)
        assert collider.find_pairs(positions, radii=radii, out=pairs) == size
        np.testing.assert_array_equal(pairs, expected.pairs)


def test_out_receives_the_contacts_of_a_periodic_cell(rng, dtype):
    positions = (rng.random((400, 3)) * 20).astype(dtype)
    collider = jfpx.SphereCollider(dtype)
    for options in ({}, {"half": False}, {"batch": [0, 150, 400]}):
        options["periodic"] = (9, None, 7)
        expected = jfpx.find_contacts(positions, 0.7, **options)
        size = len(expected.distance)
        out = jfpx.PeriodicContacts(np.full((2, size + 3), -1, np.int64), np.zeros((size + 3, 3), dtype),
                                    np.zeros(size + 4, dtype), np.full((size + 3, 3), -9, np.int32))
        assert collider.find_contacts(positions, 0.7, out=out, **options) == size > 0
        for got, wanted in zip((out.pairs.T, *out[1:]), (expected.pairs.T, *expected[1:])):
            np.testing.assert_array_equal(got[:size], wanted)
        assert (out.pairs[:, size:] == -1).all() and (out.shifts[size:] == -9).all()
        pairs = jfpx.PeriodicPairs(np.zeros((2, size), np.int32), np.zeros((size, 3), np.int32))
        assert collider.find_pairs(positions, 1.4, out=pairs, **options) == size
        np.testing.assert_array_equal(pairs.pairs, expected.pairs)
        np.testing.assert_array_equal(pairs.shifts, expected.shifts)
        with pytest.raises(jfpx.InvalidArgument, match=r"out.shifts has shape \(0, 3\).*room for"):
            collider.find_pairs(positions, 1.4, out=(pairs.pairs, pairs.shifts[:0]), **options)


def test_an_out_that_is_too_small_is_an_error_with_the_size(dtype):
    collider = jfpx.SphereCollider(dtype)
    points = np.zeros((4, 3), dtype)
    with pytest.raises(jfpx.InvalidArgument, match=r"out has shape \(2, 5\).*room for \(2, 6\)"):
        collider.find_pairs(points, 1, out=np.zeros((2, 5), np.int32))
    with pytest.raises(jfpx.InvalidArgument, match="out has dtype int16"):
        collider.find_pairs(points, 1, out=np.zeros((2, 6), np.int16))
    with pytest.raises(jfpx.InvalidArgument, match="out is list"):
        collider.find_pairs(points, 1, out=[[0] * 6] * 2)
    target = np.zeros((2, 6), np.int32)
    target.flags.writeable = False
    with pytest.raises(jfpx.InvalidArgument, match="out is read-only"):
        collider.find_pairs(points, 1, out=target)
    with pytest.raises(jfpx.InvalidArgument, match="out requires output='coo'"):
        collider.find_pairs(points, 1, out=target, output="csr")


POINTS = np.zeros((3, 3), np.float32)
NAN = np.array([[0, 0, 0], [0, np.nan, 0]], np.float32)


@pytest.mark.parametrize("call, message", [
    (lambda: jfpx.find_contacts(np.zeros(3, np.float32), 1), r"positions has shape \(3,\)"),
    (lambda: jfpx.find_contacts(np.zeros((3, 2), np.float32), 1), r"positions has shape \(3, 2\)"),
    (lambda: jfpx.find_contacts(POINTS.astype(int), 1), "positions has dtype int64"),
    (lambda: jfpx.find_contacts(POINTS.astype(np.float16), 1), "positions has dtype float16"),
    (lambda: jfpx.find_contacts("three points", 1), "positions is not an array of numbers"),
    (lambda: jfpx.find_contacts(NAN, 1), "sphere 1: centre.y is nan"),
    (lambda: jfpx.find_contacts(POINTS, -1), "sphere 0: radius is -1; it must be finite and > 0"),
    (lambda: jfpx.find_contacts(POINTS, 0), "radius is 0"),
    (lambda: jfpx.find_contacts(POINTS, float("inf")), "radius is inf"),
    (lambda: jfpx.find_contacts(POINTS, np.ones(2, np.float32)), r"radii has shape \(2,\)"),
    (lambda: jfpx.find_contacts(POINTS, np.ones(3)), "radii has dtype float64"),
    (lambda: jfpx.find_contacts(POINTS, "big"), "radii is not an array of numbers"),
    (lambda: jfpx.find_contacts(POINTS, 1, output="dense"), "output is 'dense'"),
    (lambda: jfpx.find_contacts(POINTS, 1, index_dtype="int16"), "index_dtype is 'int16'"),
    (lambda: jfpx.find_contacts(POINTS, 1, index_dtype="number"), "index_dtype is 'number'"),
    (lambda: jfpx.find_contacts(POINTS, 1, threads=257), "threads is 257"),
    (lambda: jfpx.find_contacts(POINTS, 1, threads=1.5), "threads is 1.5; it must be an integer"),
    (lambda: jfpx.find_contacts(POINTS, 1, device="cuda"), "positions are in host memory"),
    (lambda: jfpx.find_contacts(POINTS, 1, batch=[0, 2]), "the last offset is 2"),
    (lambda: jfpx.find_contacts(POINTS, 1, batch=[0, 2, 1, 3]), "offset 2 is 1"),
    (lambda: jfpx.find_contacts(POINTS, 1, batch=[1, 3]), "offsets must begin with 0"),
    (lambda: jfpx.find_contacts(POINTS, 1, batch=[0, -1, 3]), "batch contains -1"),
    (lambda: jfpx.find_contacts(POINTS, 1, batch=[0.0, 3.0]), "batch has .* dtype float64"),
    (lambda: jfpx.find_pairs(POINTS), "either cutoff or radii"),
    (lambda: jfpx.find_pairs(POINTS, 1, radii=1), "either cutoff or radii"),
    (lambda: jfpx.find_pairs(POINTS, -1), "cutoff is -1; it must be finite and > 0"),
    (lambda: jfpx.find_pairs(POINTS, 1e-45), "cutoff is 1e-45"),
    (lambda: jfpx.find_pairs(POINTS, float("nan")), "cutoff is nan"),
    (lambda: jfpx.find_pairs(POINTS, 1e300), "cutoff is 1e\\+300"),
    (lambda: jfpx.find_pairs(POINTS, "near"), "cutoff is 'near'"),
    (lambda: jfpx.find_pairs(POINTS, "0.5"), "cutoff is '0.5'; it must be a number"),
    (lambda: jfpx.find_pairs(POINTS, True), "cutoff is True; it must be a number"),
    (lambda: jfpx.find_contacts(POINTS, True), "radii is not an array of numbers: it has bool"),
    (lambda: jfpx.find_pairs(POINTS, 1e20), "cutoff is 1e\\+20, and the square of the distance 1e\\+20 is not exact"),
    (lambda: jfpx.find_pairs(POINTS, 1e-20), "not exact in float32; use a unit of length"),
    (lambda: jfpx.find_pairs(POINTS.astype(float), 1e160), "not exact in float64"),
    (lambda: jfpx.find_contacts(POINTS, np.array([1, 1e-30, 1e-30], np.float32)), "radii has the radius 1e-30"),
    (lambda: jfpx.find_contacts(np.ma.masked_less(POINTS, 1), 1), "positions has masked elements"),
    (lambda: jfpx.find_pairs(POINTS, 1, batch=[0, 0, 1]), r"an element for each of 3 points; .*bincount\(batch\)"),
    (lambda: jfpx.find_pairs(POINTS, 1, periodic=(True, True, False)), r"periodic is \(True, True, False\); .* lengths"),
    (lambda: jfpx.find_pairs(POINTS, 1, periodic=np.diag([9, 9, 9])), r"periodic is a matrix; .* periodic.diagonal\(\)"),
    (lambda: jfpx.find_pairs(POINTS, 1, periodic=[[9, 0, 0], [0, 9, 0], [0, 0, 9]]), "periodic is a matrix"),
    (lambda: jfpx.find_pairs(POINTS, 1, periodic=np.array([[9, 1, 1], [1, 9, 1], [1, 1, 9]]), batch=[0, 1, 2, 3]),
     "periodic is a matrix; it must be a row"),
    (lambda: jfpx.find_pairs(POINTS, 1, periodic=np.array(9.0)), "it must be three lengths"),
    (lambda: jfpx.find_pairs(POINTS, 1, periodic=[(9, 9, 9), None], batch=[0, 1, 3]), "the cell None"),
    (lambda: jfpx.find_pairs(POINTS, 1, periodic=[10**400] * 3), "periodic length x is inf"),
    (lambda: jfpx.find_pairs(POINTS, 10**400), "must be finite and > 0"),
    (lambda: jfpx.find_contacts(POINTS, 10**400), "radius is inf"),
    (lambda: jfpx.find_contacts(POINTS, ["1"] * 3), "radii is not an array of numbers"),
    (lambda: jfpx.find_contacts(POINTS, [True] * 3), "radii is not an array of numbers"),
    (lambda: jfpx.find_contacts(POINTS, np.array(True)), "radii has dtype bool"),
    (lambda: jfpx.find_pairs(POINTS, np.array(True)), "it must be a number"),
    (lambda: jfpx.find_pairs(POINTS, 1, query=POINTS[0]), r"query has shape \(3,\)"),
    (lambda: jfpx.find_pairs(POINTS, 1, query=POINTS.astype(float)), "query has dtype float64"),
    (lambda: jfpx.find_pairs(POINTS, 1, query=POINTS, query_radii=1), "query_radii requires radii"),
    (lambda: jfpx.find_pairs(POINTS, radii=1, query=POINTS), "query and query_radii"),
    (lambda: jfpx.find_pairs(POINTS, 1, query=POINTS, batch=[0, 3]), "exclude each other"),
    (lambda: jfpx.find_pairs(POINTS, 1, periodic=1), "periodic is 1; it must be three lengths"),
    (lambda: jfpx.find_pairs(POINTS, 1, periodic=[1, 2]), "periodic has 2 lengths"),
    (lambda: jfpx.find_pairs(POINTS, 1, periodic=[9, "a", 9]), "periodic is 'a'"),
    (lambda: jfpx.find_pairs(POINTS, 1, periodic=[9, 0, 9]), r"periodic is \(9, 0, 9\); .* None along axes"),
    (lambda: jfpx.find_pairs(POINTS, 1, periodic=[9, 9, 1.5]), "at least twice the cutoff, which is 1"),
    (lambda: jfpx.find_pairs(POINTS, 1, periodic=[[9, 9, 9]] * 3, batch=[0, 3]), "periodic has 3 cells"),
    (lambda: jfpx.find_pairs(POINTS, 1, periodic=[[9, 9]], batch=[0, 3]), "periodic has 2 lengths"),
    (lambda: jfpx.find_pairs(POINTS, 1, periodic=[9, 9, 1.5], batch=[0, 1, 3]), "system 0: .* twice the cutoff"),
    (lambda: jfpx.SphereCollider().find_pairs(POINTS, 1, periodic=[9, 9, 9],
                                              out=np.zeros((2, 9), np.int32)),
     "out is ndarray; it must be a tuple of 2 arrays: pairs, shifts"),
    (lambda: jfpx.SphereCollider("float16"), "dtype is 'float16'"),
    (lambda: jfpx.SphereCollider(backend="gpu"), "backend is 'gpu'"),
    (lambda: jfpx.SphereCollider(backend="x86"), "backend is 'x86'"),
    (lambda: jfpx.SphereCollider(algorithm="fast"), "algorithm is 'fast'"),
    (lambda: jfpx.SphereCollider(device=-1), "device is -1"),
    (lambda: jfpx.SphereCollider("float64").find_contacts(POINTS, 1), "positions has dtype float32"),
])
@pytest.mark.filterwarnings("error")
def test_bad_input_is_a_named_exception(call, message):
    with pytest.raises(jfpx.InvalidArgument, match=message) as caught:
        call()
    assert isinstance(caught.value, ValueError) and isinstance(caught.value, jfpx.Error)


def test_a_gpu_that_is_missing_is_a_named_exception():
    cuda = next(row for row in jfpx.available_backends() if row["backend"] == "cuda")
    if cuda["usable"]:
        pytest.skip("there is a GPU")
    with pytest.raises(jfpx.BackendUnavailable) as caught:
        jfpx.SphereCollider(backend="cuda")
    assert cuda["reason"] in str(caught.value)


def test_memory_that_is_missing_is_a_named_exception(dtype):
    # In a child, because the limit holds for the whole process.
    code = f"""
import numpy as np, resource, jfpx
points = np.zeros((300_000, 3), "{dtype}")
jfpx.find_pairs(points[:10], 1)
pages = int(open("/proc/self/statm").read().split()[0])
limit = pages * resource.getpagesize() + (300 << 20)
resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
try:
    jfpx.find_pairs(points, 1)
except jfpx.OutOfMemory as error:
    assert isinstance(error, MemoryError)
    assert jfpx.find_pairs(points[:10], 1).shape == (2, 45)
    print("caught")
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stdout == "caught\n", done.stderr


def test_use_from_two_threads_is_a_named_exception(rng):
    positions = rng.random((20_000, 3)).astype(np.float32)
    collider = jfpx.SphereCollider(backend="cpu", algorithm="all_pairs")
    refused, stop = [], threading.Event()

    def search():
        while not stop.is_set():
            try:
                collider.find_pairs(positions, 0.01)
            except jfpx.ConcurrentUse:
                refused.append(True)
                stop.set()

    threads = [threading.Thread(target=search) for _ in range(2)]
    for thread in threads:
        thread.start()
    stop.wait(60)
    stop.set()
    for thread in threads:
        thread.join()
    assert refused
    assert collider.find_pairs(positions, 0.01).shape[1] > 0


def test_memory_is_reserved_for_a_device_and_not_during_a_search(rng):
    positions = rng.random((20_000, 3)).astype(np.float32)
    collider = jfpx.SphereCollider(backend="cpu", algorithm="all_pairs")
    with pytest.raises(jfpx.InvalidArgument, match="like is not an array on a CUDA device"):
        collider.reserve(positions, 10, 10)
    stop = threading.Event()

    def search():
        while not stop.is_set():
            try:
                collider.find_pairs(positions, 0.01)
            except jfpx.ConcurrentUse:  # of the other thread
                pass

    thread = threading.Thread(target=search)
    thread.start()
    refused, end = False, time.monotonic() + 60
    while not refused and time.monotonic() < end:
        try:
            collider.reserve(positions, 10, 10)
        except jfpx.ConcurrentUse:
            refused = True
        except jfpx.InvalidArgument:
            pass
    stop.set()
    thread.join()
    assert refused


@pytest.mark.parametrize("search", [
    "jfpx.find_pairs(points, 0.05)",
    "jfpx.find_pairs(points, 0.05, periodic=(1, 1, 1))",
    "jfpx.find_contacts(points, 0.025, threads=2, half=False)",
    "collider.find_contacts(points, 1e-7)",
    "collider.find_pairs(points, 1e-7, query=points[:5])",
    "collider.find_pairs(points, 1e-7, batch=[0, 10, len(points)], output='csr')",
    "collider.find_pairs(points, 1e-7, periodic=(1, None, 1))",
])
def test_ctrl_c_ends_a_search(search):
    # Alone, each search takes minutes or more memory than the limit.
    code = f"""
import os, resource, signal, threading
import numpy as np, jfpx
points = np.random.default_rng(1).random((2_000_000, 3))
limit = int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize() + (6 << 30)
resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
collider = jfpx.SphereCollider("float64", backend="cpu", algorithm="all_pairs")
try:
    threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT)).start()
    {search}
except KeyboardInterrupt:
    # Python also raises it after a search that has run out of memory.
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss < 4 << 20
    few = points[:1000]
    assert np.array_equal(collider.find_pairs(few, 0.1), jfpx.find_pairs(few, 0.1))
    print("KeyboardInterrupt")
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=100)
    assert done.stdout == "KeyboardInterrupt\n", done.stderr


def test_threads_may_search_at_the_same_time(rng):
    positions = rng.random((5_000, 3))
    expected = jfpx.find_pairs(positions, 0.05)
    results = []
    threads = [threading.Thread(target=lambda: results.extend(
        jfpx.find_pairs(positions, 0.05) for _ in range(20))) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(results) == 80
    for result in results:
        np.testing.assert_array_equal(result, expected)


def test_calls_do_not_leak():
    points = np.random.default_rng(1).random((20, 3))

    def calls(n):
        for _ in range(n):
            jfpx.find_contacts(points, 0.2, half=False, output="csr")
            try:
                jfpx.find_contacts(points, -1)
            except jfpx.InvalidArgument:
                pass
        gc.collect()

    calls(2_000)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    calls(50_000)
    grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    assert grown < 4096, f"{grown} KiB in 10^5 calls"


def test_a_pickled_collider_has_its_options(dtype):
    collider = jfpx.SphereCollider(dtype, backend="cpu", algorithm="grid", threads=2)
    collider.find_contacts(np.zeros((3, 3), dtype), 1)
    copied = pickle.loads(pickle.dumps(collider))
    assert copied.dtype == collider.dtype and copied.backend == "cpu"
    copied.find_contacts(np.zeros((3, 3), dtype), 1)
    assert copied.algorithm == collider.algorithm


def test_lengths_and_radii_of_any_kind_are_taken(dtype):
    points = np.zeros((3, 3), dtype)
    points[1:, 0] = 8.5
    for lengths in (np.array([9, 9, 9]), [np.array(9.0)] * 3, (np.float32(9), 9, None), [9, None, None]):
        assert jfpx.find_pairs(points, 1, periodic=lengths).pairs.shape == (2, 3)
    for cells in (np.full((3, 3), 9.0), [[9, 9, 9]] * 3, np.array([[9, 8, 7], [9, 9, 9], [5, 6, 7]])):
        assert jfpx.find_pairs(points, 1, periodic=cells, batch=[0, 1, 2, 3]).pairs.shape == (2, 0)
    assert jfpx.find_pairs(points[:0], 1, periodic=np.empty((0, 3)), batch=[0]).pairs.shape == (2, 0)
    for radii in (1, np.int64(1), np.float32(1), [1, 1, 1], (1.0, 1.0, 1.0), np.array([1e-17, 1, 1]).astype(dtype)):
        assert jfpx.find_contacts(points, radii).pairs.shape[1] == 1

"""Nearest points, against brute force in float64."""

import subprocess
import sys

import numpy as np
import pytest

import jfpx


def brute_force(positions, query, k, lengths=None):
    """Indices and distances of the k nearest of `positions`; of themselves where `query` is None. The
    points are multiples of 2^-6 and the lengths powers of 2, so that all squares are exact."""
    itself = query is None
    query = positions if itself else query
    delta = query[:, None, :].astype(np.float64) - positions[None, :, :]
    if lengths is not None:
        for axis, length in enumerate(lengths):
            if length is not None:
                delta[:, :, axis] -= length * np.round(delta[:, :, axis] / length)
    square = (delta**2).sum(axis=-1)
    if itself:
        np.fill_diagonal(square, np.inf)
    indices = np.argsort(square, axis=1, kind="stable")[:, :k]
    return indices, np.sqrt(np.take_along_axis(square, indices, 1))


def exact_points(rng, n, dtype):
    return (rng.integers(-256, 256, (n, 3)) / 64).astype(dtype)


@pytest.mark.parametrize("n, k", [(2, 1), (40, 39), (600, 1), (600, 12)])
@pytest.mark.parametrize("lengths", [None, (8, 8, 8), (2, None, 4)])
@pytest.mark.parametrize("with_query", [False, True])
def test_nearest_points_equal_brute_force(rng, dtype, n, k, lengths, with_query):
    positions = exact_points(rng, n, dtype)
    query = exact_points(rng, 50, dtype) if with_query else None
    indices, distances = brute_force(positions, query, k, lengths)
    for threads in (1, 3):
        found = jfpx.find_nearest(positions, k, query=query, periodic=lengths, threads=threads)
        np.testing.assert_array_equal(found.indices, indices)
        np.testing.assert_array_equal(found.distances, distances.astype(dtype))
        assert found.indices.dtype == np.int32 and found.distances.dtype == dtype
        if lengths is not None:
            cell = np.array([length or 0 for length in lengths])
            images = positions[found.indices].astype(np.float64) + found.shifts * cell
            centres = (positions if query is None else query).astype(np.float64)
            np.testing.assert_array_equal(
                np.sqrt(((centres[:, None] - images)**2).sum(-1)), distances)


def test_nearest_points_are_those_of_find_pairs(rng, dtype):
    positions = rng.random((400, 3)).astype(dtype)
    found = jfpx.find_nearest(positions, 399)
    rows = jfpx.find_pairs(positions, 0.3, half=False, output="csr")
    for i in range(400):
        near = found.indices[i][found.distances[i] < 0.3 - 1e-6]
        neighbors = rows.columns[rows.offsets[i]:rows.offsets[i + 1]]
        assert set(near) <= set(neighbors)
        assert set(neighbors) <= set(found.indices[i][found.distances[i] < 0.3 + 1e-6])


def test_nearest_points_have_the_kind_of_the_positions():
    found = jfpx.find_nearest([[0, 0, 0], [1, 0, 0], [5, 0, 0]], np.int64(1), index_dtype="int64")
    assert isinstance(found, jfpx.Nearest)
    assert found.indices.tolist() == [[1], [0], [1]] and found.indices.dtype == np.int64
    assert found.distances.tolist() == [[1], [1], [4]] and found.distances.dtype == np.float64
    torch = pytest.importorskip("torch")
    assert torch.is_tensor(jfpx.find_nearest(torch.rand(5, 3), 2).indices)


@pytest.mark.parametrize("arguments, message", [
    (dict(k=4), r"k is 4; it must be in \[0, 3\]"),
    (dict(k=5, query=np.zeros((1, 3))), r"k is 5; it must be in \[0, 4\]"),
    (dict(k=1.5), "k is 1.5; it must be an integer"),
    (dict(k=1, query=np.zeros((1, 3), np.float32)), "query has dtype float32; it must be float64"),
    (dict(k=1, query=np.full((1, 3), np.nan)), "query 0: x is nan; it must be finite"),
    (dict(k=1, periodic=(True, True, True)), "it must be the three lengths"),
    (dict(k=1, periodic=(1, -1, 1)), "periodic length y is -1"),
    (dict(k=1, threads=-1), "threads is -1"),
    (dict(k=1, index_dtype="int8"), "index_dtype is 'int8'"),
    (dict(k=1, positions=np.zeros((4, 2))), r"positions has shape \(4, 2\)"),
])
def test_bad_input_of_find_nearest_is_a_named_exception(arguments, message):
    arguments = {"positions": np.zeros((4, 3)), **arguments}
    with pytest.raises(jfpx.InvalidArgument, match=message):
        jfpx.find_nearest(**arguments)


def test_ctrl_c_ends_a_search_for_nearest_points():
    # Alone, the search takes minutes: all points are at about the same distance.
    code = """
import os, signal, threading
import numpy as np, jfpx
points = np.random.default_rng(1).normal(size=(1_000_000, 3))
points /= np.linalg.norm(points, axis=1)[:, None]
query = points / 1e15
try:
    threading.Timer(0.5, os.kill, (os.getpid(), signal.SIGINT)).start()
    jfpx.find_nearest(points, 1, query=query)
except KeyboardInterrupt:
    print("KeyboardInterrupt")
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=100)
    assert done.stdout == "KeyboardInterrupt\n", done.stderr

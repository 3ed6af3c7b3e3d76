"""The nearest points of each point."""

from __future__ import annotations

from typing import Any, Literal, NamedTuple, overload

import numpy as np

from . import _arrays
from ._collider import _check_points


class Nearest(NamedTuple):
    """The k nearest points of M queries, of the kind of the positions. Each row is sorted by
    distance, then by index.

    Attributes
    ----------
    indices : array (M, k)
        Indices of the points.
    distances : array (M, k)
        Distances from the query, of the type of the positions.
    """

    indices: Any
    distances: Any


class PeriodicNearest(NamedTuple):
    """The k nearest points of M queries in a periodic cell, of the kind of the positions. Each row is
    sorted by distance, then by index.

    Attributes
    ----------
    indices : array (M, k)
        Indices of the points.
    distances : array (M, k)
        Distances of the nearest images from the query, of the type of the positions.
    shifts : array (M, k, 3) of int32
        The image of point b is at positions[b] + shifts * lengths, with length 0 along axes that do
        not repeat.
    """

    indices: Any
    distances: Any
    shifts: Any


@overload
def find_nearest(positions: Any, k: int, *, query: Any = None, periodic: None = None,
                 index_dtype: Any = "int32", threads: int = 1) -> Nearest: ...


@overload
def find_nearest(positions: Any, k: int, *, query: Any = None, periodic: Any,
                 index_dtype: Any = "int32", threads: int = 1) -> PeriodicNearest: ...


def find_nearest(positions: Any, k: int, *, query: Any = None, periodic: Any = None,
                 index_dtype: Any = "int32", threads: int = 1) -> Any:
    """Finds the k nearest other points of each point, or the k nearest points of each point of
    `query`, on the CPU. May be called from any number of threads.

    The result is exact: squares of distances are computed in float64, from the given coordinates,
    and compared without another rounding. Points at equal distances are listed by index. The bits do
    not depend on the number of threads.

    Parameters
    ----------
    positions : array (N, 3) of float32 or float64, N < 2^32
        Points, finite, in any unit of length; coordinates up to 9e37 in float32 and 1e150 in float64. NumPy, any array
        in host memory with DLPack, or nested lists, which become float64. Any strides.
    k : int in [0, N - 1], with `query` in [0, N]
        Number of points in each row.
    query : array (M, 3) of the type of `positions`, optional
        Points whose nearest points are found. A point at the position of a query counts.
    periodic : three lengths, optional
        Lengths of an orthogonal cell that repeats; None along an axis that does not. The nearest
        image of each point counts; of two images at the same distance, half a length, the one with
        the smaller shift. Positions may be outside of the cell, less than 2^20 lengths from the
        origin.
    index_dtype : "int32" or "int64"
        Type of the indices; int64 is necessary for more than 2^31 points.
    threads : int in [0, 256]
        Number of threads; 0: one per core. Has no effect on the result.

    Returns
    -------
    Nearest, or PeriodicNearest with `periodic`
        Rows in the order of `positions`, or of `query`.

    Raises
    ------
    InvalidArgument
        A wrong shape, type or device; a coordinate, a length or an option out of its range.
    OutOfMemory
        Host memory is exhausted.
    KeyboardInterrupt
        Ctrl-C was pressed during a search of the main thread.
    """
    convert, positions, index = _check_points(positions, index_dtype, "find_nearest")
    dtype = positions.dtype
    if query is not None:
        query = _arrays.rows(query, "query", 3, dtype)
    cells = _arrays.cells(periodic, None)
    size, rows = positions.shape[0], (positions if query is None else query).shape[0]
    k = _arrays.count(k, "k", 0, max(size - 1, 0) if query is None else size)
    indices, distances = np.empty((rows, k), index), np.empty((rows, k), dtype)
    shifts = None if cells is None else np.empty((rows, k, 3), np.int32)
    _arrays.precision_of(dtype).write_nearest(
        positions, query, k, cells, _arrays.count(threads, "threads", 0, 256), indices, distances,
        None if shifts is None else shifts.reshape(-1, 3))
    if shifts is None:
        return Nearest(convert(indices), convert(distances))
    return PeriodicNearest(convert(indices), convert(distances), convert(shifts))

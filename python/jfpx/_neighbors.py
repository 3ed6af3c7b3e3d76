"""Neighbor lists in periodic cells of any shape."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from . import _arrays
from ._collider import _check_points
from ._errors import InvalidArgument


class Neighbors(NamedTuple):
    """Pairs of a point i and an image of a point j, of the kind of the positions, sorted by
    (i, j, shift).

    Attributes
    ----------
    pairs : array (2, E)
        Indices i and j.
    shifts : array (E, 3) of int32
        The image of point j is at positions[j] + shifts @ cell. 0 along vectors that do not repeat. In a batch,
        the cell is that of the system of the points.
    distances : array (E,), or None
        Lengths of the vectors, of the type of the positions.
    vectors : array (E, 3), or None
        Vectors from point i to the image of point j, of the type of the positions.
    """

    pairs: Any
    shifts: Any
    distances: Any = None
    vectors: Any = None


def find_neighbors(positions: Any, cutoff: Any, *, cell: Any = None, pbc: Any = None, batch: Any = None,
                   radii: Any = None, species: Any = None, half: bool = True, r_min: float = 0.0, distances: bool = False,
                   vectors: bool = False, index_dtype: Any = "int32", threads: int = 1) -> Neighbors:
    """Finds all pairs of points at a distance of at most `cutoff`, also across the boundaries of a
    periodic cell of any shape, on the CPU. May be called from any number of threads.

    The cutoff may exceed the cell: all images of a point that are near enough are its neighbors, and
    so are images of the point itself. The result is complete and exact for the given positions,
    wherever in the cell they are. Each component of a vector is

        positions[j] - positions[i] + shifts[0] * cell[0] + shifts[1] * cell[1] + shifts[2] * cell[2]

    rounded once to the type of the positions, apart from errors of 2^-100 of the terms. A pair is
    listed if sqrt((x * x + y * y) + z * z), computed in that type, is at most the cutoff. The bits do
    not depend on the number of threads.

    Parameters
    ----------
    positions : array (N, 3) of float32 or float64, N < 2^32; or an ase.Atoms
        Points, finite, in any unit of length; coordinates up to 9e37 in float32 and 1e150 in float64.
        NumPy, any array in host memory with DLPack, or nested lists, which become float64. Any
        strides. Points may be outside of the cell, less than 2^22 cells from the origin. An ase.Atoms, or another
        object with positions, cell and pbc, also gives the last two, unless they are arguments.
    cutoff : number > 0; with `radii` a number >= 0; with `species` an array (S, S), or a dict
        Its square must be exact to the precision of the type: from about 1e-15 to 1e19 in float32,
        and from 1e-146 to 1e154 in float64. An array has a cutoff for each pair of species, and is symmetric;
        0 means that points of these species are no neighbors. A dict such as {("H", "O"): 1.2} has one for
        each pair of species that has neighbors, in any order.
    cell : array (3, 3), or three lengths, or with `batch` an array (systems, 3, 3); optional
        Rows are the vectors of the cell, such as the cell of an ase.Atoms; used in float64. Three
        lengths are those of an orthogonal cell, None where it does not repeat. With `batch`, one cell is that
        of each system, or each system has its own.
    pbc : bool or three bools, or with `batch` bools (systems, 3); optional
        Whether the cell repeats along each vector. By default, along all that are not 0. Vectors
        along which it does not repeat have no effect.
    batch : array (N,) of integers, optional
        Ascending number of the system of each point, from 0 on, such as `batch` of PyTorch Geometric. Points of
        different systems are no neighbors. The result is that of a call for each system, one after the other, in
        less time; indices count all points. Also takes the offsets of the systems, as find_pairs().
    radii : number >= 0, or array (N,) of the type of `positions`; optional
        The cutoff of a pair is (radius of i + radius of j) + cutoff.
    species : array (N,) of integers, optional
        Row of each point in an array of cutoffs. With a dict, integers or texts that its keys have; by default the
        numbers or symbols of an ase.Atoms.
    half : bool
        True: each pair once, with i < j, or i == j and a shift whose first component that is not 0
        is positive. False: also (j, i) with the opposite shift and vector.
    r_min : number in [0, cutoff]
        Pairs at smaller distances are left out.
    distances, vectors : bool
        Whether the result has them.
    index_dtype : "int32" or "int64"
        Type of the indices; int64 is necessary for more than 2^31 points.
    threads : int in [0, 256]
        Number of threads; 0: one per core. Has no effect on the result.

    Raises
    ------
    InvalidArgument
        A wrong shape, type or device; a coordinate, a vector or an option out of its range; vectors
        that are linearly dependent; shifts beyond 2^24 cells.
    OutOfMemory
        Host memory is exhausted.
    KeyboardInterrupt
        Ctrl-C was pressed during a search of the main thread.
    """
    if all(hasattr(positions, name) for name in ("positions", "cell", "pbc")):
        cell = positions.cell if cell is None else cell
        pbc = positions.pbc if pbc is None else pbc
        if species is None and isinstance(cutoff, Mapping):
            species = [*positions.symbols] if _has_symbols(cutoff) else positions.numbers
        positions = positions.positions
    convert, positions, index = _check_points(positions, index_dtype, "find_neighbors")
    cells, repeats, systems = _arrays.lattices(cell, pbc, batch is not None)
    offsets = None if batch is None else _arrays.systems(batch, positions.shape[0], systems)
    cutoffs = _pair_cutoffs(cutoff, radii, species, positions.shape[0], positions.dtype)
    found = list(_arrays.precision_of(positions.dtype).find_neighbors(
        positions, cutoffs.common, offsets, None if cells is None else cells.reshape(-1, 3), repeats,
        systems is not None, cutoffs.radii, cutoffs.species, cutoffs.matrix, not half,
        _arrays.number(r_min, "r_min"), (bool(distances), bool(vectors)), _arrays.count(threads, "threads", 0, 256)))
    size = found[0].size
    pairs = np.empty((2, size), index)
    for k in range(2):  # frees each array once it is copied
        pairs[k], found[k] = found[k].reshape(-1), None
    shifts = np.zeros((size, 3), np.int32) if cells is None else found[2]
    return Neighbors(convert(pairs), convert(shifts), convert(found[3].reshape(-1)) if distances else None,
                     convert(found[4]) if vectors else None)


class _PairCutoffs(NamedTuple):
    """Cutoffs of pairs: the part that all have in common, radii (N,), or species (N,) and a matrix (S, S)."""

    common: float
    radii: np.ndarray | None = None
    species: np.ndarray | None = None
    matrix: np.ndarray | None = None


def _pair_cutoffs(cutoff: Any, radii: Any, species: Any, size: int, dtype: Any) -> _PairCutoffs:
    """The cutoffs of pairs of `size` points. Takes a number, with or without radii, or a matrix or a dict with the
    species of the points."""
    if isinstance(cutoff, (int, float)) and radii is None and species is None:  # without the time of conversions
        return _PairCutoffs(_arrays.number(cutoff, "cutoff"))
    if isinstance(cutoff, Mapping):
        cutoff, species = _matrix(cutoff, species)
    try:
        dimensions = np.ndim(cutoff)
    except ValueError:  # rows of different lengths
        dimensions = 0
    if dimensions == 0:
        if species is not None:
            raise InvalidArgument(f"cutoff is {cutoff!r}; with species, it must be a matrix with a row for each species")
        common = _arrays.number(cutoff, "cutoff")
        if radii is None:
            return _PairCutoffs(common)
        return _PairCutoffs(common, np.ascontiguousarray(np.broadcast_to(_arrays.vector(radii, "radii", size, dtype), size)))
    matrix = _arrays.converted(cutoff, "cutoff", dtype)
    if matrix.ndim != 2 or matrix.shape[0] != matrix.shape[1] or matrix.size == 0:
        raise InvalidArgument(f"cutoff has shape {matrix.shape}; it must be a number, or with species a square matrix; "
                              "radii of the points are the argument radii")
    if species is None:
        raise InvalidArgument("cutoff is a matrix, and there are no species; pass the row of each point as species")
    if radii is not None:
        raise InvalidArgument("radii and species exclude each other")
    species = _arrays.to_host(species if hasattr(species, "dtype") else np.asarray(species), "species")
    if species.shape != (size,) or (size > 0 and species.dtype.kind not in "iu"):
        raise InvalidArgument(f"species has shape {species.shape} and dtype {species.dtype}; it must be integers ({size},)")
    if size > 0 and not 0 <= species.min() <= species.max() < len(matrix):
        worst = species.min() if species.min() < 0 else species.max()
        raise InvalidArgument(f"species contains {worst}; it must be in [0, {len(matrix) - 1}], a row of cutoff")
    return _PairCutoffs(0.0, None, np.ascontiguousarray(species, np.uint32), np.ascontiguousarray(matrix))


def _matrix(cutoffs: Mapping[Any, Any], species: Any) -> tuple[np.ndarray, np.ndarray]:
    """A matrix for the species that occur, and their rows in it, from cutoffs by pair of species."""
    if species is None:
        raise InvalidArgument("cutoff is a dict, and there are no species; pass that of each point as species")
    labels, rows = np.unique(_arrays.to_host(species, "species") if hasattr(species, "dtype") else np.asarray(species),
                             return_inverse=True)
    row_of = {label: row for row, label in enumerate(labels.tolist())}
    matrix = np.full((max(len(labels), 1),) * 2, np.nan)
    for key, value in cutoffs.items():
        if not isinstance(key, tuple) or len(key) != 2:
            raise InvalidArgument(f"cutoff has the key {key!r}; it must be a pair of species")
        value = _arrays.number(value, f"cutoff of {key!r}")
        if key[0] in row_of and key[1] in row_of:
            a, b = row_of[key[0]], row_of[key[1]]
            if not math.isnan(matrix[a, b]) and matrix[a, b] != value:
                raise InvalidArgument(f"cutoff of {key!r} is {value:g}, and in the other order {matrix[a, b]:g}")
            matrix[a, b] = matrix[b, a] = value
    return np.nan_to_num(matrix, nan=0.0, posinf=np.inf), rows.reshape(-1)


def _has_symbols(cutoffs: Mapping[Any, Any]) -> bool:
    return any(isinstance(label, str) for key in cutoffs if isinstance(key, tuple) for label in key)

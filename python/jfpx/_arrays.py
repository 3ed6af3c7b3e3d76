"""Conversion between the arrays of other libraries and NumPy, with errors that name the argument."""

from __future__ import annotations

import functools
import math
import os
from collections.abc import Callable, Iterable
from types import NoneType
from typing import Any, NamedTuple

import numpy as np

from . import _core
from ._errors import InvalidArgument

PRECISIONS = {np.dtype(np.float32): _core.f32, np.dtype(np.float64): _core.f64}


def precision_of(dtype: Any) -> Any:
    """The submodule of a dtype."""
    try:
        return PRECISIONS[np.dtype(dtype)]
    except (KeyError, TypeError):
        raise InvalidArgument(f"dtype is {dtype!r}; it must be float32 or float64") from None


def instance(value: Any, name: str, kind: type, remedy: str = "") -> Any:
    """The value, which must be of a type."""
    if not isinstance(value, kind):
        simple = value is None or isinstance(value, (str, int, float, tuple))
        article = "an" if kind.__name__[0] in "AEIOU" else "a"
        given = repr(value) if simple else f"of type {type(value).__name__}"
        raise InvalidArgument(f"{name} is {given}; it must be {article} {kind.__name__}{remedy}")
    return value


def function(value: Any, name: str) -> Any:
    """The value, which must be a function."""
    if not callable(value):
        raise InvalidArgument(f"{name} is {value!r}; it must be a function")
    return value


def path(value: Any) -> str:
    """The path of a file."""
    try:
        return os.fsdecode(value)
    except TypeError:
        raise InvalidArgument(f"path is {value!r}; it must be a str or a path") from None


def _id(value: Any, name: str, kind: str) -> tuple[int, int]:
    try:
        index, generation = (part.__index__() for part in value)
    except (AttributeError, TypeError, ValueError):
        index = generation = -1
    if not (0 <= index < 2**32 and 0 <= generation < 2**32):
        raise InvalidArgument(f"{name} is {value!r}; it must be a {kind}")
    return index, generation


def body(value: Any, name: str = "body") -> tuple[int, int]:
    """The index and the generation of a BodyId."""
    return _id(value, name, "BodyId: one of World.bodies, or World.body_at(index)")


def joint(value: Any) -> tuple[int, int]:
    """The index and the generation of a JointId."""
    return _id(value, "joint_id", "JointId: one of World.joints")


def options(backend: Any, algorithm: Any, threads: Any, device: Any) -> tuple[str, str, int, int]:
    """The options of a collider or a world."""
    if backend not in ("auto", "cpu", "cuda"):
        raise InvalidArgument(f"backend is {backend!r}; it must be 'auto', 'cpu' or 'cuda'")
    if algorithm not in ("auto", "automatic", "all_pairs", "grid"):
        raise InvalidArgument(f"algorithm is {algorithm!r}; it must be 'auto', 'all_pairs' or "
                              "'grid'")
    return (backend, "automatic" if algorithm == "auto" else algorithm,
            count(threads, "threads", 0, 256), count(device, "device", 0, 2**31 - 1))


def device_numbers(devices: Any) -> list[int]:
    """Numbers of GPUs."""
    if isinstance(devices, str) or not isinstance(devices, Iterable):
        raise InvalidArgument(f"devices is {devices!r}; it must be a sequence of numbers of GPUs")
    return [count(device, f"devices[{i}]", 0, 2**31 - 1) for i, device in enumerate(devices)]


def to_host(array: Any, name: str) -> np.ndarray:
    """An array in host memory as a NumPy array, without a copy where it has DLPack."""
    if isinstance(array, np.ma.MaskedArray):
        if np.ma.is_masked(array):
            raise InvalidArgument(f"{name} has masked elements; pass arrays without them")
        return array.data
    if isinstance(array, np.ndarray):
        return array
    if type(array).__module__ == "torch" or hasattr(array, "detach"):
        array = array.detach()
    if hasattr(array, "__dlpack__"):
        try:
            return np.from_dlpack(array)
        except (BufferError, RuntimeError, TypeError) as error:
            dtype = str(getattr(array, "dtype", "")).removeprefix("torch.")
            if dtype in ("bfloat16", "float16", "half") or dtype.startswith("float8"):
                raise InvalidArgument(f"{name} has dtype {dtype}; it must be float32 or float64") from None
            raise InvalidArgument(f"{name} cannot be read: {error}") from None
    try:
        return np.asarray(array, None if hasattr(array, "dtype") else np.float64)
    except (TypeError, ValueError) as error:
        raise InvalidArgument(f"{name} is not an array of numbers: {error}") from None


def from_host(like: Any) -> Callable[[np.ndarray], Any]:
    """The function that converts a NumPy array to the kind of `like`."""
    if isinstance(like, np.ndarray):
        return lambda array: array
    module = type(like).__module__.partition(".")[0]
    if module == "torch":
        import torch
        return torch.from_numpy
    namespace = getattr(like, "__array_namespace__", None)
    if namespace is not None:
        return namespace().from_dlpack
    return lambda array: array


def rows(array: Any, name: str, columns: int, dtype: Any = None) -> np.ndarray:
    """An array of shape (N, columns) of float32 or float64, or of `dtype` if it is given."""
    array = to_host(array, name)
    if array.ndim != 2 or array.shape[1] != columns:
        raise InvalidArgument(f"{name} has shape {array.shape}; it must be (N, {columns})")
    return floats(array, name, dtype)


def indices(array: Any, name: str, columns: int) -> np.ndarray:
    """An array of shape (N, columns) of integers in [0, 2^32 - 1], as uint32."""
    if hasattr(array, "dtype"):
        array = to_host(array, name)
    else:
        plain_numbers(array, name)  # refuses booleans and texts
        array = np.asarray(array)
    if array.ndim != 2 or array.shape[1] != columns:
        raise InvalidArgument(f"{name} has shape {array.shape}; it must be (N, {columns})")
    if array.dtype.kind not in "iu":
        raise InvalidArgument(f"{name} has dtype {array.dtype}; it must be an array of integers")
    if array.size > 0 and not (int(array.min()) >= 0 and int(array.max()) < 2**32):
        raise InvalidArgument(f"{name} has the index {int(array.min() if array.min() < 0 else array.max())}; "
                              "it must be in [0, 2^32 - 1]")
    return np.ascontiguousarray(array, np.uint32)


def vector(array: Any, name: str, size: int, dtype: Any) -> np.ndarray:
    """A number, as an array of size 1, or an array of shape (size,) and type `dtype`."""
    if isinstance(array, (int, float, np.number)) and not isinstance(array, bool):
        return _single(array, dtype)
    given = hasattr(array, "dtype")
    if not given:
        array = plain_numbers(array, name)
    array = to_host(array, name)
    if array.dtype.kind not in "fiu":
        raise InvalidArgument(f"{name} has dtype {array.dtype}; it must be an array of numbers")
    if array.ndim == 0:
        return _single(array, dtype)
    if array.shape != (size,):
        raise InvalidArgument(f"{name} has shape {array.shape}; it must be a number or ({size},)")
    array = floats(array, name, dtype if given else None).astype(dtype, copy=False)
    # One value for all and one value for one row are the same.
    return array if size else np.ones(1, dtype)


def vectors(value: Any, name: str, size: int, dtype: Any) -> np.ndarray:
    """Three numbers, as an array of shape (1, 3), or numbers of shape (size, 3), converted to `dtype`."""
    array = converted(value, name, dtype)
    if array.shape == (3,):
        return array[np.newaxis]
    if array.ndim != 2 or array.shape[1] != 3:
        raise InvalidArgument(f"{name} has shape {array.shape}; it must be three numbers or ({size}, 3)")
    if array.shape[0] not in (1, size):
        raise InvalidArgument(f"{name} has {array.shape[0]} rows; it must have 1 or {size}")
    return array


@functools.cache
def _distances(dtype: np.dtype) -> tuple[float, float]:
    """The least and the largest distance whose square is exact to the precision of the dtype."""
    limits = np.finfo(dtype)
    return math.sqrt(float(limits.tiny) / float(limits.eps)), math.sqrt(float(limits.max))


def check_square(distance: float, what: str, dtype: Any) -> None:
    """Raises InvalidArgument unless the square of a distance is exact to the precision of the dtype.
    @param what names the argument and its value"""
    low, high = _distances(np.dtype(dtype))
    if not low <= distance <= high:
        raise InvalidArgument(f"{what}, and the square of the distance {distance:g} is not exact in "
                              f"{np.dtype(dtype)}; use a unit of length in which distances are in [{low:.2g}, {high:.2g}]")


def radii_of(array: Any, name: str, size: int, dtype: Any) -> np.ndarray:
    """As vector(), for a search. Raises as check_square() for the sum of two radii. Leaves invalid radii
    to the search, which names the first one."""
    radii = vector(array, name, size, dtype)
    low, high = float(radii.min()), float(radii.max())
    if not (0 < low and high < np.inf):
        return radii
    if radii.size > 1:  # a sphere does not touch itself
        smallest = np.partition(radii, 1)[:2]
        low = float(smallest.sum(dtype=np.float64)) / 2
    for radius in (low, high):
        check_square(2 * radius, f"{name} has the radius {radius:g}", radii.dtype)
    return radii


@functools.lru_cache(maxsize=256, typed=True)  # True is not 1
def radius_of(radius: float, name: str, dtype: str) -> float:
    """radii_of() for a number, as a number."""
    return float(radii_of(radius, name, 1, dtype)[0])


def plain_numbers(value: Any, name: str) -> np.ndarray:
    """An object without a dtype as an array, unless it has booleans or texts, which NumPy converts."""
    try:
        array = np.asarray(value)
    except (TypeError, ValueError) as error:  # rows of different lengths
        raise InvalidArgument(f"{name} is not an array of numbers: {error}") from None
    if array.dtype.kind not in "fiuO":
        raise InvalidArgument(f"{name} is not an array of numbers: it has {array.dtype.name}")
    return value


def _single(value: Any, dtype: Any) -> np.ndarray:
    """An array of size 1, of infinity where a number is out of range, which the search refuses."""
    with np.errstate(over="ignore"):
        try:
            return np.full(1, value, dtype)
        except OverflowError:  # an integer of Python
            return np.full(1, np.inf, dtype)


def converted(array: Any, name: str, dtype: Any) -> np.ndarray:
    """An array of numbers, or a list, as an array of a dtype."""
    array = to_host(array, name)
    if array.dtype.kind not in "fiu":
        raise InvalidArgument(f"{name} has dtype {array.dtype}; it must be an array of numbers")
    with np.errstate(over="ignore"):  # infinity is refused where it is not allowed
        return floats(array.astype(dtype, copy=False), name)


def floats(array: np.ndarray, name: str, dtype: Any = None) -> np.ndarray:
    """The array, if its type is allowed; a copy if its strides are not multiples of an element."""
    if array.dtype not in PRECISIONS:
        raise InvalidArgument(f"{name} has dtype {array.dtype}; it must be float32 or float64")
    if dtype is not None and array.dtype != dtype:
        raise InvalidArgument(f"{name} has dtype {array.dtype}; it must be {np.dtype(dtype)}")
    if any(stride % array.itemsize for stride in array.strides):
        return array.copy()
    return array


def offsets(array: Any, name: str, size: int) -> np.ndarray:
    """Ascending integers as uint64, the first `size` of which would be numbers of systems by point."""
    array = to_host(array if hasattr(array, "dtype") else np.asarray(array), name)
    if array.ndim != 1 or array.dtype.kind not in "iu" or array.size == 0:
        raise InvalidArgument(f"{name} has shape {array.shape} and dtype {array.dtype}; it must be "
                              "integers in one dimension, beginning with 0")
    if array.min() < 0:
        raise InvalidArgument(f"{name} contains {array.min()}; offsets must be >= 0")
    if array.size == size > 1 and array[-1] != size and np.all(array[:-1] <= array[1:]):
        raise InvalidArgument(f"{name} has an element for each of {size} points; it must be the offsets of "
                              f"the systems, such as numpy.append(0, numpy.bincount({name}).cumsum())")
    return np.ascontiguousarray(array, np.uint64)


def triple(value: Any, name: str, size: int = 3) -> tuple[float, ...]:
    """A vector of `size` numbers."""
    try:
        numbers = tuple(float(x) for x in value)
    except (TypeError, ValueError):
        raise InvalidArgument(f"{name} is {value!r}; it must be {size} numbers") from None
    if len(numbers) != size:
        raise InvalidArgument(f"{name} has {len(numbers)} numbers; it must have {size}")
    return numbers


def flags(value: Any, name: str, size: int = 3) -> list[bool]:
    """`size` truth values."""
    try:
        values = list(value)
    except TypeError:
        raise InvalidArgument(f"{name} is {value!r}; it must be {size} truth values") from None
    if len(values) != size or not all(isinstance(x, (bool, np.bool_)) for x in values):
        raise InvalidArgument(f"{name} is {value!r}; it must be {size} truth values")
    return [bool(x) for x in values]


def number(value: Any, name: str) -> float:
    """A number that is not NaN."""
    kind = getattr(getattr(value, "dtype", None), "kind", "")
    if isinstance(value, (bool, str, bytes)) or kind in ("b", "U", "S"):  # which float() converts
        raise InvalidArgument(f"{name} is {value!r}; it must be a number")
    try:
        result = float(value)
    except (TypeError, ValueError):
        raise InvalidArgument(f"{name} is {value!r}; it must be a number") from None
    except OverflowError:
        result = math.inf
    if math.isnan(result):
        raise InvalidArgument(f"{name} is nan; it must be a number")
    return result


def count(value: Any, name: str, low: int, high: int) -> int:
    """An integer in [low, high]."""
    try:
        result = value.__index__()
    except AttributeError:
        raise InvalidArgument(f"{name} is {value!r}; it must be an integer") from None
    if not low <= result <= high:
        raise InvalidArgument(f"{name} is {result}; it must be in [{low}, {high}]")
    return result


def cells(lengths: Any, systems: int | None) -> np.ndarray | None:
    """The lengths of periodic cells (1 or `systems`, 3), NaN along axes that do not repeat; None for
    None. Takes three lengths, each None along such an axis, or with systems also one such row for
    each."""
    if lengths is None:
        return None
    # Not booleans, which equal numbers.
    if systems is None and type(lengths) is tuple and all(type(x) in (float, int, NoneType) for x in lengths):
        return _one_cell(lengths)
    try:
        lengths = list(lengths)
    except TypeError:
        raise InvalidArgument(f"periodic is {lengths!r}; it must be three lengths") from None
    has_rows = any(_is_row(row) for row in lengths)
    if has_rows and systems is None:
        raise InvalidArgument("periodic is a matrix; it must be the three lengths of an orthogonal cell, such as "
                              "periodic.diagonal(); find_neighbors(cell=) takes cells of any shape")
    if not lengths and systems == 0:
        return np.empty((0, 3))
    if not has_rows:
        return np.array([_cell(lengths)] * (1 if systems is None else systems)).reshape(-1, 3)
    if len(lengths) != systems:
        raise InvalidArgument(f"periodic has {len(lengths)} cells; it must have one for each of "
                              f"{systems} systems")
    for row in lengths:
        if not _is_row(row):
            raise InvalidArgument(f"periodic has the cell {row!r}; it must be three lengths")
    rows = [_cell(row) for row in lengths]
    # A symmetric 3 x 3 array is the matrix of one skewed cell, unless its three rows are equal.
    matrix = np.array(rows)
    if (systems == 3 and hasattr(lengths[0], "dtype") and np.array_equal(matrix, matrix.T)
            and len(set(map(tuple, rows))) > 1):
        raise InvalidArgument("periodic is a matrix; it must be a row of three lengths for each system")
    return matrix


@functools.lru_cache(maxsize=256)
def _one_cell(lengths: tuple[float | None, ...]) -> np.ndarray:
    cell = np.array([_cell(lengths)])
    cell.flags.writeable = False  # the next call returns it, too
    return cell


def _is_row(value: Any) -> bool:
    if value is None or isinstance(value, (int, float, str)):  # np.ndim() would make an array of it
        return False
    return np.ndim(value) > 0


def _cell(lengths: Any) -> list[float]:
    if len(lengths) != 3:
        raise InvalidArgument(f"periodic has {len(lengths)} lengths; it must have 3")
    for length in lengths:
        if isinstance(length, (bool, np.bool_)) or (length is not None and not isinstance(length, str)
                                                    and not _is_row(length) and length == 0):
            raise InvalidArgument(f"periodic is {tuple(lengths)}; it must be the three lengths of the cell, and "
                                  "None along axes that do not repeat, such as (10, 10, None)")
    return [math.nan if length is None else number(length, "periodic") for length in lengths]


def lattices(cell: Any, pbc: Any, batched: bool) -> tuple[np.ndarray | None, np.ndarray, int | None]:
    """The vectors of cells as rows (C, 3, 3) of float64, whether each repeats along its vectors (C, 3), and the
    number of systems C; one cell and None if it is that of all systems. No vectors for None. Takes three
    lengths, each None where an orthogonal cell does not repeat, or a matrix of rows; if `batched`, also
    matrices or flags of each system."""
    flags = None if pbc is None else _flags(pbc, batched)
    if cell is None:
        if flags is not None and flags.any():
            raise InvalidArgument(f"pbc is {pbc!r}, and there is no cell; pass its vectors as cell")
        return None, np.zeros((1, 3), bool), None
    if isinstance(cell, (list, tuple)) and len(cell) == 3 and any(length is None for length in cell):
        cell = [0.0 if length is None else number(length, "cell") for length in cell]
    if not hasattr(cell, "dtype") and not hasattr(cell, "__array__"):
        plain_numbers(cell, "cell")  # refuses booleans and texts
    rows = converted(cell, "cell", np.float64)
    if rows.shape == (3,):
        rows = np.diag(rows)
    if rows.shape[-2:] != (3, 3) or rows.ndim > (3 if batched else 2):
        raise InvalidArgument(f"cell has shape {rows.shape}; it must be (3, 3), the vectors of the cell as rows, "
                              + ("three lengths, or (systems, 3, 3)" if batched else "or three lengths"))
    if flags is None:
        flags = rows.any(axis=-1)
    if rows.ndim == 2 and flags.ndim == 1:
        return np.ascontiguousarray(rows)[np.newaxis], flags[np.newaxis], None
    if rows.ndim == 3 and flags.ndim == 2 and len(rows) != len(flags):
        raise InvalidArgument(f"cell has {len(rows)} systems, and pbc {len(flags)}")
    systems = len(rows) if rows.ndim == 3 else len(flags)
    return (np.ascontiguousarray(np.broadcast_to(rows, (systems, 3, 3))),
            np.ascontiguousarray(np.broadcast_to(flags, (systems, 3))), systems)


def _flags(value: Any, batched: bool) -> np.ndarray:
    """Booleans of shape (3,), or also (C, 3) if `batched`."""
    try:
        array = np.asarray(value)
    except (TypeError, ValueError):  # rows of different lengths
        array = np.array("")
    are_bools = array.dtype.kind == "b"
    if not are_bools and (array.dtype.kind not in "iu" or ((array != 0) & (array != 1)).any()):
        raise InvalidArgument(f"pbc is {value!r}; it must be a bool or three bools")
    if array.ndim == 0:
        array = np.repeat(array, 3)
    if array.shape[-1] != 3:
        raise InvalidArgument(f"pbc has {array.shape[-1]} flags; it must have 3")
    if array.ndim > (2 if batched else 1):
        raise InvalidArgument(f"pbc has shape {array.shape}; it must be a bool or three bools"
                              + (", or (systems, 3)" if batched else ""))
    return array if are_bools else array.astype(bool)


def systems(batch: Any, size: int, cells: int | None) -> np.ndarray:
    """Offsets of systems as uint64, from the number of the system of each of `size` points, or from offsets.
    @param cells number of cells, which are those of the systems; None: systems without points do not count"""
    array = to_host(batch if hasattr(batch, "dtype") else np.asarray(batch), "batch")
    if array.ndim != 1 or (array.size > 0 and array.dtype.kind not in "iu"):
        raise InvalidArgument(f"batch has shape {array.shape} and dtype {array.dtype}; it must be the number of the "
                              "system of each point, or the offsets of the systems, integers in one dimension")
    if array.size > 0 and array.min() < 0:
        raise InvalidArgument(f"batch contains {array.min()}; it must be >= 0")
    are_offsets = array.size > 0 and array[0] == 0 and array[-1] == size
    if array.size != size:
        if not are_offsets:
            raise InvalidArgument(f"batch has {array.size} elements; it must have the number of the system of each of "
                                  f"{size} points, or the offsets of the systems from 0 to {size}")
        return np.ascontiguousarray(array, np.uint64)
    if are_offsets:
        raise InvalidArgument(f"batch ascends from 0 to {size} in as many elements; append {size} to offsets of "
                              "systems, or number the systems without gaps")
    if (array[1:] < array[:-1]).any():
        raise InvalidArgument("batch does not ascend; sort the points by it, as "
                              "numpy.argsort(batch, kind=\"stable\") does")
    if cells is None:
        changes = np.flatnonzero(array[1:] != array[:-1]) + 1
        return np.concatenate([[0], changes, [size] * (size > 0)]).astype(np.uint64)
    if size > 0 and array[-1] >= cells:
        raise InvalidArgument(f"batch has the system {array[-1]}, and there are cells of {cells} systems")
    return np.searchsorted(array, np.arange(cells + 1)).astype(np.uint64)


class Output(NamedTuple):
    """An array of the caller for a result. The axis None of `shape` has an element for each contact."""

    field: str
    name: str
    array: Any
    shape: tuple[int | None, ...]
    dtypes: tuple[str, ...]


def outputs(out: Any, dtype: str, contacts: bool, periodic: bool) -> list[Output]:
    """The arrays of `out`, which is one array or a tuple."""
    fields = [("pairs", (2, None), ("int32", "int64"))]
    if contacts:
        fields += [("normal", (None, 3), (dtype,)), ("distance", (None,), (dtype,))]
    if periodic:
        fields += [("shifts", (None, 3), ("int32",))]
    if len(fields) == 1:
        return [Output("pairs", "out", out, *fields[0][1:])]
    if not isinstance(out, (tuple, list)) or len(out) != len(fields):
        raise InvalidArgument(f"out is {type(out).__name__}; it must be a tuple of {len(fields)} arrays: "
                              + ", ".join(field for field, _, _ in fields))
    return [Output(field, f"out.{field}", array, shape, dtypes)
            for (field, shape, dtypes), array in zip(fields, out)]

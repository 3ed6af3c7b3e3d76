"""Contacts and pairs among spheres."""

from __future__ import annotations

import functools
import threading
from collections.abc import Callable
from typing import Any, Literal, NamedTuple, overload

import numpy as np

from . import _arrays, _core, _device
from ._errors import ConcurrentUse, InvalidArgument


class Contacts(NamedTuple):
    """The E touching pairs of spheres, sorted by (pairs[0], pairs[1]). Arrays are of the kind of the
    positions. Floating-point arrays have their type, indices that of `index_dtype`.

    Attributes
    ----------
    pairs : array (2, E)
        Indices a and b of the two spheres.
    normal : array (E, 3)
        Unit vectors from b to a; (1, 0, 0) where the centres coincide.
    distance : array (E,)
        Gap between the surfaces: 0, or negative where the spheres overlap.
    """

    pairs: Any
    normal: Any
    distance: Any


class ContactRows(NamedTuple):
    """Touching pairs of spheres as compressed rows (CSR): row i has the contacts with a = i. Types
    are those of Contacts.

    Attributes
    ----------
    offsets : array (N + 1,) of int64
        Row i is columns[offsets[i]:offsets[i + 1]].
    columns : array (E,)
        Indices b, ascending in each row.
    normal : array (E, 3)
        Unit vectors from b to a; (1, 0, 0) where the centres coincide.
    distance : array (E,)
        Gap between the surfaces: 0, or negative where the spheres overlap.
    """

    offsets: Any
    columns: Any
    normal: Any
    distance: Any


class Rows(NamedTuple):
    """Pairs as compressed rows (CSR): row i has the pairs with a = i.

    Attributes
    ----------
    offsets : array (N + 1,) of int64
        Row i is columns[offsets[i]:offsets[i + 1]].
    columns : array (E,)
        Indices b, ascending in each row.
    """

    offsets: Any
    columns: Any


class PeriodicContacts(NamedTuple):
    """Touching pairs of spheres and images of spheres, sorted by (pairs[0], pairs[1]). Types are
    those of Contacts.

    Attributes
    ----------
    pairs : array (2, E)
        Indices a and b.
    normal : array (E, 3)
        Unit vectors from the image of b to a.
    distance : array (E,)
        Gap between the surfaces: 0, or negative where the spheres overlap.
    shifts : array (E, 3) of int32
        The image of b is at positions[b] + shifts * lengths, with length 0 along axes that do not
        repeat.
    """

    pairs: Any
    normal: Any
    distance: Any
    shifts: Any


class PeriodicContactRows(NamedTuple):
    """Touching pairs of spheres and images of spheres as compressed rows (CSR).

    Attributes
    ----------
    offsets : array (N + 1,) of int64
        Row i is columns[offsets[i]:offsets[i + 1]].
    columns : array (E,)
        Indices b, ascending in each row.
    normal : array (E, 3)
        Unit vectors from the image of b to a.
    distance : array (E,)
        Gap between the surfaces: 0, or negative where the spheres overlap.
    shifts : array (E, 3) of int32
        The image of b is at positions[b] + shifts * lengths, with length 0 along axes that do not
        repeat.
    """

    offsets: Any
    columns: Any
    normal: Any
    distance: Any
    shifts: Any


class PeriodicPairs(NamedTuple):
    """The E pairs of points and images of points, sorted by (pairs[0], pairs[1]).

    Attributes
    ----------
    pairs : array (2, E)
        Indices a and b.
    shifts : array (E, 3) of int32
        The image of b is at positions[b] + shifts * lengths, with length 0 along axes that do not
        repeat.
    """

    pairs: Any
    shifts: Any


class PeriodicRows(NamedTuple):
    """Pairs of points and images of points as compressed rows (CSR).

    Attributes
    ----------
    offsets : array (N + 1,) of int64
        Row i is columns[offsets[i]:offsets[i + 1]].
    columns : array (E,)
        Indices b, ascending in each row.
    shifts : array (E, 3) of int32
        The image of b is at positions[b] + shifts * lengths, with length 0 along axes that do not
        repeat.
    """

    offsets: Any
    columns: Any
    shifts: Any


_INDEX_TYPES = ("int32", "int64")


class SphereCollider:
    """Finds contacts among spheres, with buffers that are kept from call to call.

    Results are the same to the last bit for every backend, algorithm and number of threads. One
    thread may use an object at a time; different objects are independent.

    The options but `dtype` are for arrays in host memory. Arrays on a device are searched there,
    with an algorithm that is selected for each search; backend="cpu" refuses them.

    Parameters
    ----------
    dtype : "float32" or "float64"
        Type of positions, radii, normals and distances.
    backend : "auto", "cpu" or "cuda"
        Device that searches arrays in host memory. "cuda" copies them to the GPU and back. "auto"
        selects the fastest, by a cost model and by measured times.
    algorithm : "auto", "all_pairs" or "grid"
        All pairs are tested, or those of neighboring cells of a grid. "auto" (also "automatic")
        selects the fastest.
    threads : int in [0, 256]
        Number of threads of the CPU; 0: one per core.
    device : int in [0, 2^31 - 1]
        Ordinal of the GPU.

    Raises
    ------
    BackendUnavailable
        The backend was requested by name and cannot be used.
    InvalidArgument
        An option is out of its range.
    DeviceError
        With backend="cuda": a call of CUDA failed.
    """

    def __init__(self, dtype: Any = "float32", *, backend: str = "auto",
                 algorithm: str = "auto", threads: int = 1, device: int = 0) -> None:
        core = _arrays.precision_of(dtype)
        self._dtype = np.dtype(dtype)
        self._backend = backend
        self._on_devices: dict[Any, Any] = {}
        self._collider = core.Collider(*_arrays.options(backend, algorithm, threads, device))
        self._lock = threading.Lock()
        self._options = {"backend": backend, "algorithm": algorithm, "threads": threads, "device": device}

    def __reduce__(self) -> Any:
        """The dtype and the options: a copy has buffers of its own."""
        return functools.partial(type(self), **self._options), (self._dtype.name,)

    @property
    def dtype(self) -> np.dtype:
        """Type of positions, radii, normals and distances: float32 or float64."""
        return self._dtype

    @property
    def backend(self) -> str:
        """"cpu" or "cuda": backend of the last search of arrays in host memory. Before the first
        one, that of the options, or "cpu" for "auto". A search of arrays on a device uses that
        device, and does not change this property."""
        return self._collider.backend

    @property
    def algorithm(self) -> str:
        """"all pairs" or "grid": algorithm of the last search of arrays in host memory;
        "automatic" before the first one. A search of arrays on a device selects its algorithm
        there, and does not change this property."""
        return self._collider.algorithm

    @property
    def reason(self) -> str:
        """Reason for `backend` and `algorithm`, also for arrays in host memory alone: "fixed" (by
        the options, or the only usable choice), "predicted" or "measured" (to be the fastest),
        "kept" (another may be faster, but not by enough), "trial" (for a few calls, to measure the
        time) or "device failed" (the CPU has replaced the GPU)."""
        return self._collider.reason

    def find_contacts(self, positions: Any, radii: Any, *, batch: Any = None,
                      periodic: Any = None, output: str = "coo",
                      half: bool = True, index_dtype: Any = "int32", out: Any = None,
                      count: Any = None) -> Any:
        """Finds all touching pairs of spheres. See jfpx.find_contacts().

        Parameters
        ----------
        out : Contacts, or PeriodicContacts with `periodic`, optional
            Arrays to write to, pairs (2, C), normal (C, 3), distance (C,), shifts (C, 3) with
            C >= E. Indices are int32 or int64, shifts int32, the others of `dtype`. In host memory,
            or on the device of the positions with contiguous rows. Requires output="coo".
        count : array (2,) of int64 on the device, optional
            With `out`, for arrays on a device: becomes [E, 1], or [E, 0] if E exceeds the capacity of
            reserve(), or [0, 0] if a value of a sphere is not finite or a radius is not > 0. With 0,
            no contact was written. With 1, `out` has all contacts, or the first ones if E exceeds
            its own capacity. The call neither allocates nor waits, so that it can be captured in a
            CUDA graph. Finds each pair once. Excludes query, batch and periodic.

        Returns
        -------
        Contacts, ContactRows, PeriodicContacts or PeriodicContactRows, or int, or None
            With `out`, the number E of contacts; with `count`, None.

        Raises
        ------
        ConcurrentUse
            Another thread uses the collider.
        InvalidArgument
            As jfpx.find_contacts(); the type of the positions is not `dtype`; `out` is too small,
            and the message has the number of contacts; with `count`, more spheres than reserve()
            has allowed.
        OutOfMemory, KeyboardInterrupt, DeviceError, BackendUnavailable
            As jfpx.find_contacts(); with backend="cuda", DeviceError also for arrays in host
            memory. The collider stays usable.
        """
        if _device.is_on_device(positions):
            search = _device_search(self._dtype, positions, None, radii, None, None, batch,
                                    periodic, None)
            return self._find_on_device(search, output, half, index_dtype, out, count, True)
        _refuse_count(count)
        search = _Search(self._dtype, positions, radii, batch)
        search.set_periodic(periodic)
        return self._find(search, output, half, index_dtype, out, contacts=True)

    def find_pairs(self, positions: Any, cutoff: Any = None, *, radii: Any = None,
                   query: Any = None, query_radii: Any = None, batch: Any = None,
                   periodic: Any = None, output: str = "coo", half: bool = True, index_dtype: Any = "int32",
                   out: Any = None, count: Any = None) -> Any:
        """Finds pairs of points within a distance, as indices alone. See jfpx.find_pairs().

        Parameters
        ----------
        out : array, or PeriodicPairs with `periodic`, optional
            Array of shape (2, C) of int32 or int64 to write to, with C >= E, and shifts (C, 3) of
            int32. Requires output="coo".
        count : array (2,) of int64 on the device, optional
            As for find_contacts().

        Returns
        -------
        array of shape (2, E) or Rows, or PeriodicPairs or PeriodicRows with `periodic`, or int, or
        None
            With `out`, the number E of pairs; with `count`, None.

        Raises
        ------
        ConcurrentUse, InvalidArgument, OutOfMemory, KeyboardInterrupt, DeviceError,
        BackendUnavailable
            As find_contacts().
        """
        if _device.is_on_device(positions):
            search = _device_search(self._dtype, positions, cutoff, radii, query, query_radii,
                                    batch, periodic, None)
            return self._find_on_device(search, output, half, index_dtype, out, count, False)
        _refuse_count(count)
        search = _pair_search(self._dtype, positions, cutoff, radii, query, query_radii, batch,
                              periodic)
        return self._find(search, output, half, index_dtype, out, contacts=False)

    def reserve(self, like: Any, spheres: int, contacts: int) -> None:
        """Reserves memory for searches with `count`, on the device and the current stream of
        `like`.

        Parameters
        ----------
        like : array (N, 3) of `dtype` on a device
            Positions.
        spheres : int in [0, 2^31]
        contacts : int in [0, 2^48]
            The most of both in a search.

        Raises
        ------
        InvalidArgument
            A number is out of its range, or `like` is not on a device, or has a wrong shape or
            type.
        ConcurrentUse
            The collider is in use by another call.
        OutOfMemory, DeviceError
            Earlier reservations remain.
        BackendUnavailable
            The package has no CUDA, or the device cannot be used.
        """
        spheres = _arrays.count(spheres, "spheres", 0, 2**31)
        contacts = _arrays.count(contacts, "contacts", 0, 2**48)
        self._acquire()
        try:
            if not _device.is_on_device(like):
                raise InvalidArgument("like is not an array on a CUDA device")
            _device.DeviceSearch(like, None, self._dtype).collider(self._on_devices).reserve(
                spheres, contacts)
        finally:
            self._lock.release()

    def _acquire(self) -> None:
        if not self._lock.acquire(blocking=False):
            raise ConcurrentUse("the collider is in use by another call; use one for each thread")

    def _find(self, search: _Search, output: str, half: bool, index_dtype: Any, out: Any,
              contacts: bool) -> Any:
        index = _check_form(output, index_dtype, out)
        outputs = None if out is None else _arrays.outputs(out, self._dtype.name, contacts,
                                                           search.periodic)
        if index == "int32" and search.largest() > 2**31:
            raise InvalidArgument("more than 2^31 spheres require index_dtype=\"int64\"")
        self._acquire()
        try:
            size = search.run(self._collider, bool(half), contacts)
            if outputs is not None:
                return self._write(size, outputs)
            if output == "coo":
                result = [np.empty((2, size), index)]
                self._collider.write_pairs(result[0])
            else:
                result = [np.empty(search.rows() + 1, np.int64), np.empty(size, index)]
                self._collider.write_rows(*result)
            if contacts:
                result += [np.empty((size, 3), self._dtype), np.empty(size, self._dtype)]
                self._collider.write_contacts(*result[-2:])
            if search.periodic:
                result.append(np.empty((size, 3), np.int32))
                self._collider.write_shifts(result[-1])
        finally:
            self._lock.release()
        return _result([search.convert(array) for array in result], output, contacts,
                       search.periodic)

    def _find_on_device(self, search: _device.DeviceSearch, output: str, half: bool,
                        index_dtype: Any, out: Any, count: Any, contacts: bool) -> Any:
        index = _check_form(output, index_dtype, out)
        if self._backend == "cpu":
            raise InvalidArgument(f"positions are on cuda:{search.device}, and backend is cpu")
        if count is not None and out is None:
            raise InvalidArgument("count requires out")
        if count is not None and (search.waits() or search.periodic):
            raise InvalidArgument("count excludes query, batch and periodic")
        outputs = None if out is None else _arrays.outputs(out, search.dtype, contacts, search.periodic)
        self._acquire()
        try:
            core = search.collider(self._on_devices)
            if count is not None:
                search.enqueue(core, contacts)
                search.write(core, outputs, None)
                search.write_count(core, count)
                return None
            if out is None and not contacts and search.finds_new_pairs(output, half):
                result = search.new_pairs(core, index)
            else:
                size = search.run(core, contacts, bool(half))
                if out is not None:
                    search.write(core, outputs, size)
                    return size
                result = search.results(core, size, output, index, contacts)
        finally:
            self._lock.release()
        return _result(result, output, contacts, search.periodic)

    def _write(self, size: int, outputs: list[_arrays.Output]) -> int:
        """Writes the result to the arrays of the caller."""
        targets = {output.field: _target(output, size) for output in outputs}
        self._collider.write_pairs(targets["pairs"])
        if "normal" in targets:
            self._collider.write_contacts(targets["normal"], targets["distance"])
        if "shifts" in targets:
            self._collider.write_shifts(targets["shifts"])
        return size


def _result(arrays: list[Any], output: str, contacts: bool, periodic: bool) -> Any:
    if periodic:
        if contacts:
            return (PeriodicContacts if output == "coo" else PeriodicContactRows)(*arrays)
        return (PeriodicPairs if output == "coo" else PeriodicRows)(*arrays)
    if contacts:
        return Contacts(*arrays) if output == "coo" else ContactRows(*arrays)
    return arrays[0] if output == "coo" else Rows(*arrays)


class _Search:
    """The validated arguments of a search."""

    def __init__(self, dtype: Any, positions: Any, radii: Any, batch: Any) -> None:
        self.convert = _arrays.from_host(positions)
        self._positions = _arrays.rows(positions, "positions", 3, dtype)
        self.dtype = self._positions.dtype
        size = self._positions.shape[0]
        self._radii = _arrays.radii_of(radii, "radii", size, self.dtype)
        self._batch = None if batch is None else _arrays.offsets(batch, "batch", size)
        self._query: Any = None
        self.periodic = False

    def set_periodic(self, lengths: Any) -> None:
        self._cells = _arrays.cells(lengths, None if self._batch is None else len(self._batch) - 1)
        self.periodic = self._cells is not None

    def add_query(self, query: Any, radii: Any) -> None:
        if self._batch is not None:
            raise InvalidArgument("query and batch exclude each other")
        self._query = _arrays.rows(query, "query", 3, self.dtype)
        self._query_radii = _arrays.radii_of(radii, "query_radii", self._query.shape[0], self.dtype)

    def set_cutoff(self, cutoff: Any) -> float:
        """Sets and returns the radius of which the double is exactly the cutoff."""
        radius = _half(cutoff, self.dtype.name)
        self._radii = np.full(1, radius, self.dtype)
        return radius

    def rows(self) -> int:
        return (self._positions if self._query is None else self._query).shape[0]

    def largest(self) -> int:
        return max(self._positions.shape[0], self.rows())

    def run(self, collider: Any, half: bool, contacts: bool) -> int:
        if self.periodic and self._query is not None:
            return collider.search_periodic_between(self._query, self._query_radii,
                                                    self._positions, self._radii, self._cells)
        if self.periodic and self._batch is not None:
            return collider.search_periodic_systems(self._positions, self._radii, self._batch,
                                                    self._cells, half)
        if self.periodic:
            return collider.search_periodic(self._positions, self._radii, self._cells, half)
        if self._query is None and self._batch is None and not contacts:
            return collider.search_pairs(self._positions, self._radii, half)
        if self._query is None:
            return collider.search(self._positions, self._radii, self._batch, half)
        return collider.search_between(self._query, self._query_radii, self._positions, self._radii)


def _pair_search(dtype: Any, positions: Any, cutoff: Any, radii: Any, query: Any,
                 query_radii: Any, batch: Any, periodic: Any) -> _Search:
    """The search of find_pairs(): spheres whose radius is half of the cutoff touch within it."""
    _check_radii(cutoff, radii, query, query_radii)
    if cutoff is None:
        search = _Search(dtype, positions, radii, batch)
    else:
        search = _Search(dtype, positions, 1, batch)
        query_radii = search.set_cutoff(cutoff)
    if query is not None:
        search.add_query(query, query_radii)
    search.set_periodic(periodic)
    return search


def _device_search(dtype: Any, positions: Any, cutoff: Any, radii: Any, query: Any,
                   query_radii: Any, batch: Any, periodic: Any,
                   device: Any) -> _device.DeviceSearch:
    """The same on a device, for find_contacts(), too, without cutoff."""
    _check_radii(cutoff, radii, query, query_radii)
    search = _device.DeviceSearch(positions, device, dtype)
    if cutoff is not None:
        radii = query_radii = _half(cutoff, search.dtype)
    search.set_radii(radii)
    if query is not None:
        search.set_query(query, query_radii)
    if batch is not None:
        search.set_batch(batch)
    search.set_periodic(periodic)
    return search


def _check_radii(cutoff: Any, radii: Any, query: Any, query_radii: Any) -> None:
    if (cutoff is None) == (radii is None):
        raise InvalidArgument("find_pairs() takes either cutoff or radii")
    if cutoff is not None and query_radii is not None:
        raise InvalidArgument("query_radii requires radii instead of cutoff")
    if cutoff is None and (query is None) != (query_radii is None):
        raise InvalidArgument("with radii, query and query_radii are given together")


def _half(cutoff: Any, dtype: str) -> float:
    """The radius of which the double is exactly the cutoff."""
    radius = _exact_half(_arrays.number(cutoff, "cutoff"), dtype)
    if radius is None:
        raise InvalidArgument(f"cutoff is {cutoff}; it must be finite and > 0 in {dtype}")
    _arrays.check_square(2 * radius, f"cutoff is {cutoff}", dtype)
    return radius


@functools.lru_cache(maxsize=256)
def _exact_half(cutoff: float, dtype: str) -> float | None:
    real = np.dtype(dtype).type
    with np.errstate(over="ignore"):
        value = real(cutoff)
    radius = value / real(2)  # before version 2, NumPy divides a float32 by 2 in float64
    return float(radius) if 0 < value < np.inf and radius + radius == value else None


def _check_points(positions: Any, index_dtype: Any, function: str) -> tuple[Callable[[np.ndarray], Any], np.ndarray, str]:
    """The function that converts results to the kind of the points, the points as rows in host memory, and the name
    of the type of indices."""
    if _device.is_on_device(positions):
        raise InvalidArgument(f"positions are on a device; {function}() takes arrays in host memory")
    convert = _arrays.from_host(positions)
    positions = _arrays.rows(positions, "positions", 3)
    index = _check_form("coo", index_dtype, None)
    if index == "int32" and positions.shape[0] > 2**31:
        raise InvalidArgument("more than 2^31 points require index_dtype=\"int64\"")
    return convert, positions, index


def _check_form(output: Any, index_dtype: Any, out: Any) -> str:
    """The name of the type of indices."""
    if output not in ("coo", "csr"):
        raise InvalidArgument(f"output is {output!r}; it must be 'coo' or 'csr'")
    if out is not None and output != "coo":
        raise InvalidArgument("out requires output='coo'")
    if index_dtype == "int32" or index_dtype == "int64":  # also a dtype of NumPy
        return str(index_dtype)
    name = str(index_dtype).removeprefix("torch.")
    if name not in _INDEX_TYPES:
        try:
            name = np.dtype(index_dtype).name
        except TypeError:
            pass
    if name not in _INDEX_TYPES:
        raise InvalidArgument(f"index_dtype is {index_dtype!r}; it must be int32 or int64")
    return name


def _refuse_count(count: Any) -> None:
    if count is not None:
        raise InvalidArgument("count requires positions on a device")


def _target(output: _arrays.Output, size: int) -> np.ndarray:
    """An array of the caller with room for `size` contacts."""
    array, name = output.array, output.name
    if not isinstance(array, np.ndarray):
        if not hasattr(array, "__dlpack__"):  # would be converted to a copy
            raise InvalidArgument(f"{name} is {type(array).__name__}; it must be an array")
        array = _arrays.to_host(array, name)
    if array.dtype.name not in output.dtypes:
        raise InvalidArgument(f"{name} has dtype {array.dtype}; it must be "
                              + " or ".join(output.dtypes))
    if array.ndim != len(output.shape) or any(
            have < size if need is None else have != need
            for have, need in zip(array.shape, output.shape)):
        needed = tuple(size if need is None else need for need in output.shape)
        raise InvalidArgument(f"{name} has shape {array.shape}; it must have room for {needed}")
    if not array.flags.writeable:
        raise InvalidArgument(f"{name} is read-only")
    return array


_local = threading.local()


def _shared(dtype: np.dtype, threads: Any, device: Any) -> SphereCollider:
    """The collider of this thread for a type and a number of threads."""
    if device not in (None, "cpu"):
        raise InvalidArgument(f"positions are in host memory, and device is {device!r}; move them "
                              "to the device, or use SphereCollider(backend=\"cuda\")")
    colliders = _local.__dict__.setdefault("colliders", {})
    key = dtype, _arrays.count(threads, "threads", 0, 256)
    if key not in colliders:
        colliders[key] = SphereCollider(dtype, backend="cpu", threads=threads)
    return colliders[key]


def _of_devices(dtype: str) -> SphereCollider:
    """The collider of this thread for arrays on devices."""
    colliders = _local.__dict__.setdefault("of_devices", {})
    if dtype not in colliders:
        colliders[dtype] = SphereCollider(dtype)
    return colliders[dtype]


@overload
def find_contacts(positions: Any, radii: Any, *, batch: Any = None,
                  periodic: None = None, device: Any = None, output: Literal["coo"] = "coo", half: bool = True,
                  index_dtype: Any = "int32", threads: int = 1) -> Contacts: ...


@overload
def find_contacts(positions: Any, radii: Any, *, batch: Any = None,
                  periodic: None = None, device: Any = None, output: Literal["csr"], half: bool = True,
                  index_dtype: Any = "int32", threads: int = 1) -> ContactRows: ...


@overload
def find_contacts(positions: Any, radii: Any, *, batch: Any = None,
                  periodic: Any, device: Any = None, output: Literal["coo"] = "coo", half: bool = True,
                  index_dtype: Any = "int32", threads: int = 1) -> PeriodicContacts: ...


@overload
def find_contacts(positions: Any, radii: Any, *, batch: Any = None,
                  periodic: Any, device: Any = None, output: Literal["csr"], half: bool = True,
                  index_dtype: Any = "int32", threads: int = 1) -> PeriodicContactRows: ...


def find_contacts(positions: Any, radii: Any, *, batch: Any = None, periodic: Any = None,
                  device: Any = None, output: str = "coo", half: bool = True, index_dtype: Any = "int32",
                  threads: int = 1) -> Any:
    """Finds all touching pairs of spheres. The number of contacts is limited by memory only.

    Two spheres touch if the distance of their centres is at most the sum of their radii. May be
    called from any number of threads. The CPU searches arrays in host memory, with one thread unless
    `threads` is given; SphereCollider can copy them to a GPU.

    Parameters
    ----------
    positions : array (N, 3) of float32 or float64, N < 2^32, on a device N <= 2^31
        Centres, finite, in any unit of length: radii, distances and lengths of cells have the same.
        The sum of two radii must be in [3.2e-16, 1.8e19] in float32 and in [1e-146, 1.3e154] in
        float64, where its square is exact to a rounding; arrays of radii on a device are not checked.
        NumPy, any array with DLPack, or nested lists, which become float64. Any strides. Arrays of
        PyTorch and CuPy on a CUDA device, and those that share with them, are searched there in
        the order of the current stream.
    radii : number or array (N,) of the type of `positions`
        Finite and > 0.
    batch : array of integers, optional
        Offsets of independent systems, from 0 to N: system i has the spheres batch[i] to
        batch[i + 1] - 1. Spheres of different systems do not touch. On a device, all pairs of each
        system are tested.
    periodic : three lengths, optional
        Lengths of an orthogonal cell that repeats; None along an axis that does not. Each length is
        at least twice the largest sum of two radii. The nearest image of a sphere counts, and its
        shift is returned. Positions may be outside of the cell, less than 2^20 lengths from
        the origin. With `batch`, the cell is that of each system, or there is a row of three
        lengths for each.
    device : "cpu", "cuda" or "cuda:N", optional
        Must be the device of the arrays, which is the default.
    output : "coo" or "csr"
        Pairs, or compressed rows.
    half : bool
        True: each pair once, with a < b. False: also (b, a), with the opposite normal.
    index_dtype : "int32" or "int64"
        Type of the indices; int64 is necessary for more than 2^31 spheres.
    threads : int in [0, 256]
        Number of threads of the CPU; 0: one per core. Has no effect on the result.

    Returns
    -------
    Contacts or ContactRows; PeriodicContacts or PeriodicContactRows with `periodic`
        Arrays of the kind of `positions`, sorted by (a, b).

    Raises
    ------
    InvalidArgument
        A wrong shape, type or device; a value that is not finite; a radius that is not > 0; an
        option out of its range; offsets that do not ascend from 0 to N; a bad length of a cell.
    OutOfMemory
        In host memory, or in that of the device.
    KeyboardInterrupt
        Ctrl-C was pressed during a search of the main thread, in host memory. A search on a device
        is completed first.
    DeviceError, BackendUnavailable
        For arrays on a device: a call of CUDA failed, or the package has no CUDA, or the device
        cannot be used.
    """
    if _device.is_on_device(positions):
        search = _device_search(None, positions, None, radii, None, None, batch, periodic, device)
        return _of_devices(search.dtype)._find_on_device(search, output, half, index_dtype, None,
                                                         None, contacts=True)
    search = _Search(None, positions, radii, batch)
    search.set_periodic(periodic)
    collider = _shared(search.dtype, threads, device)
    return collider._find(search, output, half, index_dtype, None, contacts=True)


@overload
def find_pairs(positions: Any, cutoff: Any = None, *, radii: Any = None, query: Any = None,
               query_radii: Any = None, batch: Any = None,
               periodic: None = None, device: Any = None, output: Literal["coo"] = "coo", half: bool = True,
               index_dtype: Any = "int32", threads: int = 1) -> Any: ...


@overload
def find_pairs(positions: Any, cutoff: Any = None, *, radii: Any = None, query: Any = None,
               query_radii: Any = None, batch: Any = None,
               periodic: None = None, device: Any = None, output: Literal["csr"], half: bool = True,
               index_dtype: Any = "int32", threads: int = 1) -> Rows: ...


@overload
def find_pairs(positions: Any, cutoff: Any = None, *, radii: Any = None, query: Any = None,
               query_radii: Any = None, batch: Any = None,
               periodic: Any, device: Any = None, output: Literal["coo"] = "coo", half: bool = True,
               index_dtype: Any = "int32", threads: int = 1) -> PeriodicPairs: ...


@overload
def find_pairs(positions: Any, cutoff: Any = None, *, radii: Any = None, query: Any = None,
               query_radii: Any = None, batch: Any = None,
               periodic: Any, device: Any = None, output: Literal["csr"], half: bool = True,
               index_dtype: Any = "int32", threads: int = 1) -> PeriodicRows: ...


def find_pairs(positions: Any, cutoff: Any = None, *, radii: Any = None, query: Any = None,
               query_radii: Any = None, batch: Any = None, periodic: Any = None,
               device: Any = None, output: str = "coo", half: bool = True, index_dtype: Any = "int32",
               threads: int = 1) -> Any:
    """Finds all pairs of points within a cutoff, or of spheres that touch, as indices alone. May be
    called from any number of threads.

    Parameters
    ----------
    positions : array (N, 3) of float32 or float64
        Points, finite, in any unit of length.
    cutoff : number
        Finite and > 0, in the same unit: pairs at this distance or closer, as the type of
        `positions` computes it.
    radii : number or array (N,)
        Instead of `cutoff`, as in find_contacts().
    query : array (M, 3) of the type of `positions`, optional
        Finds pairs of a point of `query` and a point of `positions`, and no others: pairs[0] are
        indices of `query`, pairs[1] of `positions`. `half` has no effect.
    query_radii : number or array (M,)
        With `radii` and `query`: the radii of `query`.
    batch, periodic, device, output, half, index_dtype, threads
        As in find_contacts(). `batch` and `query` exclude each other.

    Returns
    -------
    array (2, E), or Rows; PeriodicPairs or PeriodicRows with `periodic`
        Of the kind of `positions`, sorted by (a, b).

    Raises
    ------
    InvalidArgument, OutOfMemory, KeyboardInterrupt, DeviceError, BackendUnavailable
        As find_contacts(). InvalidArgument also for arguments that exclude each other, or that
        require another.
    """
    if _device.is_on_device(positions):
        search = _device_search(None, positions, cutoff, radii, query, query_radii, batch,
                                periodic, device)
        return _of_devices(search.dtype)._find_on_device(search, output, half, index_dtype, None,
                                                         None, contacts=False)
    search = _pair_search(None, positions, cutoff, radii, query, query_radii, batch, periodic)
    collider = _shared(search.dtype, threads, device)
    return collider._find(search, output, half, index_dtype, None, contacts=False)


def available_backends() -> list[dict[str, Any]]:
    """Status of "cpu" and "cuda", in this order. Starts CUDA where there is a GPU. A device that is
    missing raises nothing.

    Returns
    -------
    list of dict
        "backend", its name; "compiled", whether the package has it; "usable", whether it can be
        used now; "device", the name of the processor or GPU, empty if unknown; "reason", why it is
        unusable, otherwise empty.
    """
    return _core.f32.available_backends()


def available_gpus() -> list[dict[str, Any]]:
    """The GPUs of this machine. A GPU that is unusable raises nothing.

    Returns
    -------
    list of dict
        "number", for `device`; "name"; "usable", whether it can be used now; "reason", why it is
        unusable, otherwise empty; "linked", the numbers of the GPUs with which it can exchange memory
        by a link with atomic operations, such as NVLink. Empty without a driver.
    """
    return _core.f32.available_gpus()

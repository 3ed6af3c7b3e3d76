"""Searches on arrays in device memory, of PyTorch, CuPy, and libraries that share with one of them."""

from __future__ import annotations

import functools
import importlib
import sys
from collections.abc import Callable
from typing import Any, NamedTuple

from . import _arrays
from ._errors import BackendUnavailable, InvalidArgument

_CUDA_DEVICES = (2, 13)  # kDLCUDA and kDLCUDAManaged of DLPack


def is_on_device(array: Any) -> bool:
    """Whether an array is in the memory of a CUDA device."""
    if isinstance(array, _arrays.np.ndarray):
        return False
    is_cuda = getattr(array, "is_cuda", None)
    if is_cuda is not None:
        return bool(is_cuda)
    if hasattr(array, "__dlpack_device__"):
        return array.__dlpack_device__()[0] in _CUDA_DEVICES
    return hasattr(array, "__cuda_array_interface__")


def stream_address(stream: Any, device: int) -> int:
    """Address of a CUDA stream of PyTorch, CuPy or another library; None: the current stream of
    PyTorch, if it uses a GPU, or of CuPy, otherwise the default stream."""
    if stream is None:
        torch, cupy = sys.modules.get("torch"), sys.modules.get("cupy")
        if torch is not None and torch.cuda.is_initialized():
            return torch.cuda.current_stream(device).cuda_stream
        if cupy is not None:
            with cupy.cuda.Device(device):
                return cupy.cuda.get_current_stream().ptr
        return 0
    for name in ("cuda_stream", "ptr"):
        if hasattr(stream, name):
            return int(getattr(stream, name))
    if hasattr(stream, "__cuda_stream__"):
        return int(stream.__cuda_stream__()[1])
    if isinstance(stream, int) and not isinstance(stream, bool) and stream >= 0:
        return stream
    raise InvalidArgument(f"stream is {stream!r}; it must be a CUDA stream or the address of one")


class View(NamedTuple):
    """An array in device memory. Strides count elements."""

    address: int
    shape: tuple[int, ...]
    strides: tuple[int, ...]
    dtype: str
    device: int


class _Torch:
    """Arrays of PyTorch, in the order of its current stream."""

    def __init__(self) -> None:
        torch = importlib.import_module("torch")
        self._torch = torch
        self._names = {getattr(torch, name): name for name in _TYPES}
        self._types = {name: dtype for dtype, name in self._names.items()}
        # The stream of PyTorch without an object of PyTorch, as its own compiler uses it.
        self._raw_stream = getattr(getattr(torch, "_C", None), "_cuda_getCurrentRawStream", None)

    def stream(self, array: Any) -> int:
        if self._raw_stream is not None:
            return self._raw_stream(array.get_device())
        return self._torch.cuda.current_stream(array.device).cuda_stream

    def view(self, array: Any) -> View:
        dtype = array.dtype
        return View(array.data_ptr(), tuple(array.shape), array.stride(),
                    self._names.get(dtype) or str(dtype).removeprefix("torch."), array.get_device())

    @staticmethod
    def address(array: Any) -> int:
        return array.data_ptr()

    @staticmethod
    def to_host(array: Any) -> Any:
        return array.cpu()

    def empty(self, shape: tuple[int, ...], dtype: str, like: Any) -> Any:
        return self._torch.empty(shape, dtype=self._types[dtype], device=like.device)

    @staticmethod
    def head(array: Any, shape: tuple[int, int]) -> Any:
        return array.as_strided(shape, (shape[1], 1))

    @staticmethod
    def copy(array: Any) -> Any:
        return array.clone()


class _Cupy:
    """Arrays of CuPy, in the order of its current stream."""

    def __init__(self) -> None:
        self._cupy = importlib.import_module("cupy")

    def stream(self, array: Any) -> int:
        with array.device:
            return self._cupy.cuda.get_current_stream().ptr

    def view(self, array: Any) -> View:
        size = array.itemsize
        return View(array.data.ptr, array.shape, tuple(stride // size for stride in array.strides),
                    array.dtype.name, array.device.id)

    @staticmethod
    def address(array: Any) -> int:
        return array.data.ptr

    @staticmethod
    def to_host(array: Any) -> Any:
        return array.get()

    def empty(self, shape: tuple[int, ...], dtype: str, like: Any) -> Any:
        with like.device:
            return self._cupy.empty(shape, dtype)

    @staticmethod
    def head(array: Any, shape: tuple[int, int]) -> Any:
        return array[:shape[0] * shape[1]].reshape(shape)

    @staticmethod
    def copy(array: Any) -> Any:
        return array.copy()


_TYPES = ("float32", "float64", "int32", "int64")
_LIBRARIES = {"torch": _Torch, "cupy": _Cupy}


@functools.cache
def _functions(library: str) -> Any:
    """The functions of a library, which is imported already."""
    return _LIBRARIES[library]()


@functools.cache
def _library_of(kind: type) -> str:
    return kind.__module__.partition(".")[0]


def _library(array: Any) -> str:
    return _library_of(type(array))


def _adapted(array: Any, name: str) -> Any:
    """The array as one of PyTorch or CuPy, without a copy."""
    if _library(array) in _LIBRARIES:
        return array
    for library in ("cupy", "torch"):
        try:
            module = importlib.import_module(library)
        except ImportError:
            continue
        if hasattr(array, "__dlpack__"):
            return module.from_dlpack(array)
        return module.asarray(array, **({"device": "cuda"} if library == "torch" else {}))
    raise InvalidArgument(f"{name} is a device array of {_library(array)}, which requires CuPy or "
                          "PyTorch to be installed")


def _converter(like: Any) -> Callable[[Any], Any]:
    """The function that converts a result to the kind of `like`."""
    if _library(like) in _LIBRARIES or not hasattr(like, "__array_namespace__"):
        return _unchanged
    return like.__array_namespace__().from_dlpack


def _unchanged(array: Any) -> Any:
    return array


class DeviceSearch:
    """The validated arguments of a search on a device."""

    def __init__(self, positions: Any, device: Any, dtype: Any = None) -> None:
        self.convert = _converter(positions)
        positions = _adapted(positions, "positions")
        self._functions = _functions(_library(positions))
        self._kept = [positions]  # views do not own memory
        self.stream = self._functions.stream(positions)
        self._positions = self._rows(self._functions.view(positions), "positions")
        self.dtype = self._positions.dtype
        self.device = self._positions.device
        if self.dtype not in ("float32", "float64"):
            raise InvalidArgument(f"positions has dtype {self.dtype}; it must be float32 or float64")
        if dtype is not None and self.dtype != str(dtype):
            raise InvalidArgument(f"positions has dtype {self.dtype}; it must be {dtype}")
        if device is not None and str(device) not in ("cuda", f"cuda:{self.device}"):
            raise InvalidArgument(f"positions are on cuda:{self.device}, and device is {device!r}")
        self._query: Any = None
        self._batch: Any = None
        self.periodic = False

    def _rows(self, view: View, name: str) -> View:
        if len(view.shape) != 2 or view.shape[1] != 3:
            raise InvalidArgument(f"{name} has shape {view.shape}; it must be (N, 3)")
        return view

    def _view(self, array: Any, name: str) -> View:
        """An array of the device and type of the positions."""
        if not is_on_device(array):
            raise InvalidArgument(f"{name} is not an array on cuda:{self.device}, where the "
                                  "positions are")
        array = _adapted(array, name)
        view = _functions(_library(array)).view(array)
        self._kept.append(array)
        if view.device != self.device:
            raise InvalidArgument(f"{name} is on cuda:{view.device}, and positions are on "
                                  f"cuda:{self.device}")
        if view.dtype != self.dtype:
            raise InvalidArgument(f"{name} has dtype {view.dtype}; it must be that of the "
                                  f"positions, {self.dtype}")
        return view

    def _arrays(self, rows: View, radii: Any, name: str) -> tuple[Any, ...]:
        """The arguments of the binding for positions and their radii."""
        size = rows.shape[0]
        start = (rows.address, size, *rows.strides)
        if isinstance(radii, (bool, int, float)) or getattr(radii, "shape", None) == ():
            if hasattr(radii, "shape"):
                radii = radii.item()  # waits, where it is on the device
            return *start, 0, 0, _arrays.radius_of(radii, name, self.dtype)
        view = self._view(radii, name)
        if view.shape != (size,):
            raise InvalidArgument(f"{name} has shape {view.shape}; it must be a number or ({size},)")
        return *start, view.address, view.strides[0], 0.0

    def set_radii(self, radii: Any) -> None:
        self._spheres = self._arrays(self._positions, radii, "radii")

    def set_query(self, query: Any, radii: Any) -> None:
        rows = self._rows(self._view(query, "query"), "query")
        self._query = self._arrays(rows, radii, "query_radii")

    def set_batch(self, batch: Any) -> None:
        """Offsets of systems, which are copied to the host if they are on the device."""
        if self._query is not None:
            raise InvalidArgument("query and batch exclude each other")
        if is_on_device(batch):
            batch = _adapted(batch, "batch")
            batch = _functions(_library(batch)).to_host(batch)
        self._batch = _arrays.offsets(batch, "batch", self._positions.shape[0])

    def set_periodic(self, lengths: Any) -> None:
        self._cells = _arrays.cells(lengths, None if self._batch is None else len(self._batch) - 1)
        self.periodic = self._cells is not None

    def rows(self) -> int:
        return (self._query or self._spheres)[1]

    def waits(self) -> bool:
        """Whether the search is one that cannot be enqueued without a wait."""
        return self._query is not None or self._batch is not None

    def run(self, core: Any, contacts: bool, half: bool) -> int:
        """Waits for the number of contacts, and returns it."""
        if self.periodic and self._query is not None:
            return core.find_periodic_between(self._query, self._spheres, self._cells, contacts,
                                              self.stream)
        if self.periodic and self._batch is not None:
            return core.find_periodic_in_systems(self._spheres, self._batch, self._cells, contacts,
                                                 not half, self.stream)
        if self.periodic:
            return core.find_periodic(self._spheres, self._cells, contacts, not half,
                                      self.stream)
        if self._query is not None:
            return core.find_between(self._query, self._spheres, contacts, self.stream)
        if self._batch is not None:
            return core.find_in_systems(self._spheres, self._batch, contacts, not half,
                                        self.stream)
        return core.find(self._spheres, contacts, not half, self.stream)

    def enqueue(self, core: Any, contacts: bool) -> None:
        core.enqueue(self._spheres, contacts, self.stream)

    def collider(self, cache: dict[Any, Any]) -> Any:
        """The collider of the binding for type, device and stream."""
        key = self.dtype, self.device, self.stream
        core = cache.get(key)
        if core is None:
            module = _arrays.precision_of(self.dtype)
            if not hasattr(module, "DeviceCollider"):
                raise BackendUnavailable("cuda: built without CUDA")
            core = cache[key] = module.DeviceCollider(self.device)
        return core

    def _empty(self, shape: tuple[int, ...], dtype: str) -> Any:
        return self._functions.empty(shape, dtype, self._kept[0])

    def finds_new_pairs(self, output: str, half: bool) -> bool:
        """Whether the search is one for new_pairs()."""
        return half and output == "coo" and not self.waits()

    def new_pairs(self, core: Any, index: str) -> list[Any]:
        """Searches, and returns the pairs, and the shifts in a periodic cell, in new arrays. A search
        writes to them directly, without a wait for the number of pairs, if they are about as many as
        in the last search."""
        address = self._functions.address
        expected = core.expected_periodic_pairs if self.periodic else core.expected_pairs
        capacity = expected + expected // 8 + 64
        while True:
            arrays = [self._empty((2 * capacity,), index)]
            to = address(arrays[0]), index == "int64"
            if self.periodic:
                arrays.append(self._empty((3 * capacity,), "int32"))
                size = core.find_periodic_pairs(self._spheres, self._cells, *to, address(arrays[1]),
                                                capacity, self.stream)
            else:
                size = core.find_pairs(self._spheres, *to, capacity, self.stream)
            if size <= capacity:
                break
            capacity = size
        results = [self._functions.head(array, shape)
                   for array, shape in zip(arrays, ((2, size), (size, 3)))]
        if capacity > 2 * size + 4096:  # do not keep the unused memory
            results = [self._functions.copy(result) for result in results]
        return [self.convert(result) for result in results]

    def results(self, core: Any, size: int, output: str, index: str, contacts: bool) -> list[Any]:
        """New arrays with the result of run()."""
        stream, empty, address = self.stream, self._empty, self._functions.address
        pairs = empty((2, size), index)
        a = address(pairs)
        core.write_pairs(a, a + size * (4 if index == "int32" else 8), index == "int64", size,
                         stream)
        result = [pairs]
        if output == "csr":
            offsets = empty((self.rows() + 1,), "int64")
            core.write_offsets(address(offsets), stream)
            result = [offsets, pairs[1]]
        if contacts:
            result += [empty((size, 3), self.dtype), empty((size,), self.dtype)]
            core.write_contacts(*map(address, result[-2:]), size, stream)
        if self.periodic:
            result.append(empty((size, 3), "int32"))
            core.write_shifts(address(result[-1]), size, stream)
        return [self.convert(array) for array in result]

    def write(self, core: Any, outputs: list[_arrays.Output], size: int | None) -> None:
        """Writes the result to arrays of the caller, with room for `size` contacts if it is known."""
        views = {output.field: self._target(output, size) for output in outputs}
        capacity = min(view.shape[output.shape.index(None)]
                       for view, output in zip(views.values(), outputs))
        pairs = views["pairs"]
        step = pairs.strides[0] * (4 if pairs.dtype == "int32" else 8)
        core.write_pairs(pairs.address, pairs.address + step, pairs.dtype == "int64", capacity,
                         self.stream)
        if "normal" in views:
            core.write_contacts(views["normal"].address, views["distance"].address, capacity,
                                self.stream)
        if "shifts" in views:
            core.write_shifts(views["shifts"].address, capacity, self.stream)

    def write_count(self, core: Any, count: Any) -> None:
        view = self._target(_arrays.Output("count", "count", count, (2,), ("int64",)), None)
        core.write_count(view.address, self.stream)

    def _target(self, output: _arrays.Output, size: int | None) -> View:
        """An array of the caller, on the device, whose rows are contiguous."""
        array, name, shape, dtypes = output.array, output.name, output.shape, output.dtypes
        if not is_on_device(array) or _library(array) not in _LIBRARIES:
            raise InvalidArgument(f"{name} must be a tensor of PyTorch or an array of CuPy on "
                                  f"cuda:{self.device}")
        view = self._functions.view(array)
        if view.device != self.device or view.dtype not in dtypes:
            raise InvalidArgument(f"{name} is on cuda:{view.device} with dtype {view.dtype}; it must "
                                  f"be on cuda:{self.device} with dtype {' or '.join(dtypes)}")
        fits = len(view.shape) == len(shape) and all(
            have >= (size or 0) if need is None else have == need
            for have, need in zip(view.shape, shape))
        if not fits:
            needed = tuple((size or "E") if need is None else need for need in shape)
            raise InvalidArgument(f"{name} has shape {view.shape}; it must have room for {needed}")
        if view.strides[-1] != 1 or (shape[-1] == 3 and view.strides[0] != 3):
            raise InvalidArgument(f"{name} is not contiguous")
        return view

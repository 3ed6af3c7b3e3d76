"""Worlds that several processes of MPI hold together, by the package mpi4py.

Communicator is the `communicator` of a World. All processes then make the same calls of the world in
the same order, and get the same results, which have the bits of a world of one process::

    # mpirun -n 4 python -m mpi4py program.py
    from mpi4py import MPI
    import jfpx

    world = jfpx.World("pile", communicator=MPI.COMM_WORLD)
    world.run(600)
    positions = world.positions  # on all ranks
    if MPI.COMM_WORLD.rank == 0:
        print(positions.mean(axis=0))
"""

from __future__ import annotations

import importlib
import sys
from collections.abc import Sequence
from typing import Any

import numpy as np

from . import _arrays
from ._errors import Closed, InvalidArgument

__all__ = ["Communicator"]

_LARGEST_PART = 2**30  # [bytes] of a message; counts of MPI are of 32 bits
_MOST_RANKS = 2**16 - 1


def _mpi() -> Any:
    """The module mpi4py.MPI, whose import initializes MPI."""
    try:
        return importlib.import_module("mpi4py.MPI")
    except ModuleNotFoundError as error:
        if error.name not in ("mpi4py", "mpi4py.MPI"):
            raise
        raise ImportError("jfpx.mpi needs the package mpi4py: pip install mpi4py") from None


def _parts(message: Any) -> list[memoryview]:
    """The bytes of a message, as views that a count of MPI can hold."""
    data = memoryview(message)
    return [data[i:i + _LARGEST_PART] for i in range(0, len(data), _LARGEST_PART)]


class Communicator:
    """The ranks of a communicator of MPI, for worlds that they hold together. World makes one of a
    communicator of mpi4py by itself; programs that make many worlds make one for all of them.

    The messages of a communicator must not mix: one thread may use it, and its worlds, at a time.

    World takes any object with the attributes and methods of this class, for example for another
    transport than MPI. The methods are collective: all ranks call the same ones in the same order. A
    call returns when its data has arrived. The arguments of a call are valid until it returns.

    Parameters
    ----------
    comm : mpi4py.MPI.Intracomm, optional
        MPI.COMM_WORLD if absent. Its duplicate is used, so that other messages do not mix with those
        of worlds. The constructor is collective.

    Raises
    ------
    ImportError
        The package mpi4py is not installed.
    InvalidArgument
        `comm` is not an intracommunicator of mpi4py.
    """

    def __init__(self, comm: Any = None) -> None:
        mpi = _mpi()
        if comm is None:
            comm = mpi.COMM_WORLD
        if not isinstance(comm, mpi.Intracomm):
            raise InvalidArgument(f"comm is of type {type(comm).__name__}; it must be an intracommunicator of "
                                  "mpi4py, such as MPI.COMM_WORLD")
        self._mpi = mpi
        self._comm: Any = comm.Dup()
        self._rank: int = self._comm.rank
        self._size: int = self._comm.size

    @property
    def rank(self) -> int:
        """Number of this process, in [0, size - 1]."""
        return self._rank

    @property
    def size(self) -> int:
        """Number of ranks, in [1, 65535]."""
        return self._size

    def exchange(self, sent: Sequence[Any]) -> list[Any]:
        """Sends sent[r] to each rank r, and returns the messages of all ranks, as bytes or other
        objects with a buffer. The messages of a rank to itself are not used.

        Parameters
        ----------
        sent : list of memoryview
            A message for each rank; may be empty.
        """
        comm = self._open()
        sizes = np.array([len(message) for message in sent], np.int64)
        sizes[self._rank] = 0
        sizes_of_others = np.empty_like(sizes)
        comm.Alltoall(sizes, sizes_of_others)
        received = [np.empty(size, np.uint8) for size in sizes_of_others]
        self.exchange_sized(sent, received)
        return received

    def exchange_sized(self, sent: Sequence[Any], received: Sequence[Any]) -> None:
        """As exchange(), with messages whose sizes the receivers have.

        Parameters
        ----------
        sent : list of memoryview
            A message for each rank; an empty one is not sent.
        received : list of memoryview
            Writable, one for each rank, as long as the message of that rank; receives its bytes.
        """
        comm = self._open()
        # MPI keeps the order of the parts of a message.
        requests = [comm.Irecv([part, self._mpi.BYTE], rank)
                    for rank, message in enumerate(received) if rank != self._rank
                    for part in _parts(message)]
        requests += [comm.Isend([part, self._mpi.BYTE], rank)
                     for rank, message in enumerate(sent) if rank != self._rank
                     for part in _parts(message)]
        for request in requests:  # after an error, MPI_Waitall() of Open MPI 4.1 may not return
            request.Wait()

    def gather(self, own: Any, all: Any) -> None:
        """Sends the same bytes to all ranks.

        Parameters
        ----------
        own : memoryview
            Equally many bytes on all ranks.
        all : memoryview
            Writable, `size` times as many: receives those of all ranks, in their order.
        """
        count = len(own)
        if len(all) <= _LARGEST_PART:
            self._open().Allgather([own, self._mpi.BYTE], [all, self._mpi.BYTE])
            return
        places = [all[rank * count:(rank + 1) * count] for rank in range(self._size)]
        places[self._rank][:] = own
        self.exchange_sized([own] * self._size, places)

    def close(self) -> None:
        """Frees the duplicate; collective. Later calls of the methods, and steps of worlds that use
        the communicator, raise Closed."""
        if self._comm is not None and not self._mpi.Is_finalized():
            self._comm.Free()
        self._comm = None

    def _open(self) -> Any:
        if self._comm is None:
            raise Closed("the communicator is closed")
        return self._comm


def communicator_of(value: Any) -> tuple[Any, int, int]:
    """The communicator of a world, its rank and its size; (None, 0, 1) for None."""
    if value is None:
        return None, 0, 1
    mpi = sys.modules.get("mpi4py.MPI")
    if mpi is not None and isinstance(value, mpi.Comm):
        value = Communicator(value)
    elif isinstance(value, type) or any(
            not hasattr(value, name) for name in ("rank", "size", "exchange", "exchange_sized", "gather")):
        kind = f"the class {value.__name__}" if isinstance(value, type) else f"of type {type(value).__name__}"
        raise InvalidArgument(f"communicator is {kind}; it must be a communicator of mpi4py, such as "
                              "MPI.COMM_WORLD, a jfpx.mpi.Communicator, or an object with its attributes "
                              "and methods")
    size = _arrays.count(value.size, "communicator.size", 1, _MOST_RANKS)
    return value, _arrays.count(value.rank, "communicator.rank", 0, size - 1), size

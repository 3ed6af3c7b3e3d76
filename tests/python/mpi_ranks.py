"""Ranks of MPI hold worlds together: mpirun -n 3 python -m mpi4py mpi_ranks.py. Prints a line on each rank."""

import sys

import numpy as np
from mpi4py import MPI

import jfpx
import jfpx.mpi


def check_steps(communicator, dtype):
    """A world of all ranks, and one of this process with the same calls."""
    scene = jfpx.Scene.named("heap", spheres=80, dtype=dtype)
    worlds = jfpx.World(scene, communicator=communicator), jfpx.World(scene)
    rng = np.random.default_rng(1)
    for step in range(60):
        reports = [world.step() for world in worlds]
        assert reports[0][:10] == reports[1][:10]
        if step % 5 == 0:
            removed = int(rng.integers(len(worlds[0])))
            for world in worlds:
                world.remove(world.bodies[removed])
                world.add({"shape": {"type": "box", "half_extents": [0.2, 0.2, 0.2]}, "position": [0, 4, 0]})
                world.apply_impulse(world.bodies[-1], (0.1 * step, 0, 0))
        if step % 3 == 0:
            for one, other in zip(*(world.contacts() for world in worlds)):
                assert (one == other).all()
        if step % 4 == 0:
            assert (worlds[0].positions == worlds[1].positions).all()
        assert worlds[0].state_hash() == worlds[1].state_hash()
    assert worlds[0].snapshot() == worlds[1].snapshot() and len(worlds[0].contacts().distance) > 0
    worlds[0].close()
    return worlds[1].state_hash()


def check_messages(communicator):
    """Messages of many parts, and empty ones."""
    rank, size = communicator.rank, communicator.size

    def message(source, target, length):
        return memoryview(np.random.default_rng((source, target, length)).bytes(length))

    def length(source, target):
        return (source * 7919 + target * 104729) % 50000 if source != target + 1 else 0

    received = communicator.exchange([message(rank, other, length(rank, other)) for other in range(size)])
    for other in range(size):
        if other != rank:
            assert bytes(received[other]) == bytes(message(other, rank, length(other, rank)))
    for count in (0, 1, 999, 4001):
        every = bytearray(size * count)
        communicator.gather(message(rank, 0, count), memoryview(every))
        assert every == b"".join(message(other, 0, count) for other in range(size))


def main():
    comm = MPI.COMM_WORLD
    for part in (None, 1000):
        if part is not None:
            jfpx.mpi._LARGEST_PART = part
        with_ranks = jfpx.mpi.Communicator()
        check_messages(with_ranks)
        hashes = [check_steps(comm, "float32"), check_steps(with_ranks, "float64")]
        world = jfpx.World("pile", communicator=with_ranks)
        with_ranks.close()
        try:
            world.step()
            raise AssertionError("a closed communicator was used")
        except jfpx.Closed:
            pass
    assert comm.allgather(hashes) == [hashes] * comm.size
    for wrong, error in ((MPI.COMM_NULL, jfpx.InvalidArgument), (MPI, jfpx.InvalidArgument)):
        try:
            jfpx.World("pile", communicator=wrong)
            raise AssertionError(f"{wrong} was accepted")
        except error as refusal:
            assert "MPI.COMM_WORLD" in str(refusal)
    sys.stdout.write(f"rank {comm.rank} of {comm.size}: same bits\n")


main()

"""Worlds that several ranks hold together."""

import copy
import gc
import os
import pathlib
import pickle
import shutil
import subprocess
import sys
import threading
import weakref

import numpy as np
import pytest

import jfpx
import jfpx.mpi


class Group:
    """Ranks that are threads."""

    def __init__(self, size):
        self.size = size
        self.barrier = threading.Barrier(size, timeout=60)
        self.shared = [None] * size

    def run(self, body):
        """Calls body(communicator) in a thread for each rank, and returns the results, which may be exceptions."""
        results = [None] * self.size

        def call(rank):
            try:
                results[rank] = body(ThreadCommunicator(self, rank))
            except Exception as error:
                self.barrier.abort()
                results[rank] = error

        threads = [threading.Thread(target=call, args=(rank,)) for rank in range(self.size)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        return results


class ThreadCommunicator:
    """A communicator without MPI."""

    def __init__(self, group, rank):
        self.group, self.rank, self.size = group, rank, group.size
        self.calls = 0

    def share(self, value, read):
        """read(values of all ranks), while the values exist."""
        self.calls += 1
        self.group.shared[self.rank] = value
        self.group.barrier.wait()
        result = read(self.group.shared)
        self.group.barrier.wait()
        return result

    def exchange(self, sent):
        return self.share(sent, lambda shared: [bytes(messages[self.rank]) for messages in shared])

    def exchange_sized(self, sent, received):
        def read(shared):
            for rank, messages in enumerate(shared):
                if rank != self.rank:
                    received[rank][:] = messages[self.rank]
        self.share(sent, read)

    def gather(self, own, all):
        def read(shared):
            all[:] = b"".join(shared)
        self.share(own, read)


@pytest.mark.parametrize("size", [1, 3])
def test_ranks_of_threads_have_the_bits_of_one_world(dtype, size):
    scene = jfpx.Scene.named("heap", spheres=60, dtype=dtype)

    def body(communicator):
        with jfpx.World(scene, communicator=communicator, threads=2, hit_speed=0.5) as world:
            return results_of(world), communicator.calls

    def results_of(world):
        kept = []
        for step in range(40):
            report = world.step()
            kept += [report[:10], world.state_hash()]
            if step % 8 == 0:
                world.remove(world.bodies[step // 2 + 1])
                added = world.add({"shape": {"type": "sphere", "radius": 0.3}, "position": [0, 5, 0]})
                world.set_mass(added, 3)
            if step % 5 == 0:
                for arrays in (world.contacts(), world.hit_events(), world.contact_events(), world.states()):
                    kept += [array.tobytes() for array in arrays]
        world.run(20)
        return kept + [world.snapshot()]

    expected = results_of(jfpx.World(scene, hit_speed=0.5))
    for results, calls in Group(size).run(body):
        assert results == expected and (calls > 0) == (size > 1)


def test_ranks_save_states_in_one_array(tmp_path):
    scene = jfpx.Scene.named("heap", spheres=60)

    def body(communicator):
        name = "one" if communicator is None else "ranks"
        with jfpx.World(scene, communicator=communicator) as world:
            world.run(20)
            world.save_states(tmp_path / name)
            return world.states(), [body.index for body in world.bodies]

    expected, indices = body(None)
    Group(3).run(body)
    for name in ("one", "ranks"):
        saved = np.load(tmp_path / name, mmap_mode="r")
        np.testing.assert_array_equal(saved["index"], indices)
        np.testing.assert_array_equal(saved["generation"], [body.generation for body in jfpx.World(scene).bodies])
        for field, array in zip(("position", "orientation", "velocity", "angular_velocity"), expected):
            np.testing.assert_array_equal(saved[field], array)
    with pytest.raises(jfpx.FileError, match="nowhere"):
        jfpx.World(scene).save_states(tmp_path / "nowhere" / "states.npy")


def test_a_function_as_force_acts_once(rng):
    scene = jfpx.Scene.named("pile", spheres=30)
    forces = rng.uniform(-3, 3, (len(jfpx.World(scene)), 3)).astype(np.float32)

    def body(communicator):
        world = jfpx.World(scene, communicator=communicator)
        world.add_force(lambda context: context.apply_forces(forces * np.float32(context.states().positions[1, 1])))
        world.run(20)
        return world.state_hash()

    [expected] = Group(1).run(body)
    assert Group(2).run(body) == [expected] * 2


@pytest.mark.parametrize("method", ["exchange", "exchange_sized", "gather"])
def test_an_exception_of_a_communicator_is_raised_by_the_step(method):
    scene = jfpx.Scene.named("heap", spheres=60)

    def body(communicator):
        world = jfpx.World(scene, communicator=communicator)
        world.run(20)
        if communicator.rank == 1:
            def fail(*arguments):
                raise OSError("the cable is broken")
            setattr(communicator, method, fail)
        for _ in range(50):
            world.step()

    results = Group(2).run(body)
    assert isinstance(results[0], threading.BrokenBarrierError)
    assert isinstance(results[1], OSError) and str(results[1]) == "the cable is broken"


def with_method(method, replacement):
    """The exceptions of ranks, one of which has another method."""
    def body(communicator):
        world = jfpx.World("pile", communicator=communicator)
        if communicator.rank == 0:
            original = getattr(communicator, method)
            setattr(communicator, method, lambda *arguments: replacement(world, original, *arguments))
        world.run(20)

    return Group(2).run(body)[0]


def test_messages_are_valid_during_a_call():
    kept = []

    def gather(world, original, own, all):
        kept.append(own)
        original(own, all)

    assert with_method("gather", gather) is None
    with pytest.raises(ValueError, match="released memoryview"):
        bytes(kept[0])

    def gather_and_export(world, original, own, all):
        kept.append(pickle.PickleBuffer(own))
        original(own, all)

    assert isinstance(with_method("gather", gather_and_export), BufferError)


def test_messages_of_a_wrong_number_or_type_are_errors():
    error = with_method("exchange", lambda world, original, sent: original(sent)[:1])
    assert isinstance(error, jfpx.InvalidArgument)
    assert str(error) == "exchange() of the communicator returned 1 messages; there must be one from each of 2 ranks"
    assert isinstance(with_method("exchange", lambda world, original, sent: [None, "text"]), TypeError)


def test_a_communicator_must_not_use_its_world():
    def gather(world, original, own, all):
        original(own, all)
        world.state_hash()

    assert isinstance(with_method("gather", gather), jfpx.ConcurrentUse)

    def body(communicator):  # in a call that keeps the global lock
        world = jfpx.World("pile", communicator=communicator)
        world.run(20)
        original = communicator.exchange
        communicator.exchange = lambda sent: (original(sent), world.close())
        world.contacts()

    assert any(isinstance(error, jfpx.ConcurrentUse) for error in Group(2).run(body))


@pytest.mark.parametrize("wrong", [3, "world", object(), ThreadCommunicator])
def test_a_communicator_of_another_type_is_an_error(wrong):
    with pytest.raises(jfpx.InvalidArgument, match=r"must be a communicator of mpi4py, such as MPI\.COMM_WORLD, a "
                       r"jfpx\.mpi\.Communicator, or an object with its attributes and methods"):
        jfpx.World("pile", communicator=wrong)


def test_what_several_ranks_cannot_do_is_an_error():
    communicator = ThreadCommunicator(Group(2), 0)
    with pytest.raises(jfpx.InvalidArgument, match="the backend is cuda; it must be cpu"):
        jfpx.World("pile", communicator=communicator, backend="cuda")
    with pytest.raises(jfpx.InvalidArgument, match="the solver is worst_first; it must be soft_step"):
        jfpx.World({"solver": "worst_first", "bodies": []}, communicator=communicator)
    communicator.rank = 2
    with pytest.raises(jfpx.InvalidArgument, match=r"communicator\.rank is 2"):
        jfpx.World("pile", communicator=communicator)
    communicator.size = 2**16
    with pytest.raises(jfpx.InvalidArgument, match=r"communicator\.size is 65536"):
        jfpx.World("pile", communicator=communicator)


def test_a_copy_is_a_world_of_one_process():
    def body(communicator):
        world = jfpx.World("pile", communicator=communicator)
        world.run(20)
        other = copy.deepcopy(world)
        calls = communicator.calls
        other.run(20)
        assert communicator.calls == calls
        world.run(20)
        return world.state_hash() == other.state_hash()

    assert Group(2).run(body) == [True, True]


def test_a_communicator_that_refers_to_its_world_is_freed():
    communicator = ThreadCommunicator(Group(2), 0)
    communicator.world = jfpx.World("pile", communicator=communicator)
    reference = weakref.ref(communicator)
    del communicator
    gc.collect()
    assert reference() is None


def test_without_mpi4py_the_error_names_the_command():
    program = """
import sys
sys.modules["mpi4py"] = None
import jfpx.mpi
try:
    jfpx.mpi.Communicator()
except ImportError as error:
    print(error)
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.stdout == "jfpx.mpi needs the package mpi4py: pip install mpi4py\n", done.stderr


def test_ranks_of_mpi_have_the_bits_of_one_world():
    pytest.importorskip("mpi4py", reason="mpi4py is not installed; scripts/setup python installs it")
    mpirun = shutil.which("mpirun")
    if mpirun is None:
        pytest.skip("there is no mpirun; scripts/setup python installs it")
    version = subprocess.run([mpirun, "--version"], capture_output=True, text=True).stdout
    options = ["--oversubscribe"] if "Open MPI" in version else []
    environment = os.environ | {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
    script = pathlib.Path(__file__).with_name("mpi_ranks.py")
    done = subprocess.run([mpirun, *options, "-n", "3", sys.executable, "-m", "mpi4py", script],
                          env=environment, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stdout + done.stderr
    assert sorted(done.stdout.splitlines()) == [f"rank {rank} of 3: same bits" for rank in range(3)]

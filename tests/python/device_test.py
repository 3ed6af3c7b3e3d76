"""Searches on arrays in device memory. Without a GPU, or without PyTorch and CuPy, these tests are
skipped; with JFPX_REQUIRE_CUDA=1 they fail instead."""

import gc
import os
import threading
import weakref

import numpy as np
import pytest

import jfpx


def require(condition, reason):
    if not condition:
        (pytest.fail if os.environ.get("JFPX_REQUIRE_CUDA") else pytest.skip)(reason)


class Torch:
    def __init__(self):
        try:
            import torch
        except ImportError:
            pytest.skip("there is no PyTorch")
        require(torch.cuda.is_available(), "PyTorch has no GPU")
        self.module = torch
        self.array = torch.Tensor

    def to_device(self, array):
        return self.module.from_numpy(np.array(array)).cuda()

    def to_host(self, array):
        return array.cpu().numpy()

    def full(self, shape, value, dtype):
        return self.module.full(shape, value, dtype=getattr(self.module, dtype), device="cuda")


class Cupy:
    def __init__(self):
        try:
            import cupy
        except ImportError:
            pytest.skip("there is no CuPy")
        self.module = cupy
        self.array = cupy.ndarray

    def to_device(self, array):
        return self.module.asarray(array)

    def to_host(self, array):
        return array.get()

    def full(self, shape, value, dtype):
        return self.module.full(shape, value, dtype)


@pytest.fixture(params=[Torch, Cupy])
def library(request):
    cuda = next(row for row in jfpx.available_backends() if row["backend"] == "cuda")
    require(cuda["usable"], cuda["reason"])
    return request.param()


def random_spheres(rng, n, dtype):
    side = (n * 0.7) ** (1 / 3)
    return (rng.random((n, 3)) * side).astype(dtype), rng.uniform(0.2, 0.8, n).astype(dtype)


def check_equal(library, got, expected):
    """Equal bits, in arrays of the library."""
    assert len(got) == len(expected)
    for a, b in zip(got, expected):
        assert isinstance(a, library.array)
        host = library.to_host(a)
        assert host.dtype == b.dtype and host.shape == b.shape
        assert host.tobytes() == b.tobytes()


@pytest.mark.parametrize("n", [0, 1, 2, 300, 20_000])
@pytest.mark.parametrize("half", [True, False])
@pytest.mark.parametrize("index", ["int32", "int64"])
def test_device_arrays_have_the_bits_of_the_host(library, rng, dtype, n, half, index):
    positions, radii = random_spheres(rng, n, dtype)
    on_device = library.to_device(positions), library.to_device(radii)
    options = {"half": half, "index_dtype": index}
    for output in ("coo", "csr"):
        check_equal(library, jfpx.find_contacts(*on_device, output=output, **options),
                    jfpx.find_contacts(positions, radii, output=output, **options))
    pairs = jfpx.find_pairs(on_device[0], 0.9, **options)
    check_equal(library, [pairs], [jfpx.find_pairs(positions, 0.9, **options)])
    check_equal(library, jfpx.find_pairs(on_device[0], radii=on_device[1], output="csr", **options),
                jfpx.find_pairs(positions, radii=radii, output="csr", **options))


def test_numbers_of_pairs_may_change_from_call_to_call(library, rng, dtype):
    positions, _ = random_spheres(rng, 6000, dtype)
    x = library.to_device(positions)
    collider = jfpx.SphereCollider(dtype)
    for cutoff in (0.3, 2.5, 1e-6, 2.5, 2.4, 2.3, 0.3):
        for index in ("int32", "int64"):
            pairs = collider.find_pairs(x, cutoff, index_dtype=index)
            check_equal(library, [pairs], [jfpx.find_pairs(positions, cutoff, index_dtype=index)])
            is_contiguous = (pairs.is_contiguous() if isinstance(library, Torch)
                             else pairs.flags.c_contiguous)
            assert is_contiguous


def test_a_query_on_the_device_has_the_bits_of_the_host(library, rng, dtype):
    positions, radii = random_spheres(rng, 3000, dtype)
    query, query_radii = random_spheres(rng, 500, dtype)
    x, r, y, s = map(library.to_device, (positions, radii, query, query_radii))
    for output in ("coo", "csr"):
        got = jfpx.find_pairs(x, radii=r, query=y, query_radii=s, output=output)
        expected = jfpx.find_pairs(positions, radii=radii, query=query, query_radii=query_radii,
                                   output=output)
        check_equal(library, [got] if output == "coo" else got,
                    [expected] if output == "coo" else expected)
    check_equal(library, [jfpx.find_pairs(x, 0.5, query=y)],
                [jfpx.find_pairs(positions, 0.5, query=query)])


@pytest.mark.parametrize("half", [True, False])
def test_a_batch_on_the_device_has_the_bits_of_the_host(library, rng, dtype, half):
    offsets = np.cumsum([0, 0, 1, 2, 40, 300, 0, 1700])
    positions, radii = random_spheres(rng, offsets[-1], dtype)
    x, r = library.to_device(positions), library.to_device(radii)
    for batch in (offsets, library.to_device(offsets)):
        for output in ("coo", "csr"):
            check_equal(library, jfpx.find_contacts(x, r, batch=batch, half=half, output=output),
                        jfpx.find_contacts(positions, radii, batch=offsets, half=half, output=output))
        check_equal(library, [jfpx.find_pairs(x, 0.9, batch=batch, half=half)],
                    [jfpx.find_pairs(positions, 0.9, batch=offsets, half=half)])


@pytest.mark.parametrize("cell", [(12, 13, 11), (None, 13, None), (None, None, None)])
@pytest.mark.parametrize("half", [True, False])
def test_a_periodic_cell_on_the_device_has_the_bits_of_the_host(library, rng, dtype, cell, half):
    positions = (rng.random((4000, 3)) * 60 - 20).astype(dtype)
    radii = rng.uniform(0.2, 0.9, 4000).astype(dtype)
    x, r = library.to_device(positions), library.to_device(radii)
    for output in ("coo", "csr"):
        options = {"periodic": cell, "output": output, "half": half}
        check_equal(library, jfpx.find_contacts(x, r, **options),
                    jfpx.find_contacts(positions, radii, **options))
        check_equal(library, jfpx.find_pairs(x, 1.5, **options),
                    jfpx.find_pairs(positions, 1.5, **options))
        query = {"query": x[:300], "query_radii": r[:300]}
        host_query = {"query": positions[:300], "query_radii": radii[:300]}
        check_equal(library, jfpx.find_pairs(x[300:], radii=r[300:], **query, **options),
                    jfpx.find_pairs(positions[300:], radii=radii[300:], **host_query, **options))
        batch = {"batch": [0, 100, 100, 900, 1300], **options, "periodic": [cell, (9, 9, 9)] * 2}
        check_equal(library, jfpx.find_contacts(x[:1300], r[:1300], **batch),
                    jfpx.find_contacts(positions[:1300], radii[:1300], **batch))


def test_strided_device_arrays_are_taken_without_a_copy(library, rng, dtype):
    positions, radii = random_spheres(rng, 1000, dtype)
    wide = np.zeros((1000, 5), dtype)
    wide[:, 1:4] = positions
    expected = jfpx.find_contacts(positions, radii)
    pairs = np.repeat(radii, 2)
    check_equal(library, jfpx.find_contacts(library.to_device(wide)[:, 1:4],
                                            library.to_device(pairs)[::2]), expected)
    columns = library.to_device(np.ascontiguousarray(positions.T)).T
    check_equal(library, jfpx.find_contacts(columns, library.to_device(radii)), expected)


def test_out_on_the_device_receives_the_contacts(library, rng, dtype):
    positions, radii = random_spheres(rng, 2000, dtype)
    expected = jfpx.find_contacts(positions, radii)
    size = len(expected.distance)
    collider = jfpx.SphereCollider(dtype)
    x, r = library.to_device(positions), library.to_device(radii)
    out = jfpx.Contacts(library.full((2, size + 7), -1, "int32"),
                        library.full((size + 7, 3), 0, dtype.name),
                        library.full((size + 7,), 0, dtype.name))
    assert collider.find_contacts(x, r, out=out) == size
    np.testing.assert_array_equal(library.to_host(out.pairs)[:, :size], expected.pairs)
    np.testing.assert_array_equal(library.to_host(out.normal)[:size], expected.normal)
    np.testing.assert_array_equal(library.to_host(out.distance)[:size], expected.distance)
    assert (library.to_host(out.pairs)[:, size:] == -1).all()
    with pytest.raises(jfpx.InvalidArgument, match=rf"out has shape \(2, 5\).*\(2, {size}\)"):
        collider.find_pairs(x, radii=r, out=library.full((2, 5), 0, "int64"))


def test_out_on_the_device_receives_the_contacts_of_a_periodic_cell(library, rng, dtype):
    positions, radii = random_spheres(rng, 2000, dtype)
    x, r = library.to_device(positions), library.to_device(radii)
    collider = jfpx.SphereCollider(dtype)
    for options in ({}, {"half": False}, {"batch": [0, 900, 2000]}):
        options["periodic"] = (11, None, 12)
        expected = jfpx.find_contacts(positions, radii, **options)
        size = len(expected.distance)
        out = jfpx.PeriodicContacts(library.full((2, size + 7), -1, "int32"),
                                    library.full((size + 7, 3), 0, dtype.name),
                                    library.full((size + 7,), 0, dtype.name),
                                    library.full((size + 7, 3), -9, "int32"))
        assert collider.find_contacts(x, r, out=out, **options) == size > 0
        got = [library.to_host(array) for array in out]
        for a, b in zip((got[0].T, *got[1:]), (expected.pairs.T, *expected[1:])):
            np.testing.assert_array_equal(a[:size], b)
        assert (got[0][:, size:] == -1).all() and (got[3][size:] == -9).all()
        pairs = jfpx.PeriodicPairs(library.full((2, size), 0, "int64"),
                                   library.full((size, 3), 0, "int32"))
        assert collider.find_pairs(x, radii=r, out=pairs, **options) == size
        check_equal(library, [pairs.shifts], [expected.shifts])


def test_count_on_the_device_needs_no_wait(library, rng, dtype):
    positions, radii = random_spheres(rng, 2000, dtype)
    expected = jfpx.find_pairs(positions, radii=radii)
    size = expected.shape[1]
    collider = jfpx.SphereCollider(dtype)
    x, r = library.to_device(positions), library.to_device(radii)
    out, count = library.full((2, size), -1, "int64"), library.full((2,), -1, "int64")
    collider.reserve(x, 2000, size)
    assert collider.find_pairs(x, radii=r, out=out, count=count) is None
    assert library.to_host(count).tolist() == [size, 1]
    np.testing.assert_array_equal(library.to_host(out), expected)


def test_a_search_is_captured_in_a_graph_of_torch(rng, dtype):
    torch = Torch().module
    positions, radii = random_spheres(rng, 5000, dtype)
    collider = jfpx.SphereCollider(dtype)
    x, r = torch.from_numpy(positions).cuda(), torch.from_numpy(radii).cuda()
    out = torch.empty((2, 200_000), dtype=torch.int32, device="cuda")
    count = torch.empty(2, dtype=torch.int64, device="cuda")
    stream = torch.cuda.Stream()
    stream.wait_stream(torch.cuda.current_stream())
    graph = torch.cuda.CUDAGraph()
    with torch.cuda.stream(stream):
        collider.reserve(x, 5000, 200_000)
        collider.find_pairs(x, radii=r, out=out, count=count)  # loads the kernels
    with torch.cuda.graph(graph, stream=stream):
        collider.find_pairs(x, radii=r, out=out, count=count)
    for shift in (0, 1):
        moved = np.roll(positions, shift, axis=0)
        x.copy_(torch.from_numpy(moved))
        graph.replay()
        expected = jfpx.find_pairs(moved, radii=radii)
        assert count.tolist() == [expected.shape[1], 1]
        np.testing.assert_array_equal(out[:, :expected.shape[1]].cpu().numpy(), expected)


def test_a_search_for_contacts_is_captured_in_a_graph_of_torch(rng, dtype):
    torch = Torch().module
    positions, radii = random_spheres(rng, 5000, dtype)
    collider = jfpx.SphereCollider(dtype)
    x, r = torch.from_numpy(positions).cuda(), torch.from_numpy(radii).cuda()
    size = 60_000
    out = jfpx.Contacts(torch.empty((2, size), dtype=torch.int64, device="cuda"),
                        torch.empty((size, 3), dtype=x.dtype, device="cuda"),
                        torch.empty(size, dtype=x.dtype, device="cuda"))
    count = torch.empty(2, dtype=torch.int64, device="cuda")
    stream = torch.cuda.Stream()
    stream.wait_stream(torch.cuda.current_stream())
    graph = torch.cuda.CUDAGraph()
    with torch.cuda.stream(stream):
        collider.reserve(x, 5000, size)
        collider.find_contacts(x, r, out=out, count=count)  # loads the kernels
    with torch.cuda.graph(graph, stream=stream):
        collider.find_contacts(x, r, out=out, count=count)
    for factor in (1, 0.9):
        x.copy_(torch.from_numpy(positions * dtype.type(factor)))
        graph.replay()
        expected = jfpx.find_contacts(positions * dtype.type(factor), radii)
        found = len(expected.distance)
        assert count.tolist() == [found, 1]
        np.testing.assert_array_equal(out.pairs[:, :found].cpu().numpy(), expected.pairs)
        np.testing.assert_array_equal(out.normal[:found].cpu().numpy(), expected.normal)
        np.testing.assert_array_equal(out.distance[:found].cpu().numpy(), expected.distance)


def test_the_current_stream_of_torch_is_respected(rng):
    torch = Torch().module
    positions, _ = random_spheres(rng, 50_000, np.dtype("float32"))
    expected = jfpx.find_pairs(positions, 0.9)
    stream = torch.cuda.Stream()
    x = torch.zeros((50_000, 3), device="cuda")
    source = torch.from_numpy(positions).cuda()
    torch.cuda.synchronize()
    for _ in range(5):
        with torch.cuda.stream(stream):
            x.zero_()
            torch.cuda._sleep(20_000_000)  # the copy comes late
            x.copy_(source)
            pairs = jfpx.find_pairs(x, 0.9)
            total = pairs.to(torch.int64).sum()
        stream.synchronize()
        np.testing.assert_array_equal(pairs.cpu().numpy(), expected)
        assert total.item() == expected.sum(dtype=np.int64)


def test_arrays_of_jax_are_taken(rng):
    jax = pytest.importorskip("jax")
    if jax.default_backend() != "gpu":
        pytest.skip("JAX has no GPU")
    positions, radii = random_spheres(rng, 1000, np.dtype("float32"))
    got = jfpx.find_contacts(jax.numpy.asarray(positions), jax.numpy.asarray(radii))
    assert isinstance(got.pairs, jax.Array)
    np.testing.assert_array_equal(np.asarray(got.pairs), jfpx.find_contacts(positions, radii).pairs)


@pytest.mark.parametrize("call, message", [
    (lambda x, r, to: jfpx.find_contacts(x[0], 1), "positions has shape"),
    (lambda x, r, to: jfpx.find_contacts(to(np.zeros((3, 3), int)), 1), "positions has dtype int64"),
    (lambda x, r, to: jfpx.find_contacts(x, r[:2]), r"radii has shape \(2,\)"),
    (lambda x, r, to: jfpx.find_contacts(x, np.ones(3, np.float32)), "radii is not an array on"),
    (lambda x, r, to: jfpx.find_contacts(x, to(np.ones(3))), "radii has dtype float64"),
    (lambda x, r, to: jfpx.find_contacts(x, -1), "sphere 0: radius is -1"),
    (lambda x, r, to: jfpx.find_contacts(to(np.full((3, 3), np.nan, np.float32)), 1),
     "sphere 0: centre.x is nan"),
    (lambda x, r, to: jfpx.find_contacts(x, r, device="cpu"), "positions are on cuda:0"),
    (lambda x, r, to: jfpx.find_contacts(x, r, device="cuda:7"), "positions are on cuda:0"),
    (lambda x, r, to: jfpx.find_contacts(x, r, batch=[0, 2]), "the last offset is 2"),
    (lambda x, r, to: jfpx.find_contacts(x, r, batch=to(np.array([1, 3]))), "must begin with 0"),
    (lambda x, r, to: jfpx.find_pairs(x, 1, query=x, batch=[0, 3]), "exclude each other"),
    (lambda x, r, to: jfpx.SphereCollider().find_pairs(
        x, 1, batch=[0, 3], out=to(np.zeros((2, 9), np.int32)), count=to(np.zeros(2, np.int64))),
     "count excludes"),
    (lambda x, r, to: jfpx.find_contacts(x, r, periodic=[[9, 9, 9]], batch=[0, 1, 3]), "periodic has 1 cells"),
    (lambda x, r, to: jfpx.find_contacts(x, r, periodic=[9, 9, 3], batch=[0, 3]), "system 0: .* twice the cutoff"),
    (lambda x, r, to: jfpx.find_contacts(x, r, periodic=[9, 9]), "periodic has 2 lengths"),
    (lambda x, r, to: jfpx.find_contacts(x, r, periodic=[9, 3, 9]), "at least twice the cutoff"),
    (lambda x, r, to: jfpx.SphereCollider().find_pairs(
        x, 1, periodic=[9, 9, 9], out=to(np.zeros((2, 9), np.int32))), "must be a tuple of 2 arrays"),
    (lambda x, r, to: jfpx.SphereCollider().find_pairs(
        x, 1, periodic=[9, 9, 9], out=(to(np.zeros((2, 9), np.int32)), to(np.zeros((9, 3), np.int32))),
        count=to(np.zeros(2, np.int64))), "count excludes"),
    (lambda x, r, to: jfpx.find_contacts(x, r, output="dense"), "output is 'dense'"),
    (lambda x, r, to: jfpx.find_pairs(x), "either cutoff or radii"),
    (lambda x, r, to: jfpx.find_pairs(x, 1, query=np.zeros((3, 3), np.float32)),
     "query is not an array on"),
    (lambda x, r, to: jfpx.find_pairs(x, 1, query=r), r"query has shape \(3,\)"),
    (lambda x, r, to: jfpx.SphereCollider("float64").find_pairs(x, 1), "positions has dtype float32"),
    (lambda x, r, to: jfpx.SphereCollider(backend="cpu").find_pairs(x, 1), "backend is cpu"),
    (lambda x, r, to: jfpx.SphereCollider().find_pairs(x, 1, out=np.zeros((2, 9), np.int32)),
     "out must be"),
    (lambda x, r, to: jfpx.SphereCollider().find_pairs(x, 1, out=to(np.zeros((2, 9)))),
     "dtype int32 or int64"),
    (lambda x, r, to: jfpx.SphereCollider().find_pairs(x, 1, out=to(np.zeros((9, 2), np.int32)).T),
     "not contiguous"),
    (lambda x, r, to: jfpx.SphereCollider().find_pairs(x, 1, count=to(np.zeros(2, np.int64))),
     "count requires out"),
])
def test_bad_input_on_the_device_is_a_named_exception(library, call, message):
    x = library.to_device(np.zeros((3, 3), np.float32))
    r = library.to_device(np.ones(3, np.float32))
    with pytest.raises(jfpx.InvalidArgument, match=message):
        call(x, r, library.to_device)
    assert jfpx.find_pairs(x, radii=r).shape == (2, 3)


def test_threads_may_search_on_the_device_at_the_same_time(library, rng):
    positions, _ = random_spheres(rng, 20_000, np.dtype("float32"))
    expected = jfpx.find_pairs(positions, 0.9)
    x = library.to_device(positions)
    results = []
    threads = [threading.Thread(target=lambda: results.extend(
        library.to_host(jfpx.find_pairs(x, 0.9)) for _ in range(10))) for _ in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(results) == 30
    for result in results:
        np.testing.assert_array_equal(result, expected)


def test_calls_on_the_device_do_not_leak(library):
    points = library.to_device(np.random.default_rng(1).random((200, 3), dtype=np.float32))

    def free_bytes(calls):
        for _ in range(calls):
            jfpx.find_contacts(points, 0.05, half=False, output="csr")
            jfpx.find_pairs(points, 0.1)
        if isinstance(library, Cupy):
            library.module.cuda.Device().synchronize()
            return library.module.cuda.runtime.memGetInfo()[0]
        library.module.cuda.synchronize()
        return library.module.cuda.mem_get_info()[0]

    before = free_bytes(500)
    assert before - free_bytes(20_000) < 8 << 20


def grid_scene(dtype):
    scene = jfpx.Scene({"dt": 1 / 60, "bodies": []}, dtype=dtype)
    scene.add_spheres((np.mgrid[0:8, 0:8, 0:8].reshape(3, -1).T * 0.7).astype(dtype), 0.4, masses=1.0)
    return scene


def test_states_on_the_device_are_those_of_the_world(library, dtype):
    world = jfpx.World(grid_scene(dtype), backend="cuda")
    for body in (None, world.body_at(5)):
        if body is not None:
            world.remove(body)
        indices = [body.index for body in world.bodies]
        for _ in range(3):
            for shared, expected in zip(world.device_states(), world.states()):
                array = library.module.from_dlpack(shared)
                assert library.to_host(array)[indices].tobytes() == expected.tobytes()
            world.step()


def test_states_on_the_device_can_be_searched(library, dtype):
    world = jfpx.World(grid_scene(dtype), backend="cuda")
    world.step()
    pairs = jfpx.find_pairs(world.device_states().positions, 0.75)
    np.testing.assert_array_equal(library.to_host(library.module.from_dlpack(pairs)),
                                  jfpx.find_pairs(world.positions, 0.75))


def test_states_on_the_device_are_not_copied():
    torch = Torch().module
    world = jfpx.World(grid_scene("float32"), backend="cuda")
    world.step()
    first, second = (torch.from_dlpack(world.device_states().positions) for _ in range(2))
    assert first.data_ptr() == second.data_ptr()


def test_states_on_the_device_are_refused_after_a_change(library):
    world = jfpx.World(grid_scene("float32"), backend="cuda")
    for change in (world.step, lambda: world.wake(world.body_at(0)), world.close):
        states = world.device_states()
        change()
        with pytest.raises(jfpx.InvalidArgument, match="the world has changed"):
            library.module.from_dlpack(states.positions)


def test_a_world_whose_force_has_its_states_is_collected(library):
    world = jfpx.World(grid_scene("float32"), backend="cuda")
    states = world.device_states()
    force = lambda context: states  # noqa: E731
    world.add_force(force)
    collected = weakref.ref(force)
    del world, states, force
    gc.collect()
    assert collected() is None


def test_a_step_waits_for_readers_of_the_states():
    torch = Torch().module
    world = jfpx.World(grid_scene("float32"), backend="cuda")
    world.step()
    matrix = torch.rand((4096, 4096), device="cuda")
    for _ in range(5):
        expected = world.positions
        x = torch.from_dlpack(world.device_states().positions)
        for _ in range(20):
            matrix = (matrix @ matrix).sigmoid()
        copy = x.clone()  # after milliseconds of other work
        world.step()
        np.testing.assert_array_equal(copy.cpu().numpy(), expected)
        assert (world.positions != expected).any()


def test_steps_are_enqueued_on_the_current_stream(library, dtype):
    host, world = (jfpx.World(grid_scene(dtype), backend=backend) for backend in ("cpu", "cuda"))
    world.step()
    host.step()
    positions = library.module.from_dlpack(world.device_states().positions)
    for count in (1, 5, 0, 3):
        world.enqueue_steps(count)
        for _ in range(count):
            host.step()
        assert world.finish_steps().step == host.report.step
        np.testing.assert_array_equal(library.to_host(positions), host.positions)


def test_steps_are_captured_in_a_graph_of_torch(dtype):
    torch = Torch().module
    host, world = (jfpx.World(grid_scene(dtype), backend=backend) for backend in ("cpu", "cuda"))
    for made in (host, world):
        made.run(300)
    version = world.device_version
    positions = torch.from_dlpack(world.device_states().positions)
    heights = torch.zeros(len(positions), dtype=positions.dtype, device="cuda")
    graph = torch.cuda.CUDAGraph()
    with torch.cuda.graph(graph):
        world.enqueue_steps(2)
        heights.copy_(positions[:, 1])
    for _ in range(10):
        graph.replay()
        host.run(2)
    assert world.finish_steps().step == host.report.step
    assert world.state_hash() == host.state_hash()
    if world.device_version == version:
        np.testing.assert_array_equal(heights.cpu().numpy(), host.positions[:, 1])

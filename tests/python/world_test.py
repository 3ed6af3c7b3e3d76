"""Worlds, scenes and recordings."""

import copy
import gc
import math
import os
import pathlib
import pickle
import re
import shutil
import signal
import subprocess
import sys
import threading
import time
import weakref

import numpy as np
import pytest

import jfpx

BALL = {"shape": {"type": "sphere", "radius": 0.5}, "position": [0, 2, 0]}
FLOOR = {"shape": {"type": "half_space", "normal": [0, 1, 0], "offset": 0}, "mass": 0}
GROUND = {"shape": {"type": "half_space", "normal": [0, 1, 0], "offset": 0}, "mass": 0}
FREE = {**BALL, "acceleration": [0, 0, 0]}


def test_a_world_on_the_host_has_no_device_states():
    world = jfpx.World("pile", backend="cpu")
    with pytest.raises(jfpx.BackendUnavailable, match='has no device; make it with the backend "cuda"'):
        world.device_states()
    with pytest.raises(jfpx.BackendUnavailable, match="has no device"):
        world.enqueue_steps(1)
    for other, remedy in ((jfpx.World({"solver": "worst_first"}), "use soft_step"),
                          (jfpx.World({}), 'with the backend "cuda"')):
        with pytest.raises(jfpx.BackendUnavailable, match=remedy):
            other.device_version
    for count, stream in ((-1, None), (1.5, None), (2**32, None), (1, "stream"), (1, -1)):
        with pytest.raises(jfpx.InvalidArgument):
            world.enqueue_steps(count, stream)
    assert world.finish_steps().step == 0 and world.time == 0
    world.close()
    for call in (world.device_states, world.finish_steps, lambda: world.enqueue_steps(1)):
        with pytest.raises(jfpx.Closed):
            call()


@pytest.mark.parametrize("wrong, message", [
    ({"devices": 2}, "devices is 2; it must be a sequence of numbers of GPUs"),
    ({"devices": "0,1"}, "devices is '0,1'; it must be a sequence"),
    ({"devices": [0, 0.5]}, r"devices\[1\] is 0.5; it must be an integer"),
    ({"devices": [-1]}, r"devices\[0\] is -1; it must be in"),
    ({"devices": range(9)}, "devices has 9 numbers; at most 8 devices share a world"),
    ({"devices": [0, 1], "backend": "cpu"}, "the backend is cpu; it must be cuda or automatic"),
])
def test_gpus_that_cannot_share_a_world_are_an_error(wrong, message):
    with pytest.raises(jfpx.InvalidArgument, match=message):
        jfpx.World("pile", **wrong)


def test_gpus_that_share_a_world_change_no_bit():
    if not jfpx.available_gpus():
        with pytest.raises(jfpx.BackendUnavailable):
            jfpx.World("pile", devices=[0, 0])
        return
    worlds = [jfpx.World("pile", devices=[0, 0]), jfpx.World("pile", backend="cpu")]
    worlds.append(copy.deepcopy(worlds[0]))
    assert {world.run(20).step for world in worlds} == {20}
    assert len({world.state_hash() for world in worlds}) == 1
    assert [world.report.backend for world in worlds] == ["cuda", "cpu", "cuda"]


def test_a_ball_falls_and_comes_to_rest_on_the_floor(dtype):
    world = jfpx.World({"bodies": [BALL, FLOOR]}, dtype=dtype)
    report = world.run(300)
    assert report == world.report and report.step == 300 and not report.non_finite
    assert world.time == pytest.approx(5)
    ball, floor = world.bodies
    assert world.positions[0, 1] == pytest.approx(0.5, abs=0.01)
    assert world.positions.dtype == dtype
    assert not world.awake(ball) and report.awake == 0
    assert world.mass(ball) == 1 and world.mass(floor) == 0
    contacts = world.contacts()
    assert contacts.pairs.tolist() == [[ball.index], [floor.index]]
    np.testing.assert_allclose(contacts.normal, [[0, 1, 0]], atol=1e-6)
    assert contacts.distance[0] <= 0 and not contacts.sensor[0]


def test_a_world_has_the_bits_of_the_command(dtype):
    command = os.environ.get("JFPX_COMMAND") or shutil.which("jfpx")
    if command is None:
        pytest.skip("the command jfpx is not here")
    precision = {"float32": "float", "float64": "double"}[dtype.name]
    lines = subprocess.run([command, "run", "mixed", "--steps", "40", "--hash", "--precision",
                            precision, "--backend", "cpu"], capture_output=True, text=True, check=True)
    world = jfpx.World("mixed", dtype=dtype, backend="cpu")
    world.run(40)
    assert f"{world.state_hash():016x}" == lines.stdout.split()[-1]


def test_threads_and_single_steps_have_the_same_bits(dtype):
    scene = jfpx.Scene.named("pile", spheres=300, dtype=dtype)
    hashes = set()
    for threads in (1, 3):
        world = jfpx.World(scene, threads=threads)
        for _ in range(30):
            world.step()
        hashes.add(world.state_hash())
    world = jfpx.World(scene)
    steps = []
    assert world.run(30, after_step=lambda report: steps.append(report.step)).step == 30
    hashes.add(world.state_hash())
    assert len(hashes) == 1 and steps == list(range(1, 31))


def test_scenes_keep_every_bit_as_json_dict_file_and_pickle(tmp_path, dtype):
    scene = jfpx.Scene.named("polydisperse", spheres=50, seed=7, dtype=dtype)
    scene.save(tmp_path / "scene.json")
    for same in (jfpx.Scene.from_json(scene.to_json(), dtype=dtype),
                 jfpx.Scene(scene.to_dict(), dtype=dtype),
                 jfpx.Scene.load(tmp_path / "scene.json", dtype=dtype),
                 pickle.loads(pickle.dumps(scene)), jfpx.World(scene).scene):
        assert same == scene
    assert scene != jfpx.Scene.named("polydisperse", spheres=50, seed=8, dtype=dtype)
    assert scene.name == "polydisperse" and scene.dtype == dtype
    assert len(scene) == len(jfpx.World(scene)) >= 50


def test_named_scenes_are_listed():
    names = jfpx.scene_names()
    assert {"pile", "gas", "tower"} <= set(names)
    assert all(names.values())


def test_spheres_of_arrays_become_bodies(rng, dtype):
    positions = (rng.random((20, 3)) * 50).astype(dtype)
    radii = rng.uniform(0.1, 0.5, 20).astype(dtype)
    velocities = rng.normal(size=(20, 3)).astype(dtype)
    scene = jfpx.Scene(dtype=dtype)
    scene.add_spheres(positions, radii, masses=2, velocities=velocities)
    world = jfpx.World(scene)
    np.testing.assert_array_equal(world.positions, positions)
    np.testing.assert_array_equal(world.velocities, velocities)
    assert all(world.mass(body) == 2 for body in world.bodies)
    assert [b["shape"]["radius"] for b in scene.to_dict()["bodies"]] == pytest.approx(radii.tolist())


def test_spheres_of_arrays_have_their_properties(rng, dtype):
    positions = (rng.random((20, 3)) * 50).astype(dtype)
    acceleration = rng.normal(size=(20, 3)).astype(dtype)
    friction, restitution = rng.random((2, 20)).astype(dtype)
    masses = np.full(20, 1e-25)  # small, but not a radius of a search
    world = jfpx.World({"bodies": [BALL]}, dtype=dtype)
    bodies = world.add_spheres(positions, 0.1, masses=masses, acceleration=acceleration,
                               friction=friction, restitution=restitution)
    assert world.bodies[1:] == bodies
    np.testing.assert_array_equal(world.positions[1:], positions)
    np.testing.assert_array_equal([world.acceleration(body) for body in bodies], acceleration)
    np.testing.assert_array_equal([world.friction(body) for body in bodies], friction)
    np.testing.assert_array_equal([world.restitution(body) for body in bodies], restitution)
    np.testing.assert_allclose([world.mass(body) for body in bodies], masses, 1e-6)
    scene = jfpx.Scene(dtype=dtype)
    scene.add_spheres(positions, 0.1, acceleration=(0, 0, -1), friction=0.25, restitution=1)
    scene.add_spheres(positions[:1] + 99, 0.1)
    *others, last = scene.to_dict()["bodies"]
    for body in others:
        assert (body["acceleration"], body["friction"], body["restitution"]) == ([0, 0, -1], 0.25, 1)
    default = jfpx.Scene({"bodies": [BALL]}).to_dict()["bodies"][0]
    for field in ("acceleration", "friction", "restitution"):
        assert last[field] == pytest.approx(default[field])


@pytest.mark.parametrize("make", [jfpx.Scene, lambda: jfpx.World({"bodies": [BALL]})])
def test_gravity_is_the_acceleration_of_a_body(make):
    made = make()
    assert not hasattr(made, "gravity")
    with pytest.raises(AttributeError, match="each has its own acceleration"):
        made.gravity
    with pytest.raises(AttributeError, match="each has its own acceleration"):
        made.gravity = (0, 0, -9.81)


def test_lists_and_arrays_of_other_types_are_converted_to_the_dtype(dtype):
    other = {"float32": np.float64, "float64": np.float32}[dtype.name]
    scenes = []
    for convert in (lambda values: values, np.array, lambda values: np.array(values, other),
                    lambda values: np.array(values, dtype)):
        scene = jfpx.Scene({"dt": 0.01}, dtype=dtype)
        scene.add_spheres(convert([[0, 1, 0], [5, 1, 0]]), convert([0.5, 0.25]),
                          masses=convert([1, 2]), velocities=convert([[0, 0, 0], [1, 0, 0]]))
        scenes.append(scene)
        world = jfpx.World(scene)
        hits = world.cast_rays(convert([[0, 9, 0], [5, 9, 0]]), convert([[0, -1, 0], [0, -1, 0]]),
                               convert([99, 1]))
        assert hits.bodies.tolist() == [0, -1] and hits.distance.dtype == dtype
        world.set_states([convert(array.tolist()) for array in world.states()])
        world.add_force(lambda context: context.apply_forces(convert([[1, 0, 0], [0, 0, 0]])))
        world.step()
        assert world.velocities[0, 0] > 0
    assert all(scene == scenes[0] for scene in scenes)


def test_states_that_are_set_are_read_with_every_bit(rng, dtype):
    world = jfpx.World({"bodies": [FREE] * 5}, dtype=dtype)
    rotations = rng.normal(size=(5, 4))
    rotations /= np.linalg.norm(rotations, axis=1, keepdims=True)
    # No two balls touch: contacts would move them and keep them awake.
    positions = rng.uniform(size=(5, 3)) + 10 * np.arange(5)[:, None]
    states = jfpx.States(positions.astype(dtype), rotations.astype(dtype),
                         rng.normal(size=(5, 3)).astype(dtype), rng.normal(size=(5, 3)).astype(dtype))
    world.set_states(states)
    got = world.states()
    for a, b in (got[0], states[0]), (got[2], states[2]), (got[3], states[3]):
        assert a.tobytes() == b.tobytes()
    # set_state() normalises quaternions.
    np.testing.assert_allclose(got.orientations, states.orientations, rtol=8 * np.finfo(dtype).eps)
    body = world.bodies[3]
    np.testing.assert_array_equal(world.state(body).position, states.positions[3])
    world.set_state(body, jfpx.BodyState((1, 2, 3), velocity=(4, 5, 6)))
    assert world.state(body) == ((1, 2, 3), (1, 0, 0, 0), (4, 5, 6), (0, 0, 0))
    world.set_states(states._replace(velocities=0 * states.velocities,
                                     angular_velocities=0 * states.velocities))
    world.run(60)
    assert world.report.awake == 0, "a state that is set wakes its body"
    before = world.snapshot()
    states.velocities[4, 1] = np.nan
    with pytest.raises(jfpx.InvalidArgument, match="velocity"):
        world.set_states(states)
    assert world.snapshot() == before


def test_bodies_are_added_changed_and_removed():
    world = jfpx.World({"bodies": [FLOOR]})
    ball = world.add(BALL)
    assert ball in world and len(world) == 2 and world.body_at(ball.index) == ball
    world.set_mass(ball, 3)
    world.set_friction(ball, 0.25)
    world.set_restitution(ball, 0.75)
    world.set_acceleration(ball, (0, -1, 0))
    world.set_damping(ball, 0.5, 0.25)
    world.set_filter(ball, 2, 6)
    assert world.mass(ball) == 3 and world.friction(ball) == 0.25
    assert world.restitution(ball) == 0.75 and world.acceleration(ball) == (0, -1, 0)
    assert world.damping(ball) == (0.5, 0.25) and world.filter(ball) == (2, 6)
    assert not world.sensor(ball)
    assert world.motion_locks(ball) == ((False, False, False), (False, False, False))
    world.set_motion_locks(ball, (False, False, True), angular=(True, True, False))
    assert world.motion_locks(ball) == ((False, False, True), (True, True, False))
    other = world.add(BALL)
    world.set_pair_ignored(ball, other, True)
    assert world.pair_ignored(other, ball)
    world.remove(ball)
    assert ball not in world and world.bodies == [world.body_at(0), other]
    with pytest.raises(jfpx.InvalidArgument):
        world.state(ball)


def test_a_body_gets_another_definition():
    world = jfpx.World({"bodies": [{**FREE, "velocity": [1, 0, 0]}, FLOOR]})
    ball, floor = world.bodies
    world.run(10)
    fields = world.definition(ball)
    assert tuple(fields["position"]) == pytest.approx(world.state(ball).position) and fields["mass"] == 1
    world.replace(ball, fields | {"shape": {"type": "box", "half_extents": [1, 2, 3]}, "mass": 0, "velocity": [0, 0, 0]})
    assert world.bodies == [ball, floor] and world.mass(ball) == 0
    assert world.definition(ball)["shape"] == {"type": "box", "half_extents": [1, 2, 3]}
    before = world.snapshot()
    for wrong, error in (({"mass": -1}, jfpx.InvalidScene), ({"weight": 1}, jfpx.InvalidScene)):
        with pytest.raises(error, match=next(iter(wrong))):
            world.replace(ball, fields | wrong)
    assert world.snapshot() == before
    world.remove(ball)
    with pytest.raises(jfpx.InvalidArgument):
        world.replace(ball, fields)


def test_a_body_does_not_move_along_and_about_locked_axes():
    world = jfpx.World({"bodies": [{**FREE, "motion_locks": {"linear_x": True, "angular_z": True}}]})
    body = world.bodies[0]
    world.apply_impulse(body, (1, 1, 1), (0, 0.5, 0))
    world.set_states(world.states()._replace(angular_velocities=np.ones((1, 3), np.float32)))
    assert world.state(body).velocity[0] == 0 and world.state(body).velocity[1] > 0
    assert world.state(body).angular_velocity == (1, 1, 0)
    world.set_motion_locks(body)
    world.apply_impulse(body, (1, 0, 0))
    assert world.state(body).velocity[0] > 0


def test_contacts_have_indices_of_bodies_also_after_a_removal():
    world = jfpx.World({"bodies": [FREE, {**FREE, "position": [9, 0, 0]}, {**FREE, "position": [9.9, 0, 0]}]})
    world.remove(world.bodies[0])
    world.step()
    pairs = world.contacts().pairs
    assert sorted(pairs[:, 0]) == [1, 2] == [body.index for body in world.bodies]
    rows = np.searchsorted([body.index for body in world.bodies], pairs)
    assert sorted(rows[:, 0]) == [0, 1] and world.cast_rays([[9, 5, 0]], [[0, -1, 0]]).bodies == [1]
    assert sorted(world.contact_events().pairs[:, 0]) == [1, 2]


def test_contact_forces_carry_the_weight():
    scene = {"bodies": [{**FREE, "acceleration": [0, -9.81, 0], "mass": 3, "friction": 0.5, "position": [0.3, 0.5, 0]},
                        {"shape": {"type": "half_space", "normal": [0, 1, 0], "offset": 0}, "mass": 0}]}
    world = jfpx.World(scene)
    assert len(world.contact_forces().force) == 0
    world.run(120)
    forces = world.contact_forces()
    np.testing.assert_array_equal(forces.pairs, [[0], [1]])
    np.testing.assert_allclose(forces.force, [[0, 3 * 9.81, 0]], atol=1e-3)
    np.testing.assert_allclose(forces.arm_a, [[0, -0.5, 0]], atol=1e-2)
    np.testing.assert_array_equal(forces.normal, [[0, 1, 0]])
    np.testing.assert_array_equal(forces.torque, [[0, 0, 0]])
    world.remove(world.bodies[0])
    with pytest.raises(jfpx.ConcurrentUse):
        world._core.write_forces(*forces)


@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_debug_lines_are_on_the_surfaces(dtype):
    world = jfpx.World({"bodies": [{**FREE, "position": [1, 2, 3]},
                                   {"shape": {"type": "box", "half_extents": [1, 2, 3]}, "position": [9, 0, 0],
                                    "mass": 0}]}, dtype=dtype)
    ball, box = world.bodies
    lines, colors = world.debug_lines(filter=lambda body: body == ball)
    assert lines.dtype == dtype and lines.shape[1:] == (2, 3) and len(lines) >= 24
    np.testing.assert_allclose(np.linalg.norm(lines - [1, 2, 3], axis=2), 0.5, rtol=1e-5)
    assert colors.dtype == np.uint8 and colors.shape == (len(lines), 3)
    edges = world.debug_lines(region=([8, -1, -1], [10, 1, 1])).lines
    assert len(edges) == 12
    np.testing.assert_allclose(np.abs(edges - [9, 0, 0]), np.broadcast_to([1, 2, 3], (12, 2, 3)), rtol=1e-6)
    assert len(world.debug_lines().lines) == len(lines) + len(edges)
    assert len(world.debug_lines(shapes=False).lines) == 0
    assert len(world.debug_lines(shapes=False, axes=True).lines) == 6
    with pytest.raises(jfpx.InvalidArgument, match="circle_points is 3"):
        world.debug_lines(circle_points=3)
    with pytest.raises(jfpx.InvalidArgument, match="axis_length"):
        world.debug_lines(axis_length=0)
    with pytest.raises(jfpx.InvalidArgument, match="region"):
        world.debug_lines(region=([1, 0, 0], [0, 1, 1]))
    with pytest.raises(ZeroDivisionError):
        world.debug_lines(filter=lambda body: 1 / 0)


def test_filters_decide_which_bodies_touch():
    world = jfpx.World({"bodies": [FREE, {**FREE, "position": [0, 2.9, 0]}]})
    a, b = world.bodies
    world.set_filter(a, 1, 2)
    assert world.step().contacts == 0
    world.set_filter(a, 1, 1)
    assert world.step().contacts == 1
    world.set_pair_ignored(a, b, True)
    assert world.step().contacts == 0


def test_events_begin_stay_and_end():
    world = jfpx.World({"bodies": [{**FREE, "velocity": [0, 0, 1], "sensor": True,
                                    "linear_damping": 1},
                                   {**FREE, "position": [0, 2, 1.5]}],
                        "dt": 0.1, "sleep": {"enabled": False}})
    phases = []
    for _ in range(40):
        world.step()
        events = world.contact_events()
        phases += events.phase.tolist()
        assert events.pairs[0].tolist() == [0] * len(events.phase)
    assert phases[0] == jfpx.BEGIN and phases[-1] == jfpx.END
    assert set(phases[1:-1]) == {jfpx.STAY}


def test_hit_events_have_the_speed_before_the_step(dtype):
    world = jfpx.World({"bodies": [BALL, GROUND]}, dtype=dtype, hit_speed=1)
    hits = []
    for _ in range(200):
        before = world.velocities[0, 1]
        world.step()
        events = world.hit_events()
        if len(events.approach_speed):
            assert events.pairs.tolist() == [[0], [1]]
            assert events.normal.tolist() == [[0, 1, 0]] and events.approach_speed.dtype == dtype
            assert events.approach_speed[0] == -before
            assert events.point[0, 1] == pytest.approx(0, abs=0.2)
            hits.append(-before)
    assert len(hits) == 1 and hits[0] == pytest.approx(np.sqrt(2 * 9.81 * 1.5), rel=0.05)
    copied = copy.deepcopy(world)
    assert len(copied.hit_events().point) == 0
    copied.set_state(copied.bodies[0], jfpx.BodyState((0, 2, 0)))
    assert sum(len(copied.hit_events().point) for _ in range(200) if copied.step()) == 1
    silent = jfpx.World({"bodies": [BALL, GROUND]})
    assert sum(len(silent.hit_events().point) for _ in range(200) if silent.step()) == 0


def test_hits_have_the_numbers_of_parts_and_triangles(dtype):
    balls = [{"shape": {"type": "sphere", "radius": 0.4}, "position": [x, 0, 0]} for x in (-1, 0, 1)]
    mesh = {"type": "triangle_mesh", "vertices": [[-9, -1, -9], [9, -1, -9], [-9, -1, 9], [9, -1, 9]],
            "triangles": [[1, 2, 3], [0, 2, 1]]}
    world = jfpx.World({"bodies": [{"shape": mesh, "mass": 0},
                                   {"shape": {"type": "compound", "parts": balls}}]},
                       dtype=dtype, hit_speed=0.5)
    above, down = np.array([[-1, 3, 0], [0, 3, 0], [1, 3, 0], [-5, 3, -5], [5, 3, 5]]), (0, -9, 0)
    expected = [0, 1, 2, 1, 0]
    downs = np.broadcast_to(down, above.shape)
    ball = {"type": "sphere", "radius": 0.05}
    assert world.cast_rays(above, downs).part.tolist() == expected
    assert world.cast_shapes(ball, above, downs).part.tolist() == expected
    assert world.closest_bodies(above - [0, 2.5, 0], ball).part.tolist() == expected
    for at, part in zip(above.tolist(), expected):
        assert world.cast_ray(at, down).part == part
        assert world.cast_shape(ball, at, down).part == part
        assert world.closest_body((at[0], at[1] - 2.5, at[2]), ball).part == part
    hits = []
    while not hits:
        world.step()
        assert world.report.step < 100
        hits = world.hit_events().parts.T.tolist()
    assert len(hits) == 1 and hits[0][0] in (0, 1) and hits[0][1] in (0, 1, 2)
    world.run(60)
    parts = world.contact_forces().parts
    assert parts.shape[0] == 2 and len(set(map(tuple, parts.T.tolist()))) == parts.shape[1] >= 3


def test_states_between_two_steps_are_interpolated(dtype):
    turned = {**BALL, "position": [4, 0, 0], "angular_velocity": [0, 3, 0], "velocity": [1, 0, 0]}
    world = jfpx.World({"bodies": [BALL, turned]}, dtype=dtype)
    before = world.states()
    world.run(10)
    after = world.states()
    for t in (0, 0.25, 1):
        between = jfpx.interpolate(before, after, t)
        assert all(array.dtype == dtype for array in between)
        np.testing.assert_allclose(between.positions,
                                   before.positions * (1 - t) + after.positions * t, rtol=1e-6)
        np.testing.assert_allclose(np.linalg.norm(between.orientations, axis=1), 1, rtol=1e-6)
        opposite = after._replace(orientations=-after.orientations)
        same = jfpx.interpolate(before, opposite, t).orientations
        np.testing.assert_allclose(np.abs(np.sum(same * between.orientations, axis=1)), 1, rtol=1e-6)
    half = jfpx.interpolate(*(jfpx.BodyState(*(a[1].tolist() for a in s)) for s in (before, after)), 0.5)
    angle = 2 * np.arctan2(half.orientation[2], half.orientation[0])
    assert isinstance(half.position, tuple) and angle == pytest.approx(0.5 * 3 * 10 / 60, rel=1e-3)
    whole = jfpx.interpolate(jfpx.BodyState((0, 0, 0), (1, 0, 0, 0)), jfpx.BodyState((4, 0, 0)), 0.5)
    assert whole.position == (2, 0, 0) and whole.orientation == (1, 0, 0, 0)
    shorter = jfpx.States(*(array[:1] for array in after))
    for wrong in ((before, shorter), (before, half), (tuple(before), tuple(after)), (half, 3)):
        with pytest.raises(jfpx.InvalidArgument):
            jfpx.interpolate(*wrong, 0.5)
    for t in (np.nan, np.inf, "x", None):
        with pytest.raises(jfpx.InvalidArgument, match="t is"):
            jfpx.interpolate(before, after, t)


def test_a_kinematic_body_moves_to_a_pose_in_one_step(dtype):
    lift = {"shape": {"type": "box", "half_extents": [1, 1, 1]}, "mass": 0, "kinematic": True}
    world = jfpx.World({"bodies": [lift]}, dtype=dtype)
    body = world.bodies[0]
    for position, turn in (((1, 0, 0), 0.3), ((1, 2, 0), -0.2), ((0, 2, 0), None)):
        goal = None if turn is None else (np.cos(turn / 2), 0, np.sin(turn / 2), 0)
        expected = world.state(body).orientation if goal is None else goal
        world.set_state(body, world.moving_to(body, position, goal))
        world.step()
        assert world.state(body).position == pytest.approx(position, abs=1e-5)
        assert world.state(body).orientation == pytest.approx(expected, abs=1e-5)
    world.set_state(body, world.state(body)._replace(velocity=(0, 0, 0), angular_velocity=(0, 0, 0)))
    world.step()
    assert not world.awake(body)
    for wrong, message in ((lambda: world.moving_to(7, (0, 0, 0)), "body is 7"),
                           (lambda: world.moving_to(body, (0, 0)), "position"),
                           (lambda: world.moving_to(body, (0, 0, np.nan)), "position"),
                           (lambda: world.moving_to(body, (0, 0, 0), (0, 0, 0, 0)), "orientation")):
        with pytest.raises(jfpx.InvalidArgument, match=message):
            wrong()


def test_queries_of_arrays_let_other_threads_query_but_not_change_the_world():
    world = jfpx.World("pile")
    origins, down = np.full((500_000, 3), [0, 50, 0], np.float32), (0, -1, 0)
    downs = np.broadcast_to(np.float32(down), origins.shape)
    for query in (lambda: world.cast_rays(origins, downs),
                  lambda: world.cast_shapes({"type": "sphere", "radius": 0.1}, origins[:50_000], downs[:50_000] * 9),
                  lambda: world.closest_bodies(origins[:50_000])):
        results, refused, queries = [], 0, 0
        thread = threading.Thread(target=lambda: results.append(query()))
        thread.start()
        while thread.is_alive():
            hit = world.cast_ray(origins[0], down)
            try:
                world.wake(world.bodies[0])
            except jfpx.ConcurrentUse:
                refused += 1
            queries += hit is not None
        thread.join()
        assert refused > 0 and queries > 0 and len(set(results[0].bodies.tolist())) == 1
        world.step()


def test_rays_agree_with_the_formula_of_a_sphere(rng, dtype):
    centres = (rng.random((40, 3)) * 10).astype(dtype)
    scene = jfpx.Scene(dtype=dtype)
    scene.add_spheres(centres, 0.5)
    world = jfpx.World(scene)
    origins = (rng.random((60, 3)) * 10 - [20, 0, 0]).astype(dtype)
    directions = (centres[rng.integers(0, 40, 60)] - origins + rng.normal(size=(60, 3))).astype(dtype)
    hits = world.cast_rays(origins, directions)
    d = directions.astype(np.float64) / np.linalg.norm(directions.astype(np.float64), axis=1)[:, None]
    to_centre = centres[None].astype(np.float64) - origins[:, None]
    along = np.einsum("rnk,rk->rn", to_centre, d)
    square = 0.25 - (np.sum(to_centre**2, axis=2) - along**2)
    distance = np.where(square > 0, along - np.sqrt(np.maximum(square, 0)), np.inf)
    decided = (np.abs(square) > 1e-3).all(axis=1)
    assert decided.sum() > 20 and np.isfinite(distance[decided].min(axis=1)).any()
    np.testing.assert_allclose(hits.distance[decided], distance[decided].min(axis=1), rtol=1e-3)
    for ray in range(60):
        one = world.cast_ray(origins[ray], directions[ray])
        if one is None:
            assert hits.bodies[ray] == -1
            continue
        assert one.body.index == hits.bodies[ray] and one.distance == hits.distance[ray]
        through = world.cast_ray_through(origins[ray], directions[ray])
        assert through[0] == one
        others = world.cast_ray_through(origins[ray], directions[ray],
                                        filter=lambda body: body != one.body)
        assert others == through[1:]


def test_overlaps_are_the_bodies_within_reach(rng, dtype):
    centres = (rng.random((60, 3)) * 5).astype(dtype)
    scene = jfpx.Scene(dtype=dtype)
    scene.add_spheres(centres, 0.25)
    world = jfpx.World(scene)
    gap = np.linalg.norm(centres.astype(np.float64) - 2.5, axis=1) - 1.25
    found = {body.index for body in world.overlapping_sphere((2.5, 2.5, 2.5), 1)}
    assert set(np.flatnonzero(gap < -1e-4)) <= found <= set(np.flatnonzero(gap < 1e-4))
    assert len(world.overlapping_box((2.5, 2.5, 2.5), (5, 5, 5))) == 60
    assert world.overlapping_box((100, 2.5, 2.5), (5, 5, 5)) == []


def test_casts_agree_with_rays_to_larger_spheres(rng, dtype):
    centres = (rng.random((40, 3)) * 10).astype(dtype)
    worlds = []
    for radius in (0.5, 0.75):
        scene = jfpx.Scene(dtype=dtype)
        scene.add_spheres(centres, radius)
        worlds.append(jfpx.World(scene))
    world, larger = worlds
    starts = (rng.random((60, 3)) * 10 - [20, 0, 0]).astype(dtype)
    translations = ((centres[rng.integers(0, 40, 60)] - starts) * 2).astype(dtype)
    ball = {"type": "sphere", "radius": 0.25}
    hits = world.cast_shapes(ball, starts, translations)
    rays = larger.cast_rays(starts, translations, np.linalg.norm(translations, axis=1))
    assert (hits.bodies == rays.bodies).mean() > 0.9 and (hits.distance == 0).all()
    same = hits.bodies == rays.bodies
    np.testing.assert_allclose(hits.fraction[same] * np.linalg.norm(translations, axis=1)[same],
                               rays.distance[same], rtol=1e-3)
    for i in range(60):
        one = world.cast_shape(ball, starts[i], translations[i])
        assert one.body.index == hits.bodies[i] and one.fraction == hits.fraction[i]
        through = world.cast_shape_through(ball, starts[i], translations[i])
        assert through[0] == one
        others = world.cast_shape_through(ball, starts[i], translations[i],
                                          filter=lambda body: body != one.body)
        assert others == through[1:]
    assert world.cast_shape(ball, (0, 0, 99), (0, 0, 1)) is None


def test_distances_agree_with_the_formula_of_a_sphere(rng, dtype):
    centres = (rng.random((40, 3)) * 10).astype(dtype)
    scene = jfpx.Scene(dtype=dtype)
    scene.add_spheres(centres, 0.5)
    world = jfpx.World(scene)
    points = (rng.random((50, 3)) * 14 - 2).astype(dtype)
    gaps = np.linalg.norm(points[:, np.newaxis] - centres, axis=2) - 0.5
    for radius, shape in ((0, None), (0.25, {"type": "sphere", "radius": 0.25})):
        found = world.closest_bodies(points, shape)
        np.testing.assert_array_equal(found.bodies, gaps.argmin(axis=1))
        np.testing.assert_allclose(found.distance, gaps.min(axis=1) - radius, atol=2e-6)
        np.testing.assert_allclose(found.point + found.normal * found.distance[:, np.newaxis],
                                   found.query_point, atol=1e-5)
        np.testing.assert_allclose(np.linalg.norm(found.query_point - points, axis=1), radius,
                                   atol=1e-5)
        limited = world.closest_bodies(points, shape, max_distances=1)
        np.testing.assert_array_equal(limited.bodies, np.where(found.distance <= 1, found.bodies, -1))
        assert np.isinf(limited.distance[limited.bodies < 0]).all()
        for i in range(50):
            one = world.closest_body(points[i], shape)
            assert one.body.index == found.bodies[i] and one.distance == found.distance[i]
            near = world.bodies_within(points[i], 2, shape)
            assert {body.body.index for body in near} == set(np.flatnonzero(gaps[i] - radius <= 2))
            assert [body.distance for body in near] == sorted(body.distance for body in near)
            assert near == world.bodies_within(points[i], 3, shape)[:len(near)]
            others = world.bodies_within(points[i], 9, shape, filter=lambda body: body != one.body)
            assert others[0] == world.closest_body(points[i], shape,
                                                   filter=lambda body: body != one.body)
    assert world.closest_body((0, 0, 99), max_distance=9) is None


def test_centred_shapes_have_their_centre_of_mass_at_the_origin():
    box = {"type": "box", "half_extents": [0.5, 0.5, 0.5]}
    shape = jfpx.centred({"type": "compound", "parts": [
        {"shape": box, "position": [1, 2, 3]}, {"shape": box, "position": [3, 2, 3], "density": 3}]})
    assert [part["position"] for part in shape["parts"]] == [[-1.5, 0, 0], [0.5, 0, 0]]
    jfpx.Scene({"bodies": [{"shape": shape}]})  # movable
    corners = [[x, y, z] for x in (0, 2) for y in (0, 1) for z in (5, 6)]
    hull = jfpx.centred({"type": "hull", "vertices": corners})
    np.testing.assert_allclose(np.mean(hull["vertices"], axis=0), 0, atol=1e-12)
    assert jfpx.centred(box)["half_extents"] == [0.5, 0.5, 0.5]
    with pytest.raises(jfpx.InvalidScene, match="density"):
        jfpx.centred({"type": "compound", "parts": [{"shape": box, "density": -1}]})


def test_a_character_walks_pushes_and_jumps(dtype):
    crate = {"shape": {"type": "box", "half_extents": [0.5, 0.5, 0.5]}, "position": [3, 0.5, 0], "mass": 20}
    world = jfpx.World({"bodies": [GROUND, crate]}, dtype=dtype)
    settings = jfpx.CharacterSettings(radius=0.25, step_height=0.3)
    state = jfpx.CharacterState((0, 0.87, 0))
    assert state.ground == "air" and state.ground_body is None
    pushed = []
    for n in range(90):
        world.run(1)
        state, hits = world.move_character(state._replace(velocity=(2, -1, 0)), 1 / 60, settings)
        pushed += [hit for hit in hits if hit.body == world.bodies[1]]
    assert state.ground == "ground" and state.ground_body == world.bodies[0]
    assert state.ground_normal == (0, 1, 0) and state.ground_velocity == (0, 0, 0)
    assert state.position == pytest.approx((2.5 - 0.25 - 0.02, 0.87, 0), abs=1e-3)
    assert pushed[0].approach_speed == pytest.approx(2) and pushed[0].normal == pytest.approx((-1, 0, 0), abs=1e-5)
    assert pushed[0].point[0] == pytest.approx(2.5, abs=1e-3)
    world.apply_impulse(pushed[0].body, (40, 0, 0))
    through = world.move_character(state._replace(velocity=(60, 0, 0)), 1 / 60, settings,
                                   filter=lambda body: body == world.bodies[0])
    assert through.state.position[0] == pytest.approx(state.position[0] + 1, abs=1e-3)
    assert through.hits == []
    jump = world.move_character(state._replace(velocity=(0, 5, 0)), 1 / 60, settings).state
    assert jump.ground == "air" and jump.ground_body is None and jump.velocity == (0, 5, 0)
    again = world.move_character(state._replace(velocity=(0, 5, 0)), 1 / 60, settings).state
    assert again == jump


def test_a_distance_query_turns_the_solid(dtype):
    world = jfpx.World({"bodies": [GROUND]}, dtype=dtype)
    stick = {"type": "capsule", "radius": 0.25, "half_height": 1}
    half = np.sqrt(0.5)
    found = world.closest_bodies([[0, 4, 0]] * 2, stick, [[1, 0, 0, 0], [half, half, 0, 0]])
    np.testing.assert_allclose(found.distance, [2.75, 3.75], rtol=1e-6)
    assert world.closest_body((0, 4, 0), stick, (half, half, 0, 0)).distance == found.distance[1]
    assert world.closest_body((0, 1, 0), stick).distance == pytest.approx(-0.25)


def test_a_cast_turns_the_solid(dtype):
    world = jfpx.World({"bodies": [GROUND]}, dtype=dtype)
    stick = {"type": "capsule", "radius": 0.25, "half_height": 1}
    half = np.sqrt(0.5)
    hits = world.cast_shapes(stick, [[0, 4, 0], [0, 4, 0], [0, 0.5, 0], [0, 4, 0]],
                             [[0, -5, 0], [0, -5, 0], [0, 1, 0], [1, 0, 0]],
                             [[1, 0, 0, 0], [half, half, 0, 0], [1, 0, 0, 0], [1, 0, 0, 0]])
    np.testing.assert_allclose(hits.fraction, [0.55, 0.75, 0, np.inf], rtol=1e-5)
    np.testing.assert_allclose(hits.distance, [0, 0, -0.75, 0], rtol=1e-5)
    np.testing.assert_array_equal(hits.normal, [[0, 1, 0], [0, 1, 0], [0, 1, 0], [0, 0, 0]])
    np.testing.assert_array_equal(hits.bodies, [0, 0, 0, -1])
    assert world.overlapping(stick, (0, 1.2, 0)) == world.bodies
    assert world.overlapping(stick, (0, 1.2, 0), (half, half, 0, 0)) == []
    assert world.overlapping(stick, (0, 1.2, 0), filter=lambda body: body != world.bodies[0]) == \
        world.bodies[1:]


def test_a_function_is_a_force(dtype):
    world = jfpx.World({"bodies": [FREE, {**FREE, "position": [5, 0, 0], "mass": 2}], "dt": 0.01},
                       dtype=dtype)
    seen = []

    def spring(context):
        states = context.states()
        seen.append((context.time, context.dt, context.bodies, states.positions.dtype))
        context.apply_forces(-4 * states.positions)
        context.apply_torque(context.bodies[0], (0, 0, 1))
        assert context.mass(context.bodies[1]) == 2 and context.awake(context.bodies[1])
        assert context.state(context.bodies[1]).position[0] == states.positions[1, 0]

    number = world.add_force(spring)
    assert world.forces == [number]
    world.step()
    assert seen == [(0, pytest.approx(0.01), world.bodies, dtype)]
    assert world.velocities[1, 0] == pytest.approx(-4 * 5 / 2 * 0.01, rel=1e-3)
    assert world.state(world.bodies[0]).angular_velocity[2] > 0
    world.remove_force(number)
    world.step()
    assert len(seen) == 1 and world.forces == []


def test_an_exception_of_a_force_undoes_the_step():
    world = jfpx.World({"bodies": [BALL]})
    world.step()
    before = world.state_hash()

    def force(context):
        raise LookupError("no data")

    number = world.add_force(force)
    with pytest.raises(LookupError, match="no data"):
        world.step()
    with pytest.raises(LookupError, match="no data"):
        world.run(5)
    assert world.state_hash() == before
    world.remove_force(number)
    assert world.step().step == 2


def test_a_context_is_invalid_after_the_call_of_its_force():
    world = jfpx.World({"bodies": [BALL]})
    kept = []
    world.add_force(kept.append)
    world.step()
    with pytest.raises(jfpx.InvalidArgument, match="valid only while"):
        kept[0].states()


def test_a_force_must_not_use_its_world():
    world = jfpx.World({"bodies": [BALL]})
    world.add_force(lambda context: world.states())
    with pytest.raises(jfpx.ConcurrentUse):
        world.step()


ICE_AND_ASPHALT = {"bodies": [
    {"shape": {"type": "compound", "parts": [
        {"shape": {"type": "box", "half_extents": [8, 0.5, 3]}, "position": [0, -0.5, -3]},
        {"shape": {"type": "box", "half_extents": [8, 0.5, 3]}, "position": [0, -0.5, 3]}]}, "mass": 0},
    *({"shape": {"type": "box", "half_extents": [0.5, 0.1, 0.5]}, "mass": 1, "position": [0, 0.1, z],
       "velocity": [4, 0, 0], "can_sleep": False} for z in (-2, 2))]}


def test_a_contact_generator_changes_the_friction_of_parts(dtype):
    world = jfpx.World(ICE_AND_ASPHALT, dtype=dtype)
    seen = []

    def material(context):
        contacts = context.detected()
        seen.append(contacts)
        context.change(friction=np.where(contacts.parts[1] == 0, 0.1, 0.6), restitution=0)
        changed = context.detected()
        np.testing.assert_allclose(changed.friction, [0.1, 0.6])
        assert context.mass(context.bodies[1]) == 1 and len(context.states().positions) == 3

    number = world.add_contact_generator(material)
    assert world.contact_generators == [number]
    world.run(30)
    assert len(seen) == 30 and seen[0].normal.dtype == dtype
    np.testing.assert_array_equal(seen[0].pairs, [[1, 2], [0, 0]])
    np.testing.assert_allclose(seen[0].normal, [[0, 1, 0]] * 2)
    np.testing.assert_allclose(seen[0].friction, 0.5)
    np.testing.assert_allclose(world.velocities[1:, 0], [4 - 0.05 * 9.81, 4 - 0.3 * 9.81], atol=0.05)
    frictions = np.where(world.contacts().point[:, 2] < 0, dtype.type(0.1), dtype.type(0.6))
    np.testing.assert_array_equal(world.contacts().friction, frictions)
    world.remove_contact_generator(number)
    world.step()
    assert len(seen) == 30 and world.contact_generators == []


def test_a_contact_generator_ignores_and_adds_contacts():
    world = jfpx.World({"bodies": [{**BALL, "position": [0, 0.49, 0]}, GROUND]})
    ball, ground = world.bodies

    def swap(context):
        context.change(ignored=True)
        context.add(ball, ground, (1, 0, 0), context.state(ball).position, -0.1)

    world.add_contact_generator(swap)
    report = world.step()
    assert report.contacts == 0 and report.generated_contacts == 1
    assert world.positions[0, 0] > 0.01 and world.velocities[0, 1] < -0.1


@pytest.mark.parametrize("change, message", [
    (lambda c: c.change(friction=[1, 2]), "friction has shape"),
    (lambda c: c.change(friction="x"), "friction"),
    (lambda c: c.change(ignored=[1]), "ignored has dtype int64; it must be bool"),
    (lambda c: c.change(friction=-1), "friction is -1"),
    (lambda c: c.change(restitution=np.full(1, 2.0)), "restitution is 2"),
    (lambda c: c.add(3, c.bodies[0], (0, 1, 0), (0, 0, 0), 0), "a is 3; it must be a BodyId"),
    (lambda c: c.add(c.bodies[0], c.bodies[0], (0, 1, 0), (0, 0, 0), 0), "a and b are one body"),
])
def test_changes_of_contacts_are_checked(change, message):
    world = jfpx.World({"bodies": [{**BALL, "position": [0, 0.49, 0]}, GROUND]})
    before = world.state_hash()
    world.add_contact_generator(change)
    with pytest.raises(jfpx.InvalidArgument, match=message):
        world.step()
    assert world.state_hash() == before


def test_a_contact_context_is_invalid_after_its_call():
    world = jfpx.World({"bodies": [BALL]})
    kept = []
    world.add_contact_generator(kept.append)
    world.step()
    with pytest.raises(jfpx.InvalidArgument, match="valid only while"):
        kept[0].detected()
    with pytest.raises(jfpx.InvalidArgument, match="generator is 3; it must be a function"):
        world.add_contact_generator(3)


@pytest.mark.parametrize("force, velocity", [
    (jfpx.Gravity((0, 0, 2)), (0, 0, 0.02)),
    (jfpx.Drag(linear=0.5, wind=(4, 0, 0)), (0.02, 0, 0)),
    (jfpx.Spring(jfpx.Attachment(jfpx.BodyId(0, 0)), jfpx.Attachment(point=(0, 5, 0)), 2,
                 rest_length=1), (0, 0.04, 0)),
    (jfpx.Bungee(jfpx.Attachment(jfpx.BodyId(0, 0)), jfpx.Attachment(point=(0, 5, 0)), 2,
                 rest_length=4), (0, 0, 0)),
    (jfpx.Buoyancy(offset=10, density=6 / np.pi, gravity=3), (0, 0.03, 0)),
    (jfpx.Explosion(centre=(0, -3, 0), start=-1, peak_force=0), (0, 0, 0)),
])
def test_forces_of_the_library_act(force, velocity):
    world = jfpx.World({"bodies": [FREE], "dt": 0.01, "sleep": {"enabled": False}}, dtype="float64")
    assert world.bodies == [(0, 0)]
    world.add_force(force)
    world.step()
    np.testing.assert_allclose(world.velocities[0], velocity, rtol=1e-2, atol=1e-9)


def test_forces_of_one_step_act_once():
    world = jfpx.World({"bodies": [FREE], "dt": 0.01})
    ball, = world.bodies
    world.apply_force(ball, (1, 0, 0))
    world.apply_force(ball, (0, 1, 0), point=(0, 2, 0.25))
    world.apply_torque(ball, (0, 0, 1))
    world.step()
    first = world.states()
    assert first.velocities[0] == pytest.approx([0.01, 0.01, 0])
    assert first.angular_velocities[0, 2] > 0 and first.angular_velocities[0, 0] < 0
    world.step()
    np.testing.assert_array_equal(world.velocities, first.velocities)


def test_impulses_change_velocities_at_once():
    world = jfpx.World({"bodies": [FREE], "dt": 0.01})
    ball, = world.bodies
    mass = world.mass(ball)
    world.apply_impulse(ball, (1, 0, 0))
    assert world.velocities[0] == pytest.approx([1 / mass, 0, 0])
    world.apply_impulse(ball, (0, 1, 0), point=world.positions[0] + (0, 0, 0.25))
    assert world.velocities[0] == pytest.approx([1 / mass, 1 / mass, 0])
    first = world.states().angular_velocities[0]
    assert first[0] < 0 and first[1:] == pytest.approx([0, 0])
    world.apply_angular_impulse(ball, (0.25, 0, 0))
    assert world.states().angular_velocities[0] == pytest.approx([0, 0, 0], abs=1e-6)
    with pytest.raises(jfpx.InvalidArgument, match="impulse"):
        world.apply_impulse(ball, (float("nan"), 0, 0))


def test_a_recording_has_the_states_of_the_run(tmp_path, dtype):
    path = tmp_path / "run.rec"
    world = jfpx.World(jfpx.Scene.named("pile", spheres=60, dtype=dtype))
    expected = []
    with jfpx.RecordingWriter(path, world) as writer:
        for _ in range(5):
            world.step()
            writer.append()
            expected.append(world.states())
        assert not path.exists()
    recording = jfpx.Recording(path)
    assert len(recording) == 5 and recording.dtype == dtype and recording.engine == "native"
    assert recording.scene == world.scene
    for step, states in enumerate(expected, 1):
        for a, b in zip(recording.states(step), states):
            assert a.tobytes() == b.tobytes()
    with pytest.raises(jfpx.InvalidArgument, match="step is 6"):
        recording.states(6)


def test_a_recording_may_be_finished_within_its_block(tmp_path):
    world = jfpx.World({"bodies": [BALL]})
    with jfpx.RecordingWriter(tmp_path / "run.rec", world) as writer:
        world.step()
        writer.append()
        writer.finish()
        with pytest.raises(jfpx.Closed):
            writer.append()
    assert len(jfpx.Recording(tmp_path / "run.rec")) == 1


def test_a_recording_of_a_failed_run_leaves_no_file(tmp_path):
    world = jfpx.World({"bodies": [BALL]})
    with pytest.raises(LookupError):
        with jfpx.RecordingWriter(tmp_path / "run.rec", world) as writer:
            world.step()
            writer.append()
            raise LookupError
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(jfpx.Closed):
        writer.append()


def read_xyz(path):
    """The line of properties and the rows of each frame."""
    lines = iter(path.read_text().splitlines())
    for count in lines:
        yield next(lines), [next(lines).removeprefix("X ").split() for _ in range(int(count))]


def test_a_trajectory_has_the_states_of_the_run(tmp_path, dtype):
    world = jfpx.World(jfpx.Scene.named("mixed", spheres=20, dtype=dtype))
    path, frames = tmp_path / "run.xyz", []
    with jfpx.TrajectoryWriter(path, world) as trajectory:
        for _ in range(3):
            trajectory.append()
            frames.append((world.time, [body.index for body in world.bodies], world.states()))
            world.run(5)
            world.remove(world.bodies[-2])
        assert not path.exists()
    read = list(read_xyz(path))
    assert len(read) == 3
    for (properties, rows), (moment, ids, states) in zip(read, frames):
        assert float(properties.partition(" Time=")[2].split()[0]) == moment
        columns = np.array(rows).astype(dtype)
        np.testing.assert_array_equal(columns[:, 3], ids)
        np.testing.assert_array_equal(columns[:, :3], states.positions)
        np.testing.assert_array_equal(columns[:, [9, 6, 7, 8]], states.orientations)
        np.testing.assert_array_equal(columns[:, 10:13], states.velocities)
        np.testing.assert_array_equal(columns[:, 13:], states.angular_velocities)


def test_a_trajectory_of_a_failed_run_leaves_no_file(tmp_path):
    world = jfpx.World({"bodies": [BALL]})
    for name in ("run.xyz", "run.pvd"):
        with pytest.raises(LookupError):
            with jfpx.TrajectoryWriter(tmp_path / name, world) as trajectory:
                trajectory.append()
                raise LookupError
        assert list(tmp_path.iterdir()) == []
        with pytest.raises(jfpx.Closed):
            trajectory.append()


def test_other_libraries_read_trajectories(tmp_path, dtype):
    ase = pytest.importorskip("ase.io")
    vtk = pytest.importorskip("vtk")
    from vtk.util.numpy_support import vtk_to_numpy
    world = jfpx.World(jfpx.Scene.named("mixed", spheres=20, dtype=dtype))
    with jfpx.TrajectoryWriter(tmp_path / "run.extxyz", world) as text, \
            jfpx.TrajectoryWriter(tmp_path / "run.pvd", world) as binary:
        for _ in range(2):
            world.run(30)
            text.append()
            binary.append()
    states = world.states()
    ids = [body.index for body in world.bodies]
    atoms = ase.read(tmp_path / "run.extxyz", index=":")
    assert len(atoms) == 2 and atoms[1].info["Time"] == world.time and atoms[1].info["Step"] == 60
    np.testing.assert_array_equal(atoms[1].positions.astype(dtype), states.positions)
    np.testing.assert_array_equal(atoms[1].arrays["id"], ids)
    np.testing.assert_array_equal(np.roll(atoms[1].arrays["orientation"].astype(dtype), 1, 1),
                                  states.orientations)
    reader = vtk.vtkXMLPolyDataReader()
    reader.SetFileName(str(tmp_path / "run" / "run_000001.vtp"))
    reader.Update()
    points = reader.GetOutput()
    assert points.GetNumberOfVerts() == len(world)
    assert vtk_to_numpy(points.GetFieldData().GetArray("TimeValue")) == world.time
    values = {name: vtk_to_numpy(points.GetPointData().GetArray(name))
              for name in ("id", "radius", "orientation", "velocity", "angular_velocity")}
    values["position"] = vtk_to_numpy(points.GetPoints().GetData())
    np.testing.assert_array_equal(values["id"], ids)
    np.testing.assert_array_equal(values["radius"].astype(dtype), atoms[1].arrays["radius"].astype(dtype))
    for name, expected in zip(("position", "orientation", "velocity", "angular_velocity"), states):
        assert values[name].dtype == dtype
        np.testing.assert_array_equal(values[name], expected)


def test_a_recording_that_could_not_be_repeated_is_refused(tmp_path):
    path = tmp_path / "run.rec"
    world = jfpx.World({"bodies": [BALL]})
    force = world.add_force(jfpx.Drag(1.0))
    with pytest.raises(jfpx.InvalidArgument, match="the world has forces"):
        jfpx.RecordingWriter(path, world)
    world.remove_force(force)
    generator = world.add_contact_generator(lambda context: None)
    with pytest.raises(jfpx.InvalidArgument, match="the world has contact generators"):
        jfpx.RecordingWriter(path, world)
    world.remove_contact_generator(generator)
    with jfpx.RecordingWriter(path, world) as writer:
        with pytest.raises(jfpx.InvalidArgument, match="has made 0 steps"):
            writer.append()
        world.step()
        writer.append()
        with pytest.raises(jfpx.InvalidArgument, match="has made 0 steps"):
            writer.append()
        force = world.add_force(jfpx.Drag(1.0))
        with pytest.raises(jfpx.InvalidArgument, match="the world has forces"):
            writer.append()
        world.remove_force(force)
        world.run(2)
        with pytest.raises(jfpx.InvalidArgument, match="has made 2 steps"):
            writer.append()
    with pytest.raises(jfpx.InvalidArgument, match="begins with a new world"):
        jfpx.RecordingWriter(path, world)
    assert len(jfpx.Recording(path)) == 1


def test_a_body_that_leaves_the_finite_numbers_ends_a_run():
    world = jfpx.World({"bodies": [{**FREE, "velocity": [1e38, 0, 0]}], "dt": 1e6,
                        "solver": "worst_first"})
    report = world.run(10)
    assert report.non_finite and report.non_finite_body == (0, 0) and report.step == 0
    world.remove(report.non_finite_body)
    assert isinstance(report.non_finite_body, jfpx.BodyId) and not world.run(10).non_finite


def test_steps_after_a_restoration_have_the_same_bits(dtype):
    world = jfpx.World(jfpx.Scene.named("mixed", spheres=40, dtype=dtype), backend="cpu")
    world.run(30)
    snapshot = pickle.loads(pickle.dumps(world.snapshot()))
    other = jfpx.World({"bodies": [BALL]}, dtype=dtype, backend="cpu", threads=3)
    other.restore(snapshot)
    assert other.snapshot() == snapshot
    for copy in (world, other):
        copy.run(40)
    assert world.state_hash() == other.state_hash()
    world.restore(snapshot)
    world.run(40)
    assert world.state_hash() == other.state_hash()


def test_a_pickled_or_copied_world_continues_with_the_same_bits(dtype):
    world = jfpx.World(jfpx.Scene.named("mixed", spheres=20, dtype=dtype), backend="cpu", threads=2)
    world.run(20)
    world.remove(world.bodies[3])
    for duplicate in (copy.deepcopy, lambda original: pickle.loads(pickle.dumps(original))):
        copied = duplicate(world)
        assert copied.snapshot() == world.snapshot() and copied.scene == world.scene
        world.run(10)
        copied.run(10)
        assert copied.state_hash() == world.state_hash()
    world.add_force(lambda context: None)
    with pytest.raises(jfpx.InvalidSnapshot, match="force"):
        copy.deepcopy(world)


def test_a_world_with_another_solver_than_its_scene_is_copied():
    world = jfpx.World("bridge")
    world.restore(jfpx.World("boxes-and-balls").snapshot())
    assert copy.deepcopy(world).state_hash() == world.state_hash()

    class Named(jfpx.World):
        pass
    assert type(copy.copy(Named("pile"))) is Named


def test_a_damaged_snapshot_is_a_named_exception(dtype):
    world = jfpx.World({"bodies": [BALL]}, dtype=dtype)
    snapshot, before = world.snapshot(), world.state_hash()
    damaged = bytearray(snapshot)
    damaged[-1] ^= 1
    wrong_dtype = jfpx.World({"bodies": [BALL]}, dtype={"float32": "float64", "float64": "float32"}[dtype.name])
    for bad in (b"", snapshot[:-1], bytes(damaged), wrong_dtype.snapshot()):
        with pytest.raises(jfpx.InvalidSnapshot):
            world.restore(bad)
    with pytest.raises(jfpx.InvalidSnapshot, match=f"is float.* it must be {dtype}"):
        world.restore(wrong_dtype.snapshot())
    with pytest.raises(jfpx.InvalidArgument, match="it must be bytes"):
        world.restore("text")
    assert world.state_hash() == before


def test_a_closed_world_is_a_named_exception():
    with jfpx.World({"bodies": [BALL]}) as world:
        world.step()
    for call in (world.step, world.states, world.contacts, world.state_hash, world.snapshot, lambda: world.run(1),
                 lambda: world.cast_ray((0, 0, 0), (0, 0, 1)), lambda: world.add(BALL)):
        with pytest.raises(jfpx.Closed, match="the world is closed"):
            call()
    world.close()
    assert repr(world) == "<jfpx.World: the world is closed>"


def test_contacts_of_a_step_between_two_calls_are_a_named_exception():
    world = jfpx.World("pile", backend="cpu")
    world.run(40)
    contacts, events = world.contacts(), world.contact_events()
    assert len(contacts.distance) > 0 and len(events.distance) > 0
    world.remove(world.bodies[0])
    assert len(world.contacts().distance) == 0
    with pytest.raises(jfpx.ConcurrentUse):
        world._core.write_contacts(*world.contacts()._replace(distance=contacts.distance))
    with pytest.raises(jfpx.ConcurrentUse):
        world._core.write_events(*events._replace(distance=events.distance[:-1]))


def test_use_of_a_world_from_two_threads_is_a_named_exception():
    world = jfpx.World({"bodies": [BALL]})
    inside, leave = threading.Event(), threading.Event()

    def force(context):
        inside.set()
        leave.wait(60)

    world.add_force(force)
    thread = threading.Thread(target=world.step)
    thread.start()
    assert inside.wait(60)
    for call in (world.step, world.states, world.close):
        with pytest.raises(jfpx.ConcurrentUse, match="the world is in use"):
            call()
    leave.set()
    thread.join()
    assert world.step().step == 2


def test_other_threads_run_during_a_step():
    world = jfpx.World(jfpx.Scene.named("pile", spheres=4000))
    ticks = []
    stop = threading.Event()

    def tick():
        while not stop.is_set():
            ticks.append(time.monotonic())
            time.sleep(0.001)

    thread = threading.Thread(target=tick)
    thread.start()
    ran = False
    for _ in range(50):  # the other thread may be late on a busy machine
        begin = time.monotonic()
        world.step()
        end = time.monotonic()
        ran = ran or any(begin < t < end for t in ticks[-100:])
    stop.set()
    thread.join()
    assert ran


def test_ctrl_c_ends_a_run_between_two_steps():
    world = jfpx.World(jfpx.Scene.named("pile", spheres=200))
    timer = threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        world.run(10**9)
    timer.join()
    step = round(world.time / world.scene.dt)
    assert world.step().step == step + 1 > 1


def test_a_world_and_its_forces_are_collected():
    world = jfpx.World({"bodies": [BALL]})
    world.add_force(lambda context: world.positions)
    reference = weakref.ref(world)
    del world
    gc.collect()
    assert reference() is None


@pytest.mark.parametrize("call, error, message", [
    (lambda w: jfpx.Scene({"bodys": []}), jfpx.InvalidScene, "bodys"),
    (lambda w: jfpx.Scene({"bodies": [{**BALL, "mass": -1}]}), jfpx.InvalidScene, "mass"),
    (lambda w: jfpx.Scene({"bodies": [{**BALL, "mass": object()}]}), jfpx.InvalidScene, "JSON"),
    (lambda w: jfpx.Scene({"dt": float("nan")}), jfpx.InvalidScene, "dt is nan; it must be finite"),
    (lambda w: jfpx.Scene({"bodies": [BALL, {**BALL, "position": np.array([0, math.inf, 0])}]}),
     jfpx.InvalidScene, r"bodies\[1\].position\[1\] is inf"),
    (lambda w: w.add({**BALL, "mass": np.float32("nan")}), jfpx.InvalidScene, "mass is nan"),
    (lambda w: w.move_character((1, 2, 3), 0.1), jfpx.InvalidArgument, "state is .* CharacterState"),
    (lambda w: jfpx.Scene(dtype="int32"), jfpx.InvalidArgument, "dtype is 'int32'"),
    (lambda w: jfpx.Scene.from_json("{"), jfpx.InvalidScene, "line 1"),
    (lambda w: jfpx.Scene.load("/nowhere/scene.json"), jfpx.FileError, "/nowhere/scene.json"),
    (lambda w: jfpx.Scene().save("/nowhere/scene.json"), jfpx.FileError, "/nowhere"),
    (lambda w: jfpx.Scene.named("ditch"), jfpx.InvalidArgument, "ditch"),
    (lambda w: jfpx.Scene.named("pile", spheres=-1), jfpx.InvalidArgument, "spheres is -1"),
    (lambda w: jfpx.Scene().add_spheres(np.zeros((1, 3), np.float32), -1), jfpx.InvalidScene,
     "radius"),
    (lambda w: jfpx.Scene().add_spheres(np.zeros((1, 3), complex), 1), jfpx.InvalidArgument,
     "positions has dtype complex128"),
    (lambda w: jfpx.Scene().add_spheres([[1e300, 0, 0]], 1), jfpx.InvalidScene, "position"),
    (lambda w: jfpx.Scene("pile"), jfpx.InvalidArgument, r"it must be a dict; Scene.named\('pile'\)"),
    (lambda w: jfpx.Scene([BALL]), jfpx.InvalidArgument, "fields is of type list; it must be a dict"),
    (lambda w: jfpx.Scene.named(3), jfpx.InvalidArgument, "name is 3; it must be a str"),
    (lambda w: jfpx.Scene.from_json({}), jfpx.InvalidArgument, "text is of type dict"),
    (lambda w: jfpx.Scene.load(3), jfpx.InvalidArgument, "path is 3; it must be a str or a path"),
    (lambda w: jfpx.Scene().add_spheres(np.zeros((3, 3), np.float32), 1,
                                        velocities=np.zeros((2, 3), np.float32)),
     jfpx.InvalidArgument, "velocities has 2 rows"),
    (lambda w: w.add_spheres([[0, 9, 0]], 1, acceleration=[0, 1]), jfpx.InvalidArgument,
     r"acceleration has shape \(2,\); it must be three numbers or \(1, 3\)"),
    (lambda w: w.add_spheres([[0, 9, 0]], 1, acceleration=[[0, 1, 0]] * 2), jfpx.InvalidArgument,
     "acceleration has 2 rows; it must have 1 or 1"),
    (lambda w: w.add_spheres([[0, 9, 0]], 1, friction=[0, 1]), jfpx.InvalidArgument, "friction has shape"),
    (lambda w: w.add_spheres([[0, 9, 0]], 1, friction="ice"), jfpx.InvalidArgument, "friction is not an array"),
    (lambda w: w.add_spheres([[0, 9, 0], [9, 9, 9]], 1, restitution=[0, 2]), jfpx.InvalidScene,
     r"body 1.*restitution"),
    (lambda w: jfpx.Scene({"gravity": [0, 0, -9.81]}), jfpx.InvalidScene,
     'unknown field "gravity".*gravity is the field "acceleration" of each body'),
    (lambda w: jfpx.TrajectoryWriter("run.dump", w), jfpx.InvalidArgument,
     r'run.dump has the extension ".dump"; it must be .xyz'),
    (lambda w: jfpx.TrajectoryWriter("/nowhere/run.pvd", w), jfpx.FileError, "/nowhere/run.pvd: can't be written"),
    (lambda w: jfpx.TrajectoryWriter("run.xyz", 3), jfpx.InvalidArgument, "world is 3; it must be a World"),
    (lambda w: jfpx.World(3), jfpx.InvalidArgument, "scene is int"),
    (lambda w: jfpx.World(pathlib.Path("a.json")), jfpx.InvalidArgument, r"Scene.load\(\) reads a file"),
    (lambda w: jfpx.World(w.scene, dtype="float64"), jfpx.InvalidArgument, "dtype is float64"),
    (lambda w: jfpx.World(w.scene, dtype="foo"), jfpx.InvalidArgument, "dtype is 'foo'"),
    (lambda w: jfpx.World("pile", dtype="foo"), jfpx.InvalidArgument, "dtype is 'foo'"),
    (lambda w: jfpx.World("pile", backend="gpu"), jfpx.InvalidArgument, "backend is 'gpu'"),
    (lambda w: jfpx.World("pile", backend="x86"), jfpx.InvalidArgument, "backend is 'x86'"),
    (lambda w: jfpx.World("pile", backend=None), jfpx.InvalidArgument, "backend is None"),
    (lambda w: jfpx.World("pile", algorithm=3), jfpx.InvalidArgument, "algorithm is 3"),
    (lambda w: jfpx.World("pile", threads=1000), jfpx.InvalidArgument, "threads is 1000"),
    (lambda w: w.run(0), jfpx.InvalidArgument, "steps is 0"),
    (lambda w: w.run(1, after_step=3), jfpx.InvalidArgument, "after_step is 3"),
    (lambda w: w.body_at(7), jfpx.InvalidArgument, "7"),
    (lambda w: w.state(3), jfpx.InvalidArgument, r"body is 3; it must be a BodyId.*World.body_at\(index\)"),
    (lambda w: w.state((-1, 0)), jfpx.InvalidArgument, r"body is \(-1, 0\)"),
    (lambda w: 3 in w, jfpx.InvalidArgument, "body is 3"),
    (lambda w: w.set_mass("ball", 1), jfpx.InvalidArgument, "body is 'ball'"),
    (lambda w: w.set_pair_ignored(w.bodies[0], 1, True), jfpx.InvalidArgument, "b is 1"),
    (lambda w: w.add_scene({"bodies": [BALL]}), jfpx.InvalidArgument, "scene is of type dict"),
    (lambda w: w.remove(jfpx.BodyId(7, 0)), jfpx.InvalidArgument, "7"),
    (lambda w: w.set_mass(w.bodies[0], -1), jfpx.InvalidArgument, "mass"),
    (lambda w: w.set_friction(w.bodies[0], "high"), jfpx.InvalidArgument, "friction is 'high'"),
    (lambda w: w.set_filter(w.bodies[0], -1, 0), jfpx.InvalidArgument, "category is -1"),
    (lambda w: w.set_motion_locks(w.bodies[0], 1), jfpx.InvalidArgument, "linear is 1; it must be 3"),
    (lambda w: w.set_motion_locks(w.bodies[0], angular=(1, 0, 0)), jfpx.InvalidArgument,
     r"angular is \(1, 0, 0\); it must be 3 truth values"),
    (lambda w: w.apply_force(w.bodies[0], (1, 2)), jfpx.InvalidArgument, "force has 2 numbers"),
    (lambda w: w.apply_force(w.bodies[0], 1), jfpx.InvalidArgument, "force is 1"),
    (lambda w: w.apply_force(w.bodies[0], (float("nan"), 0, 0)), jfpx.InvalidArgument, "force"),
    (lambda w: w.add_force(3), jfpx.InvalidArgument, "force is int"),
    (lambda w: w.add_force(jfpx.Drag(linear=-1)), jfpx.InvalidArgument, "linear"),
    (lambda w: w.add_force(jfpx.Drag(linear="x")), jfpx.InvalidArgument, "linear is 'x'"),
    (lambda w: w.add_force(jfpx.Drag(body=1)), jfpx.InvalidArgument, "body is 1; it must be a BodyId"),
    (lambda w: w.add_force(jfpx.Gravity), jfpx.InvalidArgument, r"the class Gravity.*Gravity\(\.\.\.\)"),
    (lambda w: w.add_force(jfpx.Spring(w.bodies[0], w.bodies[1], 2)), jfpx.InvalidArgument,
     r"a is .*it must be an Attachment, such as Attachment\(body\)"),
    (lambda w: w.add_force(jfpx.Bungee(jfpx.Attachment(1), jfpx.Attachment(), 2)),
     jfpx.InvalidArgument, "body is 1"),
    (lambda w: w.remove_force(99), jfpx.InvalidArgument, "99"),
    (lambda w: w.cast_ray((0, 0, 0), (0, 0, 0)), jfpx.InvalidArgument, "direction"),
    (lambda w: w.cast_ray((0, 0, 0), (0, 0, 1), -1), jfpx.InvalidArgument, "distance"),
    (lambda w: w.cast_ray((0, 0, 0), (0, 0, 1), filter=3), jfpx.InvalidArgument, "filter is 3"),
    (lambda w: w.closest_body((0, 0, 0), max_distance=-1), jfpx.InvalidArgument, "max_distance is -1"),
    (lambda w: w.closest_body((0, 0, 0), GROUND["shape"]), jfpx.InvalidArgument, "no solid"),
    (lambda w: w.move_character(jfpx.CharacterState((0, 1, 0)), 0), jfpx.InvalidArgument, "dt is 0"),
    (lambda w: w.move_character(jfpx.CharacterState((0, 1, 0), ground="up"), 1), jfpx.InvalidArgument, "ground is 'up'"),
    (lambda w: w.move_character(jfpx.CharacterState((0, 1, 0)), 1, jfpx.CharacterSettings(skin=1)),
     jfpx.InvalidArgument, "skin is 1"),
    (lambda w: w.bodies_within((0, 0, 0), 1, filter=3), jfpx.InvalidArgument, "filter is 3"),
    (lambda w: w.closest_bodies([[0, 0, 0]], max_distances=-1), jfpx.InvalidArgument, "query 0: max_"),
    (lambda w: w.closest_bodies([[0, 0, 0]], None, np.zeros((3, 4))), jfpx.InvalidArgument, "3 rows"),
    (lambda w: jfpx.World({}, hit_speed=0), jfpx.InvalidArgument, "hit_speed is 0"),
    (lambda w: w.cast_rays(np.zeros((2, 3), np.float32), np.zeros((2, 3), np.float32)),
     jfpx.InvalidArgument, "ray 0: .*direction"),
    (lambda w: w.cast_rays(np.zeros((2, 3), np.float32), np.zeros((1, 3), np.float32)),
     jfpx.InvalidArgument, "directions has 1 rows"),
    (lambda w: w.overlapping_sphere((0, 0, 0), -1), jfpx.InvalidArgument, "radius"),
    (lambda w: w.overlapping({"type": "plane", "normal": [0, 1, 0], "offset": 0}, (0, 0, 0)),
     jfpx.InvalidArgument, "the shape is no solid"),
    (lambda w: w.cast_shape({"type": "capsule", "radius": 0, "half_height": 1}, (0, 0, 0), (0, 0, 1)),
     jfpx.InvalidScene, "radius"),
    (lambda w: w.cast_shape({"type": "sphere", "radius": 1}, (0, 0, 0), (0, 0, 2e9)),
     jfpx.InvalidArgument, "translation is"),
    (lambda w: w.cast_shapes({"type": "sphere", "radius": 1}, [[0, 0, 0]], [[0, 0, 2e9]]),
     jfpx.InvalidArgument, "cast 0: translation"),
    (lambda w: w.cast_shapes({"type": "sphere", "radius": 1}, np.zeros((2, 3)), np.zeros((1, 3))),
     jfpx.InvalidArgument, "1 rows"),
    (lambda w: w.cast_shapes({"type": "sphere", "radius": 1}, np.zeros((3, 3)), np.zeros((3, 3)), np.ones((2, 4))),
     jfpx.InvalidArgument, "2 rows"),
    (lambda w: w.set_states(w.states()._replace(positions=np.zeros((9, 3), np.float32))),
     jfpx.InvalidArgument, "positions has 9 rows"),
    (lambda w: w.set_states(w.positions), jfpx.InvalidArgument, "states is not a States"),
    (lambda w: w.set_state(w.bodies[0], 3), jfpx.InvalidArgument, "state is 3; it must be a BodyState"),
    (lambda w: w.add({**BALL, "mass": -1}), jfpx.InvalidScene, "mass"),
    (lambda w: w.add_scene(jfpx.Scene(dtype="float64")), jfpx.InvalidArgument, "float64"),
    (lambda w: jfpx.Recording("/nowhere/run.rec"), jfpx.FileError, "/nowhere/run.rec"),
    (lambda w: jfpx.RecordingWriter("/nowhere/run.rec", w), jfpx.FileError, "/nowhere/run.rec"),
    (lambda w: jfpx.RecordingWriter("/nowhere/run.rec", "pile"), jfpx.InvalidArgument,
     "world is 'pile'; it must be a World"),
    (lambda w: jfpx.RecordingWriter(3, w), jfpx.InvalidArgument, "path is 3"),
])
def test_bad_input_is_a_named_exception_and_changes_nothing(call, error, message):
    world = jfpx.World({"bodies": [BALL, FLOOR]})
    before = world.state_hash()
    with pytest.raises(error, match=message):
        call(world)
    assert world.state_hash() == before and len(world) == 2 and world.forces == []


def test_python_m_jfpx_runs_the_command(tmp_path):
    def run(path):
        return subprocess.run([sys.executable, "-m", "jfpx", "devices"], capture_output=True,
                              text=True, env={**os.environ, "PATH": path})

    folder = os.path.dirname(sys.executable)
    if os.path.exists(os.path.join(folder, "jfpx")):
        pytest.skip("the command is beside Python")
    missing = run("")
    assert missing.returncode == 3
    assert "not installed" in missing.stderr and "jfpx.Recording" in missing.stderr
    command = tmp_path / "jfpx"
    command.write_text("#!/bin/sh\necho \"got $1\"\n")
    command.chmod(0o755)
    assert run(f"{tmp_path}:/bin").stdout == "got devices\n"


ROOT = pathlib.Path(__file__).parents[2]


def run_code_of(document):
    """The names that the Python code of a document defines."""
    names = {}
    for block in re.findall(r"```python\n(.*?)```", (ROOT / document).read_text(), re.DOTALL):
        exec(block, names)
    return names


@pytest.mark.parametrize("document", ["README.md", "python/README.md"])
def test_the_code_of_the_readme_runs(document):
    names = run_code_of(document)
    assert names["pairs"].shape[1] > 0 and names["world"].report.step == 600


def test_the_code_of_the_guide_runs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = run_code_of("docs/python.md")
    assert names["pairs"].shape[1] == names["size"] == names["contacts"].pairs.shape[1] > 0
    assert names["report"].step == 120 and len(names["recording"]) == 10
    assert np.isfinite(names["frames"]).all()


def square_mesh(size=4):
    """Vertices and triangles of a square in the plane y = 0."""
    vertices = np.array([[-size, 0, -size], [size, 0, -size], [-size, 0, size], [size, 0, size]])
    return vertices, np.array([[0, 2, 1], [1, 2, 3]])


def test_a_triangle_mesh_carries_a_ball():
    for dtype in ("float32", "float64"):
        scene = jfpx.Scene(dtype=dtype)
        vertices, triangles = square_mesh()
        report = scene.add_triangle_mesh(vertices, triangles, position=[0, 1, 0], friction=0.9)
        assert report == {"degenerate": 0, "duplicate": 0, "open_edges": 4, "shared_edges": 0,
                          "flipped_edges": 0}
        scene.add_spheres([[0.3, 2, 0.1]], 0.5)
        shape = scene.to_dict()["bodies"][0]["shape"]
        assert shape["type"] == "triangle_mesh" and shape["triangles"] == triangles.tolist()
        with jfpx.World(scene) as world:
            for _ in range(200):
                world.step()
            assert abs(world.states().positions[1, 1] - 1.5) < 1e-3


def test_a_triangle_mesh_is_taken_from_an_object():
    class Mesh:
        vertices, faces = square_mesh()

    scene = jfpx.Scene()
    scene.add_triangle_mesh(Mesh(), two_sided=True)
    assert scene.to_dict()["bodies"][0]["shape"]["two_sided"] is True


@pytest.mark.parametrize(("arguments", "message"), [
    (([[0, 0, 0]],), "triangles is missing"),
    (([[0, 0, 0]], [[0, 0, 1]]), r"triangles\[0\]\[2\] is 1; it must be an index of the mesh's 1 vertices"),
    (([[0, 0, 0]], [[0, 0, -1]]), "triangles has the index -1"),
    (([[0, 0, 0]], [[0.0, 0, 1]]), "triangles has dtype float64; it must be an array of integers"),
    (([[0, 0]], [[0, 0, 0]]), r"vertices has shape \(1, 2\); it must be \(N, 3\)"),
    (([[0, 0, np.nan]], [[0, 0, 0]]), r"vertices\[0\]\[2\] is nan"),
])
def test_faults_of_a_triangle_mesh_are_named(arguments, message):
    scene = jfpx.Scene()
    with pytest.raises(jfpx.InvalidArgument, match=message):
        scene.add_triangle_mesh(*arguments)
    assert len(scene) == 0


def test_a_heightfield_carries_a_ball():
    for dtype in ("float32", "float64"):
        scene = jfpx.Scene(dtype=dtype)
        heights = np.zeros((5, 7))
        heights[0, 0] = 2
        holes = np.zeros((4, 6), bool)
        holes[3, 2] = True
        scene.add_heightfield(heights, (1.5, 2), holes=holes, position=[0, 1, 0], friction=0.9)
        scene.add_spheres([[0.3, 2, 0.1]], 0.5)
        shape = scene.to_dict()["bodies"][0]["shape"]
        assert shape == {"type": "heightfield", "columns": 7, "rows": 5, "spacing_x": 1.5, "spacing_z": 2,
                         "heights": heights.ravel().tolist(), "holes": [23], "two_sided": False}
        with jfpx.World(scene) as world:
            for _ in range(200):
                world.step()
            assert abs(world.states().positions[1, 1] - 1.5) < 1e-3


@pytest.mark.parametrize(("arguments", "options", "message"), [
    (([1, 2, 3],), {}, r"heights has shape \(3,\); it must be \(rows, columns\)"),
    (([[1, 2]],), {}, "rows is 1; it must be from 2 to 65536"),
    (([[0, np.nan], [0, 0]],), {}, r"heights\[1\] is nan"),
    (([[0, 0], [0, 0]], 0), {}, "spacing_x is 0"),
    (([[0, 0], [0, 0]], (1, -1)), {}, "spacing_z is -1"),
    (([[0, 0], [0, 0]], "wide"), {}, "spacing is 'wide'"),
    (([[0, 0], [0, 0]], (1, 2, 3)), {}, r"spacing has shape \(3,\)"),
    (([[0, 0], [0, 0]],), {"holes": [[1]]}, r"holes has shape \(1, 1\) and dtype int64"),
    (([[0, 0], [0, 0]],), {"shape": {}}, "shape is given"),
])
def test_faults_of_a_heightfield_are_named(arguments, options, message):
    scene = jfpx.Scene()
    with pytest.raises(jfpx.InvalidArgument, match=message):
        scene.add_heightfield(*arguments, **options)
    assert len(scene) == 0


def test_fields_of_the_body_of_a_mesh_are_checked():
    scene = jfpx.Scene()
    with pytest.raises(jfpx.InvalidScene, match="mass is 1; it must be 0 for a triangle mesh"):
        scene.add_triangle_mesh(*square_mesh(), mass=1)
    with pytest.raises(jfpx.InvalidScene, match="unknown field"):
        scene.add_triangle_mesh(*square_mesh(), colour=1)

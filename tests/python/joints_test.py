"""Joints of worlds."""

import math

import numpy as np
import pytest

import jfpx

BALL = {"shape": {"type": "sphere", "radius": 0.1}, "can_sleep": False}


def row_of_balls(count, **options):
    return jfpx.World({"bodies": [{**BALL, "position": [i, 0, 0]} for i in range(count)]}, **options)


@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_a_pendulum_swings_about_its_anchor(dtype):
    world = row_of_balls(1, dtype=dtype)
    ball = world.bodies[0]
    rod = world.add_joint(jfpx.DistanceJoint(ball, anchor_b=(0, 1, 0), min_length=1, max_length=1))
    states = world.state(ball)
    world.set_state(ball, states._replace(velocity=(0.5, 0, 0)))
    lengths, heights = [], []
    for _ in range(240):
        world.step()
        state = world.joint_state(rod)
        lengths.append(state.length)
        heights.append(world.state(ball).position[1])
        assert math.dist(state.point_b, (0, 1, 0)) == 0
    np.testing.assert_allclose(lengths, 1, atol=1e-5)
    # The height of the energy at the start.
    assert max(heights) == pytest.approx(0.5**2 / (2 * 9.81), rel=0.02)


def turned(q, v):
    """A vector, or those in rows, turned by a quaternion (w, x, y, z)."""
    w, u = q[0], np.array(q[1:])
    return v + 2 * np.cross(u, np.cross(u, v) + w * v)


def test_place_joint_puts_the_frames_of_both_bodies_in_one_place():
    rng = np.random.default_rng(5)
    for _ in range(20):
        world = row_of_balls(2, dtype="float64")
        states = []
        for body in world.bodies:
            q = rng.normal(size=4)
            states.append(jfpx.BodyState(rng.normal(size=3), q / np.linalg.norm(q)))
            world.set_state(body, states[-1])
        point, axis, y_axis = rng.normal(size=(3, 3))
        joint = jfpx.WheelJoint(*world.bodies, hertz=2)
        for b, used in ((states[1], joint), (None, jfpx.WheelJoint(world.bodies[0], hertz=2))):
            placed = jfpx.place_joint(used, states[0], b, point, 1e200 * axis, y_axis)
            assert placed.hertz == 2
            other = b or jfpx.BodyState((0, 0, 0))
            for state, anchor, axes in ((states[0], placed.anchor_a, placed.axes_a),
                                        (other, placed.anchor_b, placed.axes_b)):
                np.testing.assert_allclose(state.position + turned(state.orientation, np.array(anchor)), point)
                x, y = (turned(state.orientation, turned(axes, np.array(v))) for v in ((1, 0, 0), (0, 1, 0)))
                np.testing.assert_allclose(x, axis / np.linalg.norm(axis), atol=1e-12)
                assert y @ y_axis > 0 and abs(np.cross(x, y) @ y_axis) < 1e-12
        number = world.add_joint(jfpx.place_joint(joint, *states, point, axis))
        state = world.joint_state(number)
        assert state.length < 1e-9 and state.position == pytest.approx(0, abs=1e-9)


def test_errors_of_place_joint_name_the_argument():
    world = row_of_balls(2)
    hinge, state = jfpx.HingeJoint(world.bodies[0]), world.state(world.bodies[0])
    joined = jfpx.HingeJoint(*world.bodies)
    for arguments, message in (
            ((joined, state, None, (0, 0, 0), (1, 0, 0)), "b is absent, but joint.b is a body"),
            ((hinge, state, state, (0, 0, 0), (1, 0, 0)), "b is a state, but joint.b is the world"),
            ((hinge, state, None, (0, math.nan, 0), (1, 0, 0)), "point is .*finite"),
            ((jfpx.DistanceJoint(world.bodies[0]), state, None, (0, 0, 0), (1, 0, 0)), "a joint with axes"),
            ((hinge, state, None, (0, 0, 0), (0, 0, 0)), "axis"),
            ((hinge, state, None, (0, 0, 0), (1, 0, 0), (2, 0, 0)), "parallel"),
            ((hinge, world.bodies[0], None, (0, 0, 0), (1, 0, 0)), "a is of type BodyId"),
            ((hinge, state, None, (0, 0), (1, 0, 0)), "point")):
        with pytest.raises(jfpx.InvalidArgument, match=message):
            jfpx.place_joint(*arguments)


def test_joints_are_added_changed_and_removed():
    world = row_of_balls(3)
    a, b, c = world.bodies
    spring = jfpx.DistanceJoint(a, b, (0.1, 0, 0), (0, 0, 0.25), 0.5, 2, 1, 3, 0.5, True, 2**63)
    first = world.add_joint(spring)
    second = world.add_joint(jfpx.DistanceJoint(b, c, max_length=1))
    assert world.joints == [first, second] and isinstance(first, jfpx.JointId)
    definition = world.joint(first)
    assert (definition.a, definition.b, definition.user_data) == (a, b, 2**63)
    assert definition.anchor_b == (0, 0, 0.25) and definition.collide_connected is True
    assert world.joint(second) == jfpx.DistanceJoint(b, c, max_length=1)
    world.set_joint(second, jfpx.DistanceJoint(b, c, max_length=0.5))
    for _ in range(120):
        world.step()
    assert world.joint_state(second).length < 0.51
    world.remove(b)
    assert world.joints == []
    for call in (world.joint, world.joint_state, world.remove_joint):
        with pytest.raises(jfpx.InvalidArgument, match="joint id"):
            call(first)


def test_a_scene_has_joints_and_a_snapshot_keeps_them():
    scene = {"bodies": [{**BALL, "position": [i, 0, 0]} for i in range(2)],
             "joints": [{"type": "distance", "a": 0, "b": 1, "max_length": 1.5},
                        {"type": "distance", "a": 0, "anchor_b": [0, 1, 0], "max_length": 1}]}
    assert len(jfpx.Scene(scene).to_dict()["joints"]) == 2
    world, other = jfpx.World(scene, threads=1), jfpx.World({"bodies": []})
    assert len(world.joints) == 2
    for _ in range(30):
        world.step()
    other.restore(world.snapshot())
    for _ in range(30):
        world.step()
        other.step()
    assert world.state_hash() == other.state_hash() and other.joints == world.joints


def test_errors_name_the_field_of_a_joint():
    world = row_of_balls(2)
    a, b = world.bodies
    for joint, message in ((jfpx.DistanceJoint(a, b, min_length=2, max_length=1), "min_length is 2"),
                           (jfpx.DistanceJoint(a, a), "b is body 0"),
                           (jfpx.DistanceJoint((7, 0), b), "body id"),
                           (jfpx.DistanceJoint(a, b, hertz=-1), "hertz is -1"),
                           (jfpx.DistanceJoint(a, b, hertz=math.nan), "hertz is nan"),
                           (jfpx.DistanceJoint(a, b, anchor_a=(1, 2)), "anchor_a has 2 numbers"),
                           (jfpx.DistanceJoint(a, b, user_data=-1), "user_data is -1"),
                           (jfpx.DistanceJoint(0), "a is 0; it must be a BodyId"),
                           (jfpx.DistanceJoint, "it must be a joint of jfpx"),
                           (jfpx.Gravity(), "it must be a joint of jfpx")):
        with pytest.raises(jfpx.InvalidArgument, match=message):
            world.add_joint(joint)
    with pytest.raises(jfpx.InvalidArgument, match="it must be a JointId"):
        world.joint(3)
    assert world.joints == []


def test_a_hinge_turns_by_its_motor_and_stops_at_its_limit():
    world = row_of_balls(1, dtype="float64")
    ball = world.bodies[0]
    half = math.sqrt(0.5)
    hinge = jfpx.HingeJoint(ball, axes_a=(half, 0, 0, half), axes_b=(half, 0, 0, half),
                            max_angle=1, motor_speed=2, max_motor_torque=5)
    added = world.add_joint(hinge)
    assert world.joint(added) == hinge
    world.step()
    state = world.joint_state(added)
    assert state.speed == pytest.approx(2, rel=1e-6) and len(state.torque) == 3
    assert world.state(ball).angular_velocity[1] == pytest.approx(2, rel=1e-6)
    for _ in range(60):
        world.step()
    assert world.joint_state(added).position == pytest.approx(1, abs=0.003)


@pytest.mark.parametrize("kind", ["BallJoint", "HingeJoint", "SliderJoint", "FixedJoint",
                                  "WheelJoint"])
def test_a_joint_with_axes_is_read_as_it_was_added(kind):
    world = row_of_balls(2, dtype="float64")
    a, b = world.bodies
    joint = getattr(jfpx, kind)(a, b, anchor_b=(0, 0.5, 0), axes_a=(0, 1, 0, 0), user_data=7)
    added = world.add_joint(joint)
    assert world.joint(added) == joint
    for _ in range(30):
        world.step()
    assert all(math.isfinite(x) for x in world.joint_state(added).force)
    with pytest.raises(jfpx.InvalidArgument, match="axes_a"):
        world.add_joint(getattr(jfpx, kind)(a, b, axes_a=(1, 2, 0, 0)))
    with pytest.raises(jfpx.InvalidArgument, match="axes_b has 3 numbers; it must have 4"):
        world.add_joint(getattr(jfpx, kind)(a, b, axes_b=(1, 0, 0)))

"""Pictures of worlds, scenes and recordings."""

import base64
import copy
import json
import re
import shutil
import signal
import subprocess
import sys
import zlib

import numpy as np
import pytest

import jfpx
from jfpx._view import geometry

TILTED = (0.5, 0.5, -0.5, 0.5)
"""x to -z, y to x, z to -y"""


def header(data):
    """The header of scene_blob(), and its arrays in the place of their names."""
    length = int.from_bytes(data[:4], "little")
    fields = json.loads(data[4:4 + length])
    types = {"Float32Array": "<f4", "Uint32Array": "<u4", "Uint8Array": "u1"}

    def array(place):
        return np.frombuffer(data, types[place[0]], place[2], 4 + length + place[1])

    fields["balls"] = array(fields["balls"])
    for group in fields["groups"]:
        for key in ("bodies", "sizes", "paints", "poses", "vertices", "indices"):
            if key in group:
                group[key] = array(group[key])
    return fields


def content(html):
    """The scene and the frames in the text of a page."""
    scene, movie = (zlib.decompress(base64.b64decode(re.search(f'{name}: "([^"]*)"', html)[1]))
                    for name in ("scene", "movie"))
    fields = header(scene)
    frames = np.frombuffer(movie, np.uint8).reshape(-1, max(21 * fields["bodies"], 1))
    return fields, np.bitwise_xor.accumulate(frames, axis=0)


def positions(frame, fields):
    """Positions in the bytes of a frame."""
    size = fields["bodies"]
    return np.frombuffer(bytes(frame), "<f4", 3 * size).reshape(size, 3) + fields["origin"]


def points_of(scene):
    """The vertices in world axes of the first solid of each group of a scene."""
    size = len(scene)
    place, turn = np.empty((size, 3), scene.dtype), np.empty((size, 4), scene.dtype)
    scene._scene.write_poses(place, turn)
    for group in geometry.groups_of(geometry.Geometry.of(scene._scene)):
        local = group.model.points(group.sizes[0])
        local = group.poses[0, :3] + geometry.rotated(np.tile(group.poses[0, 3:], (len(local), 1)), local)
        body = group.bodies[0]
        yield place[body] + geometry.rotated(np.tile(turn[body], (len(local), 1)), local)


def one_body(shape, mass=1, **fields):
    return jfpx.Scene({"bodies": [{"shape": shape, "mass": mass, "position": [1, 2, 3], "orientation": TILTED, **fields}]})


OCTAHEDRON = [[x, 0, 0] for x in (-1, 1)] + [[0, y, 0] for y in (-2, 2)] + [[0, 0, z] for z in (-3, 3)]


@pytest.mark.parametrize("shape, mass, low, high", [
    ({"type": "box", "half_extents": [1, 2, 3]}, 1, [-1, -2, -3], [1, 2, 3]),
    ({"type": "capsule", "radius": 0.5, "half_height": 2}, 1, [-0.5, -2.5, -0.5], [0.5, 2.5, 0.5]),
    ({"type": "cylinder", "radius": 0.5, "half_height": 2}, 1, [-0.5, -2, -0.5], [0.5, 2, 0.5]),
    ({"type": "cone", "radius": 0.5, "half_height": 2}, 1, [-0.5, -1, -0.5], [0.5, 3, 0.5]),
    ({"type": "hull", "vertices": OCTAHEDRON}, 1, [-1, -2, -3], [1, 2, 3]),
    ({"type": "compound", "parts": [{"shape": {"type": "box", "half_extents": [1, 2, 3]}, "position": [4, 0, 0]},
                                    {"shape": {"type": "sphere", "radius": 1}}]}, 0, [3, -2, -3], [5, 2, 3]),
    ({"type": "triangle_mesh", "vertices": [[0, 0, 0], [2, 0, 0], [0, 3, 0], [9, 9, 9]], "triangles": [[0, 1, 2]]}, 0,
     [0, 0, 0], [2, 3, 0]),
    ({"type": "heightfield", "columns": 3, "rows": 2, "spacing_x": 1, "spacing_z": 2, "heights": [0, 1, 0, 4, 0, 0]}, 0,
     [-1, 0, -1], [1, 4, 1]),
])
def test_a_shape_has_its_extents_in_the_pose_of_its_body(shape, mass, low, high):
    scene = one_body(shape, mass)
    points = next(points for points in points_of(jfpx.Scene(_without_balls(scene.to_dict()))))
    low, high = np.array(low), np.array(high)
    corners = geometry.rotated(np.tile(np.array(TILTED), (2, 1)), np.array([low, high], float)) + [1, 2, 3]
    np.testing.assert_allclose(points.min(axis=0), corners.min(axis=0), atol=2e-6)
    np.testing.assert_allclose(points.max(axis=0), corners.max(axis=0), atol=2e-6)


def _without_balls(fields):
    """Balls have no vertices; those of a compound are left out."""
    fields = copy.deepcopy(fields)
    for body in fields["bodies"]:
        parts = body["shape"].get("parts")
        if parts:
            body["shape"]["parts"] = [part for part in parts if part["shape"]["type"] != "sphere"]
    return fields


@pytest.mark.parametrize("shape", [
    {"type": "box", "half_extents": [1, 2, 3]}, {"type": "capsule", "radius": 0.5, "half_height": 2},
    {"type": "cylinder", "radius": 0.5, "half_height": 2}, {"type": "cone", "radius": 0.5, "half_height": 2},
    {"type": "hull", "vertices": OCTAHEDRON},
])
def test_solids_are_closed_and_their_fronts_and_normals_point_outwards(shape):
    group, = geometry.groups_of(geometry.Geometry.of(one_body(shape)._scene))
    points, size = group.model.points(group.sizes[0]), group.sizes[0, :3]
    triangles = points[group.model.indices]
    faces = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    volume = np.einsum("ij,ij->i", triangles[:, 0], faces).sum() / 6
    exact = {"box": 48, "capsule": np.pi * (0.25 * 4 + 0.5**3 * 4 / 3), "cylinder": np.pi, "cone": np.pi / 3,
             "hull": 8}[shape["type"]]
    assert 0.98 * exact < volume < 1.001 * exact
    assert np.abs(faces.sum(axis=0)).max() < 1e-4  # closed
    normals = (group.model.vertices[:, 4:] / size)[group.model.indices]
    solid = np.linalg.norm(faces, axis=1) > 1e-9
    assert np.einsum("ij,ikj->ik", faces, normals)[solid].min() > 0


def test_a_hole_of_a_heightfield_has_no_triangles():
    scene = jfpx.Scene()
    scene.add_heightfield(np.zeros((3, 3), np.float32), holes=[[True, False], [False, False]])
    group, = geometry.groups_of(geometry.Geometry.of(scene._scene))
    assert len(group.model.indices) == 6


def test_a_mesh_is_uploaded_once_for_all_bodies_that_share_it():
    mesh = {"type": "hull", "vertices": OCTAHEDRON}
    scene = jfpx.Scene({"bodies": [{"shape": mesh, "position": [5 * i, 0, 0]} for i in range(2)]})
    world = jfpx.World(scene)
    world.add_scene(world.scene)
    groups = geometry.groups_of(geometry.Geometry.of(world._core))
    assert sum(len(group.bodies) for group in groups) == 4 and len(groups) <= 2


def test_balls_are_one_group(dtype):
    scene = jfpx.Scene.named("heap", spheres=10_000, dtype=dtype)
    view = jfpx.World(scene).view()
    fields = header(view._scene)
    ball, *others = fields["groups"]
    assert ball["count"] == 10_000 and "vertices" not in ball
    assert len(others) == 2  # the floor, and walls of glass
    assert len(view._scene) < 64 * 10_000


def test_planes_are_seen_from_the_side_of_the_bodies():
    bodies = [{"shape": {"type": kind, "normal": [0, 1, 0], "offset": offset}, "mass": 0}
              for kind, offset in (("half_space", 0), ("plane", 9))]
    scene = jfpx.Scene({"bodies": [*bodies, {"shape": {"type": "sphere", "radius": 1}, "position": [0, 4, 0]}]})
    fields = header(scene.view()._scene)
    lifted = [[*plane[:3], plane[3] + np.dot(plane[:3], fields["origin"])] for plane in fields["planes"]]
    assert sorted(map(tuple, lifted)) == [(0, -1, 0, -9), (0, 1, 0, 0)]


@pytest.mark.parametrize("acceleration, up", [
    ([0, -9.81, 0], [0, 1, 0]), ([0, 0, -9.81], [0, 0, 1]), ([3, 0, 1], [-1, 0, 0]), ([0, 0, 0], [0, 1, 0])])
def test_up_is_against_gravity(acceleration, up):
    scene = one_body({"type": "sphere", "radius": 1}, acceleration=acceleration)
    assert header(scene.view()._scene)["up"] == up
    assert header(jfpx.World(scene).view()._scene)["up"] == up


def test_the_camera_shows_all_bodies():
    scene = jfpx.Scene.named("mixed", spheres=100, boxes=50)
    fields = header(scene.view()._scene)
    balls = fields["balls"].reshape(-1, 4)
    bodies = scene.to_dict()["bodies"]
    places = np.array([body["position"] for body in bodies if body["mass"] > 0]) - fields["origin"]
    low, high = (balls[:, :3] - balls[:, 3:]).min(axis=0), (balls[:, :3] + balls[:, 3:]).max(axis=0)
    assert (low < places.min(axis=0)).all() and (places.max(axis=0) < high).all()
    runaway = jfpx.World(scene).states()
    runaway.positions[5] = 1e8
    far = header(scene.view([runaway])._scene)
    assert np.abs(far["balls"]).max() < 1e3


def test_a_page_has_all_bodies_and_needs_no_network(tmp_path):
    world = jfpx.World("pile")
    world.run(30)
    path = tmp_path / "pile.html"
    world.view().save(path)
    html = path.read_text()
    assert not re.search(r"https?:|<link|src=|\bimport\b", html)
    fields, frames = content(html)
    shown = np.concatenate([group["bodies"] for group in fields["groups"]])
    movable = [row for row, body in enumerate(world.bodies) if world.mass(body) > 0]
    assert set(movable) <= set(shown.tolist()) and fields["bodies"] == len(world)
    np.testing.assert_allclose(positions(frames[0], fields)[movable], world.positions[movable], atol=1e-5)


def test_sleeping_bodies_are_marked():
    scene = jfpx.Scene({"bodies": [{"shape": {"type": "half_space", "normal": [0, 1, 0], "offset": 0}, "mass": 0},
                                   {"shape": {"type": "sphere", "radius": 1}, "position": [0, 1, 0]},
                                   {"shape": {"type": "sphere", "radius": 1}, "position": [9, 99, 0]}]})
    world = jfpx.World(scene)
    world.run(90)
    assert [world.awake(body) for body in world.bodies] == [False, False, True]
    _, frames = content(world.view().to_html())
    assert frames[0][-3:].tolist() == [1, 0, 1]  # the ground is never dimmed


def test_frames_are_those_of_states_positions_and_recordings(tmp_path):
    world = jfpx.World("pile")
    states = []
    path = tmp_path / "pile.rec"
    with jfpx.RecordingWriter(path, world) as writer:
        for _ in range(6):
            world.step()
            writer.append()
            states.append(world.states())
    places = np.array([s.positions for s in states])
    recording = jfpx.Recording(path)
    for view, chosen, interval in (
            (world.scene.view(states), places, world.scene.dt), (world.scene.view(places), places, world.scene.dt),
            (world.scene.view(places[::3], interval=0.5), places[::3], 0.5),
            (recording.view(every=2), places[1::2], 2 * world.scene.dt)):
        fields, frames = content(view.to_html())
        assert len(frames) == len(view) == len(chosen) and fields["interval"] == interval
        for frame, expected in zip(frames, chosen):
            np.testing.assert_allclose(positions(frame, fields), expected, atol=2e-5)


def test_orientations_are_kept_to_a_thousandth():
    world = jfpx.World("capsules")
    world.run(60)
    fields, frames = content(world.view().to_html())
    size = fields["bodies"]
    turns = np.frombuffer(bytes(frames[0]), "<i2", 4 * size, 12 * size).reshape(size, 4)[:, [3, 0, 1, 2]] / 32767
    np.testing.assert_allclose(turns, world.states().orientations, atol=1e-3)


def test_an_update_moves_bodies_and_shows_added_and_removed_ones():
    world = jfpx.World("pile")
    view = world.view()
    before = content(view.to_html())[1]
    world.run(10)
    fields, after = content(view.to_html())
    assert after.shape == before.shape and (after != before).any()
    world.add({"shape": {"type": "cone", "radius": 1, "half_height": 1}, "position": [0, 50, 0]})
    world.remove(world.bodies[-2])
    more, frames = content(view.to_html())
    assert more["bodies"] == fields["bodies"] and len(more["groups"]) == len(fields["groups"]) + 1
    np.testing.assert_allclose(positions(frames[0], more)[-1], [0, 50, 0], atol=1e-4)


def test_a_scene_is_shown_as_it_was_when_the_view_was_made():
    scene = jfpx.Scene({"bodies": []})
    scene.add_spheres([[0.0, 0, 0]], 1)
    view = scene.view()
    scene.add_spheres([[3.0, 0, 0]], 1)
    assert content(view.to_html())[0]["bodies"] == 1


def test_an_empty_scene_has_a_picture():
    fields, frames = content(jfpx.Scene().view().to_html())
    assert fields["groups"] == [] and frames.size == 0


@pytest.mark.parametrize("call, message", [
    (lambda scene: scene.view([]), "states is empty"),
    (lambda scene: scene.view(np.zeros((1, 3))), "an array must be (frames, bodies, 3)"),
    (lambda scene: scene.view(3), "states is of type int"),
    (lambda scene: scene.view(np.zeros((2, 4, 3))), "positions of frame 0 has 4 rows; the scene has 1 bodies"),
    (lambda scene: scene.view(interval=0), "interval is 0; it must be finite and > 0"),
    (lambda scene: scene.view(height=10), "height"),
    (lambda scene: scene.view().follow().__enter__(), "the view is not that of a world"),
])
def test_errors_name_the_argument(call, message):
    with pytest.raises(jfpx.InvalidArgument) as error:
        call(one_body({"type": "sphere", "radius": 1}))
    assert message in str(error.value)


def test_a_file_that_cannot_be_written_is_an_error(tmp_path):
    with pytest.raises(jfpx.FileError, match="no_folder"):
        jfpx.Scene().view().save(tmp_path / "no_folder" / "scene.html")


@pytest.mark.skipif(not hasattr(signal, "SIGXFSZ"), reason="no limits of file sizes")
def test_a_full_disk_keeps_the_file_of_before(tmp_path):
    import resource

    path = tmp_path / "scene.html"
    path.write_text("before")
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    try:
        resource.setrlimit(resource.RLIMIT_FSIZE, (1000, limits[1]))
        with pytest.raises(jfpx.FileError, match="too large"):
            jfpx.Scene().view().save(path)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        signal.signal(signal.SIGXFSZ, handler)
    assert path.read_text() == "before"
    assert [entry.name for entry in tmp_path.iterdir()] == ["scene.html"]


def test_without_anywidget_the_error_names_the_command():
    program = """
import sys
sys.modules["anywidget"] = None
import jfpx
view = jfpx.World("pile").view()
bundle = view._repr_mimebundle_()
assert "iframe" in bundle["text/html"] and "pip install anywidget" in bundle["text/html"]
try:
    with view.follow():
        pass
except ImportError as error:
    print(error)
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert "needs the package anywidget: pip install anywidget" in done.stdout, done.stderr


def test_a_widget_follows_the_steps_of_a_world():
    pytest.importorskip("anywidget", reason="anywidget is not installed; scripts/setup python installs it")
    world = jfpx.World("pile")
    view = world.view(height=300)
    widget = view.widget
    assert view._repr_mimebundle_() is not None and widget is view.widget and widget.height == 300
    shown = []
    widget.observe(lambda change: shown.append(change["new"]), "frame")
    with view.follow(speed=None, rate=1e9):
        world.step()
        world.run(2)
        calls = []
        world.run(2, after_step=calls.append)
    assert len(shown) == 5 and len(calls) == 2  # the last update changes nothing
    assert shown[-1] == view._blobs()[0]
    with view.follow(speed=None, rate=1e-9):
        world.run(5)
    assert len(shown) <= 7 and shown[-1] == view._blobs()[0]
    world.run(1)
    assert shown[-1] != view._blobs()[0]  # the view no longer follows
    scene = widget.scene
    world.add({"shape": {"type": "sphere", "radius": 1}})
    view.update()
    assert widget.scene != scene and len(widget.frame) == 21 * len(world)


def test_a_follower_waits_for_the_time_of_the_world(monkeypatch):
    pytest.importorskip("anywidget", reason="anywidget is not installed; scripts/setup python installs it")
    clock = [100.0]
    monkeypatch.setattr(jfpx._view.time, "monotonic", lambda: clock[0])
    monkeypatch.setattr(jfpx._view.time, "sleep", lambda seconds: clock.__setitem__(0, clock[0] + seconds))
    world = jfpx.World("pile")
    with world.view().follow(speed=0.5):
        world.run(30)
    assert clock[0] == pytest.approx(100 + 30 * world.scene.dt / 0.5)


CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")


@pytest.mark.skipif(CHROMIUM is None, reason="there is no chromium")
def test_a_browser_draws_the_page(tmp_path):
    """Every program is compiled, and the ball in the middle of the picture has a colour."""
    shapes = [{"type": "box", "half_extents": [1, 1, 1]}, {"type": "sphere", "radius": 1}]
    scene = jfpx.Scene({"bodies": [{"shape": shape, "position": [3 * i, 1, 0]} for i, shape in enumerate(shapes)] +
                        [{"shape": {"type": "half_space", "normal": [0, 1, 0], "offset": 0}, "mass": 0}]})
    scene.view(np.zeros((2, 3, 3))).save(tmp_path / "scene.html")
    for budget in (3000, 30000):  # on a busy machine, the first picture may take longer than the budget
        done = subprocess.run(
            [CHROMIUM, "--headless=new", "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader",
             "--enable-unsafe-swiftshader", f"--user-data-dir={tmp_path}/profile{budget}",
             f"--virtual-time-budget={budget}", "--dump-dom", f"file://{tmp_path}/scene.html"],
            capture_output=True, text=True, timeout=120)
        page = re.sub(r"<script.*?</script>", "", done.stdout, flags=re.DOTALL)
        assert "cannot be drawn" not in page, page
        is_drawn = re.search(r'data-drawn="[1-9]', page) is not None and "1/2" in page
        if is_drawn:
            break
    assert is_drawn, done.stderr[-2000:]

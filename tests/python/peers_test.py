"""The comparison with other engines, bench/peers."""

import pathlib
import subprocess
import sys

import numpy as np
import pytest

import jfpx

FOLDER = pathlib.Path(__file__).parents[2] / "bench/peers"
if not FOLDER.is_dir():
    pytest.skip("the source package has no bench/peers", allow_module_level=True)
sys.path.insert(0, str(FOLDER))
import quality  # noqa: E402
import scenes  # noqa: E402


@pytest.mark.parametrize("name, movable", [("balls", 4096), ("pyramid", 820), ("pit", 1728), ("hulls", 1000),
                                           ("ragdolls", 1100), ("terrain", 1000)])
def test_a_scene_of_the_comparison_begins_without_overlap(name, movable):
    scene = scenes.SCENES[name][0]()
    bodies = [body for body in scene["bodies"] if body["mass"] > 0]
    assert len(bodies) == movable
    states = [np.array([body[field] for body in bodies]) for field in ("position", "orientation")]
    states += [np.zeros((movable, 3))] * 2
    measures = quality.measures(name, scene, states)
    assert measures["deepest"] < 0.01 and measures["lost"] == 0 and measures.get("joints", 0) < 1e-6


def test_the_comparison_measures_overlaps():
    ball = {"type": "sphere", "radius": 0.5}
    scene = scenes.scene([scenes.solid(ball, (0, 5, 0)), scenes.solid(ball, (0.9, 5, 0))])
    states = [np.array([[0, 5, 0], [0.9, 5, 0]]), np.array([[1, 0, 0, 0]] * 2), np.zeros((2, 3)), np.zeros((2, 3))]
    assert quality.measures("", scene, states)["deepest"] == pytest.approx(100)


def test_the_volume_of_a_hull_is_that_of_a_box():
    corners = [(x, y, z) for x in (-1, 1) for y in (-2, 2) for z in (-3, 3)]
    inside = [(0.1, 0.2, 0.3)]
    # Hulls of random points have no four points in a plane.
    tilted = [np.array(p) * (1 + 1e-6 * i) for i, p in enumerate(corners)]
    assert scenes.hull_volume(tilted + inside) == pytest.approx(48, rel=1e-4)


def test_the_comparison_runs_jfpx():
    done = subprocess.run([sys.executable, FOLDER / "peers.py", "--engines", "jfpx", "--scenes", "ragdolls",
                           "--steps", "2", "--repeat", "1"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert f"| jfpx | {jfpx.__version__} |" in done.stdout
    assert done.stdout.count("| 100 figures of 11 capsules with ball joints |") == 2

"""The scripts of examples/python."""

import importlib.util
import os
import pathlib
import re
import signal
import subprocess
import sys
import threading
import time

import pytest

import jfpx

FOLDER = pathlib.Path(__file__).parents[2] / "examples/python"


def run(name, *arguments):
    done = subprocess.run([sys.executable, FOLDER / name, *arguments], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize("name, arguments, text", [
    ("force_chains.py", ["--grains", "120", "--steps", "500"], "carry 1.000 of the weight"),
    ("neighbours.py", [], "all numbers of threads give the same bits"),
    ("pile.py", ["--spheres", "200", "--steps", "60"], "one thread of the CPU gives the same bits"),
    ("replay.py", [], "240 steps were repeated bit by bit\na change of 1 um/s is seen in step 1;"),
])
def test_an_example_runs_and_draws_its_picture(tmp_path, name, arguments, text):
    picture = tmp_path / "picture.png"
    if importlib.util.find_spec("matplotlib"):
        arguments = [*arguments, "--picture", picture]
    assert text in run(name, *arguments)
    if "--picture" in arguments:
        assert picture.read_bytes().startswith(b"\x89PNG")


def test_a_run_is_saved_as_a_page(tmp_path):
    page = tmp_path / "run.html"
    assert "161 bodies, 11 frames>" in run("view.py", "--steps", "20", "--save", page)
    assert page.read_text().startswith("<!DOCTYPE html>")


def test_a_drum_keeps_its_bodies(tmp_path):
    file = tmp_path / "drum.json"
    text = run("drum.py", "--bodies", "60", "--steps", "90", "--save", file)
    assert "after 90 steps; bodies that left the drum: 0" in text
    assert len(jfpx.World(jfpx.Scene.load(file))) == 63


def test_forces_by_torch_are_the_differences_of_the_energy():
    pytest.importorskip("torch")
    assert "forces are the differences of the energy\npressure without motion: " in run("lennard_jones.py")


def test_the_pile_has_the_same_bits_on_a_gpu():
    cuda = next(row for row in jfpx.available_backends() if row["backend"] == "cuda")
    if not cuda["usable"]:
        (pytest.fail if os.environ.get("JFPX_REQUIRE_CUDA") else pytest.skip)(cuda["reason"])
    assert "one thread of the CPU gives the same bits" in run("pile.py", "--backend", "cuda")


def sweep():
    spec = importlib.util.spec_from_file_location("sweep", FOLDER / "sweep.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_a_sweep_on_many_workers_has_the_hashes_of_a_serial_run():
    pytest.importorskip("distributed")
    lines = run("sweep.py", "--scenes", "200", "--steps", "10", "--workers", "2").splitlines()
    assert lines == run("sweep.py", "--scenes", "200", "--steps", "10", "--serial").splitlines()
    assert len(lines) == 200 and all(re.fullmatch(r" *\d+ [0-9a-f]{16}", line) for line in lines)
    assert len({line.split()[1] for line in lines}) == 200


def processes(client):
    """Process ids of the workers, once the scheduler has noticed that a worker is lost."""
    for _ in range(100):
        try:
            return list(client.run(os.getpid).values())
        except OSError:
            time.sleep(0.1)
    raise AssertionError("the scheduler does not answer")


def test_a_sweep_that_loses_a_worker_has_the_same_hashes(monkeypatch):
    distributed = pytest.importorskip("distributed")
    monkeypatch.syspath_prepend(FOLDER)
    module = sweep()
    monkeypatch.setitem(sys.modules, "sweep", module)
    inherited = os.pathsep.join([str(FOLDER), *sys.path])
    monkeypatch.setenv("PYTHONPATH", inherited)  # of the workers
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        with distributed.Client(cluster) as client:
            victim = next(iter(client.run(os.getpid).values()))
            killer = threading.Timer(0.2, os.kill, (victim, signal.SIGKILL))
            killer.start()
            hashes = module.gather(client, 60, 200)
            killer.join()
            alive = processes(client)
    assert hashes == module.run_serially(60, 200)
    assert victim not in alive

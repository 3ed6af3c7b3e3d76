"""A short test of an installed package, which needs NumPy alone: python tests/python/wheel.py [--cuda ON|OFF]

scripts/wheels, cibuildwheel and the conda recipe run it for each package that they build. It tests what a package can do
wrong: files, symbols and instructions that are missing, results with other bits, and an unusable GPU backend.
With --cuda, the package must have been built with the GPU backend, or without it. No GPU is needed for either.
"""
import argparse
import importlib.metadata
import pathlib
import platform
import re
import sys

import numpy as np

import jfpx

ROOT = pathlib.Path(__file__).resolve().parents[2]


def check(condition, message):
    if not condition:
        sys.exit(f"wheel.py: {message}")


def listed_hashes():
    """Hashes of a pile of 600 spheres after 300 steps in docs/conformance.md, in float and double."""
    text = (ROOT / "docs/conformance.md").read_text()
    row = re.search(r"^\| `pile --spheres 600` \| `(\w+)` \| `(\w+)` \|$", text, re.MULTILINE)
    check(row, "docs/conformance.md has no line `pile --spheres 600`")
    return dict(zip(("float32", "float64"), row.groups()))


def check_files():
    folder = pathlib.Path(jfpx.__file__).resolve().parent
    check(ROOT not in folder.parents or "site-packages" in folder.parts,
          f"jfpx was imported from the sources, {folder}; run in an environment where it is installed")
    check(importlib.metadata.version("jfpx") == jfpx.__version__, "two versions in one package")
    names = {path.relative_to(folder).as_posix() for path in folder.rglob("*")}
    for name in ("py.typed", "_core/__init__.pyi", "_core/f32.pyi", "_core/f64.pyi"):
        check(name in names, f"{folder} has no {name}")
    files = importlib.metadata.files("jfpx")
    check(any(path.name == "LICENSE" for path in files), "the package has no licence")


def check_pairs(dtype):
    """All pairs, against a comparison of each point with each other one."""
    positions = np.random.default_rng(1).random((500, 3)).astype(dtype)
    distances = np.linalg.norm(positions[:, None] - positions[None], axis=-1)
    cutoff = 0.1
    check(np.abs(distances - cutoff).min() > 1e-7, "points at the cutoff make this test meaningless")
    expected = np.stack(np.nonzero(np.triu(distances <= cutoff, 1)))
    for threads in (1, 3):
        pairs = jfpx.find_pairs(positions, cutoff, threads=threads)
        check(np.array_equal(pairs, expected) and expected.shape[1] > 100, f"other pairs in {dtype}")


def check_world(dtype, backend, expected):
    scene = jfpx.Scene.named("pile", spheres=600, dtype=dtype)
    with jfpx.World(scene, backend=backend) as world:
        world.step()
        world.run(299)
        actual = f"{world.state_hash():016x}"
    check(actual == expected, f"a pile in {dtype} on {backend} has hash {actual}; it must be {expected}")


def check_cuda(status, wanted, hashes):
    """The GPU backend works, or gives a reason."""
    compiled = "ON" if status["compiled"] else "OFF"
    check(wanted in (None, compiled), f"the package has CUDA {compiled}; it must be {wanted}")
    if status["usable"]:
        for dtype, expected in hashes.items():
            check_world(dtype, "cuda", expected)
        return f"usable, {status['device']}"
    reason = status["reason"]
    check(reason and (reason == "built without CUDA") == (compiled == "OFF"), f"the reason is {reason!r}")
    for dtype in hashes:
        try:
            jfpx.World("pile", backend="cuda", dtype=dtype)
        except jfpx.BackendUnavailable as error:
            check(str(error) == f"cuda: {reason}", f"the error is {error}; the reason is {reason}")
        else:
            check(False, "a world on a backend that is not usable")
    return f"not usable, {reason}"


def main():
    parser = argparse.ArgumentParser(description="Tests an installed jfpx.")
    parser.add_argument("--cuda", choices=["ON", "OFF"], help="whether it must have the GPU backend")
    options = parser.parse_args()
    check_files()
    hashes = listed_hashes()
    for dtype, expected in hashes.items():
        check_pairs(dtype)
        for backend in ("cpu", "auto"):
            check_world(dtype, backend, expected)
    cpu, cuda = jfpx.available_backends()
    check(cpu["usable"], f"the CPU is not usable: {cpu['reason']}")
    state = check_cuda(cuda, options.cuda, hashes)
    print(f"wheel.py: passed: jfpx {jfpx.__version__}, Python {platform.python_version()}, "
          f"NumPy {np.__version__}, cuda: {state}")


if __name__ == "__main__":
    main()

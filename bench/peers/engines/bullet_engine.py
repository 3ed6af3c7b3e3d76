"""Stock Bullet, through bullet.cpp beside this file, which is compiled with the installed Bullet
(libbullet-dev of Debian) into a folder for temporary files."""

import ctypes as c
import pathlib
import subprocess
import tempfile

import numpy as np

from . import Unavailable, movable


def run(*command):
    try:
        return subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError) as error:
        raise Unavailable(f"libbullet-dev, pkg-config and c++: {getattr(error, 'stderr', '') or error}") from error


def library():
    version = run("pkg-config", "--modversion", "bullet")
    source = pathlib.Path(__file__).with_name("bullet.cpp")
    built = pathlib.Path(tempfile.gettempdir()) / f"jfpx-peers-bullet-{version}-{source.stat().st_mtime_ns}.so"
    if not built.exists():
        flags = run("pkg-config", "--cflags", "--libs", "bullet").split()
        part = built.with_suffix(".part")
        run("c++", "-std=c++17", "-O3", "-DNDEBUG", "-shared", "-fPIC", str(source), "-o", str(part), *flags)
        part.rename(built)
    lib = c.CDLL(str(built))
    lib.peer_create.restype = c.c_void_p
    return lib


def array(values):
    values = np.ascontiguousarray(values, np.float32)
    return values, values.ctypes.data_as(c.c_void_p)


class World:
    name = "Bullet"
    settings = "float; 10 iterations (default)"
    threaded = False

    @staticmethod
    def version():
        library()
        return run("pkg-config", "--modversion", "bullet")

    def __init__(self, scene):
        self.lib = lib = library()
        self.world = c.c_void_p(lib.peer_create())
        self.count = len(movable(scene))
        for body in scene["bodies"]:
            pose, pose_data = array([*body["position"], *body["orientation"]])
            size, size_data = self.size(body["shape"])
            triangles = np.ascontiguousarray(body["shape"].get("triangles", []), np.int32)
            kind = ("sphere", "box", "capsule", "hull", "triangle_mesh").index(body["shape"]["type"])
            # Bullet multiplies the coefficients of two bodies.
            lib.peer_add(self.world, kind, size_data, size.size // 3, triangles.ctypes.data_as(c.c_void_p),
                         triangles.size // 3, pose_data, c.c_float(body["mass"]), c.c_float(body["friction"] ** 0.5))
        for joint in scene["joints"]:
            anchors, anchor_data = array([joint["anchor_a"], joint["anchor_b"]])
            lib.peer_join(self.world, joint["a"], joint["b"], anchor_data)

    @staticmethod
    def size(shape):
        kind = shape["type"]
        if kind == "sphere":
            return array([shape["radius"], 0, 0])
        if kind == "box":
            return array(shape["half_extents"])
        if kind == "capsule":
            return array([shape["radius"], 2 * shape["half_height"], 0])
        return array(shape["vertices"])

    def step(self):
        self.lib.peer_step(self.world)

    def states(self):
        states, data = array(np.empty((self.count, 13)))
        self.lib.peer_states(self.world, data)
        return states[:, :3], states[:, 3:7], states[:, 7:10], states[:, 10:]

"""One module for each engine, with a class `World`:

    World.name                      as in the table
    World.version()                 text, or raises Unavailable
    World.settings                  text
    World.threaded                  whether a step may use several threads
    World(scene)                    a scene of jfpx as a dict, stepped by one thread
    World(scene, threads)           likewise, if threaded
    world.step()                    a step of 1/60 s
    world.states()                  positions (N, 3), orientations (N, 4) as w, x, y, z, velocities (N, 3),
                                    angular velocities (N, 3) of the movable bodies, in the order of the scene
"""

import importlib

NAMES = ("jfpx", "box3d", "jolt", "rapier", "bullet", "mujoco")


class Unavailable(Exception):
    """The engine is not installed. The text says what is missing."""


def load(name):
    return importlib.import_module(f"engines.{name}_engine").World


def movable(scene):
    return [i for i, body in enumerate(scene["bodies"]) if body["mass"] > 0]

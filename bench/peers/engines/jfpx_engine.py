"""jfpx, through its Python module."""

import numpy as np

from . import Unavailable, movable


class World:
    name = "jfpx"
    settings = "float; 4 substeps"
    threaded = True

    @staticmethod
    def version():
        try:
            import jfpx
        except ImportError as error:
            raise Unavailable(f"the Python module of jfpx: {error}") from error
        return jfpx.__version__

    def __init__(self, scene, threads=1):
        import jfpx
        self.world = jfpx.World(jfpx.Scene(scene), threads=threads, backend="cpu")
        self.rows = movable(scene)

    def step(self):
        self.world.step()

    def states(self):
        s = self.world.states()
        columns = (s.positions, s.orientations, s.velocities, s.angular_velocities)
        return tuple(np.array(column)[self.rows] for column in columns)

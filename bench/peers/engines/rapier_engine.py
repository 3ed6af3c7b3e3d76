"""Rapier, through the package rapier3d of PyPI."""

import importlib.metadata

import numpy as np

from . import Unavailable, movable


class World:
    name = "Rapier"
    settings = "float; 4 solver iterations (default)"
    threaded = True

    @staticmethod
    def version():
        try:
            return importlib.metadata.version("rapier3d")
        except importlib.metadata.PackageNotFoundError as error:
            raise Unavailable("the package rapier3d") from error

    def __init__(self, scene, threads=1):
        import rapier3d
        self.world = rapier3d.PhysicsWorld(gravity=(0.0, -9.81, 0.0))
        self.world.set_num_threads(threads)
        self.world.integration_parameters.dt = scene["dt"]
        handles = []
        for body in scene["bodies"]:
            kind = rapier3d.RigidBody.dynamic() if body["mass"] > 0 else rapier3d.RigidBody.fixed()
            w, x, y, z = body["orientation"]
            turn = rapier3d.Rotation3.from_quaternion(w, x, y, z)
            kind = (kind.translation(rapier3d.Vec3(*body["position"])).rotation(turn.scaled_axis)
                    .can_sleep(False))
            collider = self.collider(rapier3d, body["shape"]).friction(body["friction"]).restitution(0.0)
            if body["mass"] > 0:
                collider = collider.mass(body["mass"])
            handles.append(self.world.add_body(kind, [collider]))
        for joint in scene["joints"]:
            ball = (rapier3d.SphericalJointBuilder().local_anchor1(joint["anchor_a"]).local_anchor2(joint["anchor_b"])
                    .contacts_enabled(False).build())
            self.world.impulse_joints.insert(handles[joint["a"]], handles[joint["b"]], ball)
        self.handles = [handles[i] for i in movable(scene)]

    @staticmethod
    def collider(rapier3d, shape):
        kind = shape["type"]
        if kind == "sphere":
            return rapier3d.Collider.ball(shape["radius"])
        if kind == "box":
            return rapier3d.Collider.cuboid(*shape["half_extents"])
        if kind == "capsule":
            return rapier3d.Collider.capsule_y(shape["half_height"], shape["radius"])
        if kind == "hull":
            return rapier3d.Collider.convex_hull(np.array(shape["vertices"], np.float32))
        return rapier3d.Collider.trimesh(np.array(shape["vertices"], np.float32),
                                         np.array(shape["triangles"], np.uint32),
                                         rapier3d.TriMeshFlags.FIX_INTERNAL_EDGES)

    def step(self):
        self.world.step()

    def states(self):
        bodies = [self.world.rigid_bodies[handle] for handle in self.handles]
        vector = lambda v: (v.x, v.y, v.z)  # noqa: E731
        turn = lambda q: (q.w, q.i, q.j, q.k)  # noqa: E731
        return (np.array([vector(b.translation) for b in bodies]),
                np.array([turn(b.rotation) for b in bodies]),
                np.array([vector(b.linvel) for b in bodies]), np.array([vector(b.angvel) for b in bodies]))

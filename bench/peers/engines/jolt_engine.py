"""Jolt Physics, through joltc, a C interface to it: JOLTC_LIBRARY is the path of its shared library."""

import ctypes as c
import os

import numpy as np

from . import Unavailable, movable

STATIC, MOVING = 0, 1
NO_GROUP = 0xFFFFFFFF


class Vec3(c.Structure):
    _fields_ = [("x", c.c_float), ("y", c.c_float), ("z", c.c_float)]


class Quat(c.Structure):
    _fields_ = [("x", c.c_float), ("y", c.c_float), ("z", c.c_float), ("w", c.c_float)]


class SystemSettings(c.Structure):
    _fields_ = [("max_bodies", c.c_uint32), ("body_mutexes", c.c_uint32), ("max_body_pairs", c.c_uint32),
                ("max_contacts", c.c_uint32), ("padding", c.c_uint32), ("layers", c.c_void_p),
                ("pair_filter", c.c_void_p), ("broad_phase_filter", c.c_void_p)]


class CollisionGroup(c.Structure):
    _fields_ = [("filter", c.c_void_p), ("group", c.c_uint32), ("sub_group", c.c_uint32)]


class PointConstraint(c.Structure):
    _fields_ = [("enabled", c.c_bool), ("priority", c.c_uint32), ("velocity_steps", c.c_uint32),
                ("position_steps", c.c_uint32), ("draw_size", c.c_float), ("user_data", c.c_uint64),
                ("space", c.c_int), ("point_1", Vec3), ("point_2", Vec3)]


Job = c.CFUNCTYPE(None, c.c_void_p)
Queue = c.CFUNCTYPE(None, c.c_void_p, c.c_void_p, c.c_void_p)
QueueAll = c.CFUNCTYPE(None, c.c_void_p, c.c_void_p, c.POINTER(c.c_void_p), c.c_uint32)


@Queue
def run_job(_, job, argument):
    Job(job)(argument)


@QueueAll
def run_jobs(_, job, arguments, count):
    for argument in arguments[:count]:
        Job(job)(argument)


class Jobs(c.Structure):
    """A job system that runs each job at once, in the thread of the caller."""
    _fields_ = [("context", c.c_void_p), ("queue", Queue), ("queue_all", QueueAll),
                ("max_concurrency", c.c_uint32), ("max_barriers", c.c_uint32)]


class Pool(c.Structure):
    """A job system with threads besides that of the caller."""
    _fields_ = [("max_jobs", c.c_uint32), ("max_barriers", c.c_uint32), ("threads", c.c_int32)]


POINTERS = """BroadPhaseLayerInterfaceTable_Create ObjectLayerPairFilterTable_Create
ObjectVsBroadPhaseLayerFilterTable_Create PhysicsSystem_Create PhysicsSystem_GetBodyInterface
JobSystemCallback_Create JobSystemThreadPool_Create BoxShape_Create SphereShape_Create CapsuleShape_Create
ConvexHullShapeSettings_Create ConvexHullShapeSettings_CreateShape MeshShapeSettings_Create2
MeshShapeSettings_CreateShape BodyCreationSettings_Create3 BodyInterface_CreateBody GroupFilterTable_Create
PointConstraint_Create""".split()


def library():
    path = os.environ.get("JOLTC_LIBRARY")
    if not path:
        raise Unavailable("JOLTC_LIBRARY, the path of a shared library of joltc")
    try:
        lib = c.CDLL(path)
        for name in POINTERS:
            getattr(lib, "JPH_" + name).restype = c.c_void_p
        lib.JPH_Init.restype = c.c_bool
        lib.JPH_Body_GetID.restype = c.c_uint32
    except (OSError, AttributeError) as error:
        raise Unavailable(f"a usable JOLTC_LIBRARY: {error}") from error
    return lib


def pointer(value):
    return c.c_void_p(value)


class World:
    name = "Jolt"
    settings = "float; 10 velocity and 2 position steps (default)"
    threaded = True

    @staticmethod
    def version():
        library()
        return ""  # joltc does not tell it

    def __init__(self, scene, threads=1):
        self.lib = lib = library()
        lib.JPH_Init()
        layers = pointer(lib.JPH_BroadPhaseLayerInterfaceTable_Create(2, 2))
        pairs = pointer(lib.JPH_ObjectLayerPairFilterTable_Create(2))
        for layer in (STATIC, MOVING):
            lib.JPH_BroadPhaseLayerInterfaceTable_MapObjectToBroadPhaseLayer(layers, layer, c.c_uint8(layer))
            lib.JPH_ObjectLayerPairFilterTable_EnableCollision(pairs, MOVING, layer)
        broad = pointer(lib.JPH_ObjectVsBroadPhaseLayerFilterTable_Create(layers, 2, pairs, 2))
        settings = SystemSettings(10240, 0, 131072, 65536, 0, layers, pairs, broad)
        self.system = pointer(lib.JPH_PhysicsSystem_Create(c.byref(settings)))
        lib.JPH_PhysicsSystem_SetGravity(self.system, c.byref(Vec3(0, -9.81, 0)))
        # The pool of joltc has at least one thread besides that of the caller.
        self.jobs = pointer(lib.JPH_JobSystemThreadPool_Create(c.byref(Pool(2048, 8, threads - 1))) if threads > 1
                            else lib.JPH_JobSystemCallback_Create(c.byref(Jobs(None, run_job, run_jobs, 1, 8))))
        self.interface = pointer(lib.JPH_PhysicsSystem_GetBodyInterface(self.system))
        self.dt, self.shapes = c.c_float(scene["dt"]), {}
        groups = self.groups(scene)
        bodies = [self.body(body, groups.get(i)) for i, body in enumerate(scene["bodies"])]
        for joint in scene["joints"]:
            definition = PointConstraint()
            lib.JPH_PointConstraintSettings_Init(c.byref(definition))
            definition.space = 0  # relative to the centres of mass
            definition.point_1, definition.point_2 = Vec3(*joint["anchor_a"]), Vec3(*joint["anchor_b"])
            constraint = lib.JPH_PointConstraint_Create(c.byref(definition), bodies[joint["a"]], bodies[joint["b"]])
            lib.JPH_PhysicsSystem_AddConstraint(self.system, pointer(constraint))
        ids = [lib.JPH_Body_GetID(body) for body in bodies]
        for i in ids:
            lib.JPH_BodyInterface_AddBody(self.interface, i, 0)
        lib.JPH_PhysicsSystem_OptimizeBroadPhase(self.system)
        self.ids = [ids[i] for i in movable(scene)]

    def groups(self, scene):
        """Collision groups in which the bodies of a joint do not collide: one for each tree of joints."""
        if not scene["joints"]:
            return {}
        root = {}
        for joint in scene["joints"]:  # parents come first
            root[joint["a"]] = root.setdefault(joint["b"], joint["b"])
        members = {}
        for body, first in sorted(root.items()):
            members.setdefault(first, []).append(body)
        groups = {}
        for number, bodies in enumerate(members.values()):
            table = pointer(self.lib.JPH_GroupFilterTable_Create(len(bodies)))
            for sub_group, body in enumerate(bodies):
                groups[body] = CollisionGroup(table, number, sub_group)
        for joint in scene["joints"]:
            a, b = groups[joint["a"]], groups[joint["b"]]
            self.lib.JPH_GroupFilterTable_DisableCollision(pointer(a.filter), a.sub_group, b.sub_group)
        return groups

    def body(self, body, group):
        lib, moves = self.lib, body["mass"] > 0
        w, x, y, z = body["orientation"]
        settings = pointer(lib.JPH_BodyCreationSettings_Create3(
            self.shape(body["shape"]), c.byref(Vec3(*body["position"])), c.byref(Quat(x, y, z, w)),
            2 if moves else 0, MOVING if moves else STATIC))
        for name, value in (("Friction", body["friction"]), ("Restitution", 0), ("LinearDamping", 0),
                            ("AngularDamping", 0)):
            getattr(lib, "JPH_BodyCreationSettings_Set" + name)(settings, c.c_float(value))
        lib.JPH_BodyCreationSettings_SetAllowSleeping(settings, c.c_bool(False))
        if group is not None:
            lib.JPH_BodyCreationSettings_SetCollisionGroup(settings, c.byref(group))
        return pointer(lib.JPH_BodyInterface_CreateBody(self.interface, settings))

    def shape(self, shape):
        key = id(shape)
        if key not in self.shapes:
            self.shapes[key] = pointer(self.make_shape(shape))
        return self.shapes[key]

    def make_shape(self, shape):
        lib, kind = self.lib, shape["type"]
        if kind == "sphere":
            return lib.JPH_SphereShape_Create(c.c_float(shape["radius"]))
        if kind == "box":
            return lib.JPH_BoxShape_Create(c.byref(Vec3(*shape["half_extents"])), c.c_float(0.05))
        if kind == "capsule":
            return lib.JPH_CapsuleShape_Create(c.c_float(shape["half_height"]), c.c_float(shape["radius"]))
        vertices = np.array(shape["vertices"], np.float32)
        points = vertices.ctypes.data_as(c.c_void_p)
        if kind == "hull":
            settings = lib.JPH_ConvexHullShapeSettings_Create(points, len(vertices), c.c_float(0.05))
            return lib.JPH_ConvexHullShapeSettings_CreateShape(pointer(settings))
        triangles = np.zeros((len(shape["triangles"]), 5), np.uint32)
        triangles[:, :3] = shape["triangles"]
        settings = lib.JPH_MeshShapeSettings_Create2(points, len(vertices), triangles.ctypes.data_as(c.c_void_p),
                                                     len(triangles))
        return lib.JPH_MeshShapeSettings_CreateShape(pointer(settings))

    def step(self):
        error = self.lib.JPH_PhysicsSystem_Update(self.system, self.dt, 1, self.jobs)
        if error:
            raise RuntimeError(f"Jolt: a buffer is full (error {error})")

    def states(self):
        result = np.empty((len(self.ids), 13), np.float32)
        p, q, v, spin = Vec3(), Quat(), Vec3(), Vec3()
        for row, i in zip(result, self.ids):
            self.lib.JPH_BodyInterface_GetPositionAndRotation(self.interface, i, c.byref(p), c.byref(q))
            self.lib.JPH_BodyInterface_GetLinearAndAngularVelocity(self.interface, i, c.byref(v), c.byref(spin))
            row[:] = (p.x, p.y, p.z, q.w, q.x, q.y, q.z, v.x, v.y, v.z, spin.x, spin.y, spin.z)
        return result[:, :3], result[:, 3:7], result[:, 7:10], result[:, 10:]

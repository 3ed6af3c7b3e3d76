"""Box3D, through its C interface in a shared library: BOX3D_LIBRARY is its path.

The structures are those of types.h and collision.h of version 0.1, in single precision."""

import ctypes as c
import os

import numpy as np

from . import Unavailable, movable

COOKIE = 1152023  # of a valid definition: shows that the structures below have the layout of the library


class Vec3(c.Structure):
    _fields_ = [("x", c.c_float), ("y", c.c_float), ("z", c.c_float)]


class Quat(c.Structure):
    _fields_ = [("v", Vec3), ("s", c.c_float)]


class Transform(c.Structure):
    _fields_ = [("p", Vec3), ("q", Quat)]


class WorldId(c.Structure):
    _fields_ = [("index", c.c_uint16), ("generation", c.c_uint16)]


class Id(c.Structure):
    _fields_ = [("index", c.c_int32), ("world", c.c_uint16), ("generation", c.c_uint16)]


class WorldDef(c.Structure):
    _fields_ = [("gravity", Vec3), ("restitution_threshold", c.c_float), ("hit_event_threshold", c.c_float),
                ("contact_hertz", c.c_float), ("contact_damping_ratio", c.c_float), ("contact_speed", c.c_float),
                ("maximum_linear_speed", c.c_float), ("friction_callback", c.c_void_p),
                ("restitution_callback", c.c_void_p), ("enable_sleep", c.c_bool), ("enable_continuous", c.c_bool),
                ("worker_count", c.c_uint32), ("pointers", c.c_void_p * 7), ("capacity", c.c_int * 5),
                ("cookie", c.c_int)]


class BodyDef(c.Structure):
    _fields_ = [("type", c.c_int), ("position", Vec3), ("rotation", Quat), ("linear_velocity", Vec3),
                ("angular_velocity", Vec3), ("linear_damping", c.c_float), ("angular_damping", c.c_float),
                ("gravity_scale", c.c_float), ("sleep_threshold", c.c_float), ("name", c.c_char_p),
                ("user_data", c.c_void_p), ("motion_locks", c.c_bool * 6), ("enable_sleep", c.c_bool),
                ("flags", c.c_bool * 5), ("cookie", c.c_int)]


class Material(c.Structure):
    _fields_ = [("friction", c.c_float), ("restitution", c.c_float), ("rolling_resistance", c.c_float),
                ("tangent_velocity", Vec3), ("id", c.c_uint64), ("color", c.c_uint32), ("padding", c.c_uint32)]


class Filter(c.Structure):
    _fields_ = [("category", c.c_uint64), ("mask", c.c_uint64), ("group", c.c_int)]


class ShapeDef(c.Structure):
    _fields_ = [("name", c.c_char_p), ("user_data", c.c_void_p), ("materials", c.c_void_p),
                ("material_count", c.c_int), ("material", Material), ("density", c.c_float),
                ("explosion_scale", c.c_float), ("filter", Filter), ("flags", c.c_bool * 9), ("cookie", c.c_int)]


class JointDef(c.Structure):
    _fields_ = [("user_data", c.c_void_p), ("a", Id), ("b", Id), ("frame_a", Transform), ("frame_b", Transform),
                ("thresholds", c.c_float * 2), ("hertz", c.c_float), ("damping_ratio", c.c_float),
                ("draw_scale", c.c_float), ("collide_connected", c.c_bool), ("cookie", c.c_int)]


class SphericalJointDef(c.Structure):
    _fields_ = [("base", JointDef), ("enable_spring", c.c_bool), ("hertz", c.c_float), ("damping_ratio", c.c_float),
                ("target", Quat), ("enable_cone", c.c_bool), ("cone", c.c_float), ("enable_twist", c.c_bool),
                ("twist", c.c_float * 2), ("enable_motor", c.c_bool), ("motor_torque", c.c_float),
                ("motor_velocity", Vec3)]


class Sphere(c.Structure):
    _fields_ = [("center", Vec3), ("radius", c.c_float)]


class Capsule(c.Structure):
    _fields_ = [("a", Vec3), ("b", Vec3), ("radius", c.c_float)]


class BoxHull(c.Structure):
    _fields_ = [("opaque", c.c_uint64 * 512)]  # larger than the actual one


class MeshDef(c.Structure):
    _fields_ = [("vertices", c.c_void_p), ("indices", c.c_void_p), ("materials", c.c_void_p),
                ("weld_tolerance", c.c_float), ("vertex_count", c.c_int), ("triangle_count", c.c_int),
                ("weld", c.c_bool), ("median_split", c.c_bool), ("identify_edges", c.c_bool)]


class Version(c.Structure):
    _fields_ = [("major", c.c_int), ("minor", c.c_int), ("revision", c.c_int)]


RESULTS = {
    "b3GetVersion": Version, "b3IsDoublePrecision": c.c_bool, "b3DefaultWorldDef": WorldDef,
    "b3DefaultBodyDef": BodyDef, "b3DefaultShapeDef": ShapeDef, "b3DefaultSphericalJointDef": SphericalJointDef,
    "b3CreateWorld": WorldId, "b3CreateBody": Id, "b3CreateSphericalJoint": Id, "b3CreateSphereShape": Id,
    "b3CreateCapsuleShape": Id, "b3CreateHullShape": Id, "b3CreateMeshShape": Id, "b3MakeBoxHull": BoxHull,
    "b3CreateHull": c.c_void_p, "b3CreateMesh": c.c_void_p, "b3Body_GetPosition": Vec3, "b3Body_GetRotation": Quat,
    "b3Body_GetLinearVelocity": Vec3, "b3Body_GetAngularVelocity": Vec3, "b3World_Step": None,
    "b3World_EnableSleeping": None,
}


def library():
    path = os.environ.get("BOX3D_LIBRARY")
    if not path:
        raise Unavailable("BOX3D_LIBRARY, the path of a shared library of Box3D")
    try:
        lib = c.CDLL(path)
        for name, result in RESULTS.items():
            getattr(lib, name).restype = result
    except (OSError, AttributeError) as error:
        raise Unavailable(f"a usable BOX3D_LIBRARY: {error}") from error
    definitions = (lib.b3DefaultWorldDef(), lib.b3DefaultBodyDef(), lib.b3DefaultShapeDef(),
                   lib.b3DefaultSphericalJointDef().base)
    if lib.b3IsDoublePrecision() or any(definition.cookie != COOKIE for definition in definitions):
        raise Unavailable("a BOX3D_LIBRARY in single precision of a version with the structures of 0.1")
    return lib


class World:
    name = "Box3D"
    settings = "float; 4 substeps"
    threaded = True

    @staticmethod
    def version():
        v = library().b3GetVersion()
        return f"{v.major}.{v.minor}.{v.revision}"

    def __init__(self, scene, threads=1):
        self.lib = lib = library()
        definition = lib.b3DefaultWorldDef()
        definition.gravity, definition.worker_count = Vec3(0, -9.81, 0), threads
        self.world = lib.b3CreateWorld(c.byref(definition))
        lib.b3World_EnableSleeping(self.world, c.c_bool(False))
        self.dt, self.hulls, self.bodies = c.c_float(scene["dt"]), {}, []
        for body in scene["bodies"]:
            definition = lib.b3DefaultBodyDef()
            definition.type = 2 if body["mass"] > 0 else 0
            definition.position = Vec3(*body["position"])
            w, x, y, z = body["orientation"]
            definition.rotation = Quat(Vec3(x, y, z), w)
            definition.enable_sleep = False
            self.bodies.append(lib.b3CreateBody(self.world, c.byref(definition)))
            shape = lib.b3DefaultShapeDef()
            shape.density = 1000
            shape.material.friction, shape.material.restitution = body["friction"], 0
            self.add(self.bodies[-1], shape, body["shape"])
        for joint in scene["joints"]:
            definition = lib.b3DefaultSphericalJointDef()
            base = definition.base
            base.a, base.b = self.bodies[joint["a"]], self.bodies[joint["b"]]
            base.frame_a.p, base.frame_b.p = Vec3(*joint["anchor_a"]), Vec3(*joint["anchor_b"])
            lib.b3CreateSphericalJoint(self.world, c.byref(definition))
        self.bodies = [self.bodies[i] for i in movable(scene)]

    def add(self, body, definition, shape):
        lib, kind, definition = self.lib, shape["type"], c.byref(definition)
        if kind == "sphere":
            lib.b3CreateSphereShape(body, definition, c.byref(Sphere(Vec3(), shape["radius"])))
        elif kind == "capsule":
            h = shape["half_height"]
            lib.b3CreateCapsuleShape(body, definition, c.byref(Capsule(Vec3(0, -h, 0), Vec3(0, h, 0), shape["radius"])))
        elif kind == "box":
            hull = lib.b3MakeBoxHull(*map(c.c_float, shape["half_extents"]))
            lib.b3CreateHullShape(body, definition, c.byref(hull))
        elif kind == "hull":
            key = id(shape)
            if key not in self.hulls:
                points = np.array(shape["vertices"], np.float32)
                self.hulls[key] = lib.b3CreateHull(points.ctypes.data_as(c.c_void_p), len(points), len(points))
            lib.b3CreateHullShape(body, definition, c.c_void_p(self.hulls[key]))
        else:
            vertices = np.array(shape["vertices"], np.float32)
            triangles = np.array(shape["triangles"], np.int32)
            mesh = MeshDef(vertices.ctypes.data, triangles.ctypes.data, None, 0, len(vertices), len(triangles),
                           False, False, True)
            self.mesh = c.c_void_p(lib.b3CreateMesh(c.byref(mesh), None, 0))
            lib.b3CreateMeshShape(body, definition, self.mesh, Vec3(1, 1, 1))

    def step(self):
        self.lib.b3World_Step(self.world, self.dt, 4)

    def states(self):
        lib = self.lib

        def vectors(read):
            return np.array([(v.x, v.y, v.z) for v in map(read, self.bodies)])

        turns = np.array([(q.s, q.v.x, q.v.y, q.v.z) for q in map(lib.b3Body_GetRotation, self.bodies)])
        return (vectors(lib.b3Body_GetPosition), turns, vectors(lib.b3Body_GetLinearVelocity),
                vectors(lib.b3Body_GetAngularVelocity))

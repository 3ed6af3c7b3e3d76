"""MuJoCo, through its package of PyPI. Joints are those of a tree, in reduced coordinates, and a mesh is a
height field, because MuJoCo collides with the convex hull of a mesh. A pyramid falls apart with one step of 1/60 s,
and stands with four substeps. The figures are unstable without armature. A step of 4,096 balls in one heap takes
minutes with the solver Newton, so that larger scenes have CG."""

import importlib.metadata
import math

import numpy as np

from . import Unavailable, movable

SUBSTEPS = 4
ARMATURE = 0.01  # [kg m^2]
NEWTON_LIMIT = 10_000  # degrees of freedom


def numbers(values):
    return " ".join(repr(float(v)) for v in np.ravel(values))


def rotated(orientation, v):
    """The vector v after the rotation by the quaternion w, x, y, z."""
    w, u = orientation[0], np.array(orientation[1:])
    return np.add(v, 2 * np.cross(u, np.cross(u, v) + w * np.asarray(v)))


class World:
    name = "MuJoCo"
    settings = ("double; 4 steps of 1/240 s; Newton (default), balls: CG; joints in reduced coordinates, with an "
                "armature of 0.01 kg m^2; height field")
    threaded = False

    @staticmethod
    def version():
        try:
            return importlib.metadata.version("mujoco")
        except importlib.metadata.PackageNotFoundError as error:
            raise Unavailable("the package mujoco") from error

    def __init__(self, scene):
        import mujoco
        self.mujoco = mujoco
        self.assets, self.hulls = [], {}
        self.bodies = scene["bodies"]
        self.children, self.anchors, roots = {}, {}, []
        for joint in scene["joints"]:
            if joint["a"] in self.anchors:
                raise ValueError("reduced coordinates have no loops of joints")
            self.children.setdefault(joint["b"], []).append(joint["a"])
            self.anchors[joint["a"]] = joint["anchor_a"]
        elements = []
        for i, body in enumerate(self.bodies):
            if i not in self.anchors:
                elements.append(self.body(i, None))
        text = (f'<mujoco><option timestep="{scene["dt"] / SUBSTEPS}" gravity="0 -9.81 0"/><size memory="4G"/>'
                '<default><geom friction="0.5 0 0" condim="3" density="1000"/></default>'
                f'<asset>{"".join(self.assets)}</asset><worldbody>{"".join(elements)}</worldbody></mujoco>')
        self.model = mujoco.MjModel.from_xml_string(text)
        for name, heights in self.fields(scene):
            field = self.model.hfield(name)
            start = field.adr[0]
            self.model.hfield_data[start:start + heights.size] = heights.ravel()
        if self.model.nv > NEWTON_LIMIT:
            self.model.opt.solver = mujoco.mjtSolver.mjSOL_CG
        self.data = mujoco.MjData(self.model)
        self.ids = [self.model.body(f"b{i}").id for i in movable(scene)]

    def body(self, i, parent):
        body = self.bodies[i]
        position, turn = np.array(body["position"]), body["orientation"]
        geom = self.geom(i, body["shape"])
        if body["mass"] == 0:
            return f'<body name="b{i}" pos="{numbers(position)}" quat="{numbers(turn)}">{geom}</body>'
        if parent is None:
            joint = "<freejoint/>"
        else:
            joint = f'<joint type="ball" pos="{numbers(self.anchors[i])}" armature="{ARMATURE}"/>'
            inverse = [parent["orientation"][0], *np.negative(parent["orientation"][1:])]
            position = rotated(inverse, position - parent["position"])
            turn = product(inverse, turn)
        children = "".join(self.body(child, body) for child in self.children.get(i, ()))
        return f'<body name="b{i}" pos="{numbers(position)}" quat="{numbers(turn)}">{joint}{geom}{children}</body>'

    def geom(self, i, shape):
        kind = shape["type"]
        if kind == "sphere":
            return f'<geom type="sphere" size="{shape["radius"]!r}"/>'
        if kind == "box":
            return f'<geom type="box" size="{numbers(shape["half_extents"])}"/>'
        if kind == "capsule":
            h = shape["half_height"]
            return f'<geom type="capsule" size="{shape["radius"]!r}" fromto="0 {-h} 0 0 {h} 0"/>'
        if kind == "hull":
            name = self.hulls.setdefault(str(shape["vertices"]), f"hull{len(self.hulls)}")
            if len(self.assets) < len(self.hulls):
                self.assets.append(f'<mesh name="{name}" vertex="{numbers(shape["vertices"])}"/>')
            return f'<geom type="mesh" mesh="{name}"/>'
        x, y, z = np.array(shape["vertices"]).T
        side = math.isqrt(len(x))
        low, high = y.min(), y.max()
        self.assets.append(f'<hfield name="field{i}" nrow="{side}" ncol="{side}" '
                           f'size="{x.max()} {z.max()} {high - low} 5"/>')
        # The z axis of the field becomes y, and its y axis -z.
        turn = numbers((math.sqrt(0.5), -math.sqrt(0.5), 0, 0))
        return f'<geom type="hfield" hfield="field{i}" pos="0 {low} 0" quat="{turn}"/>'

    def fields(self, scene):
        for i, body in enumerate(scene["bodies"]):
            if body["shape"]["type"] == "triangle_mesh":
                y = np.array(body["shape"]["vertices"])[:, 1]
                side = math.isqrt(len(y))
                yield f"field{i}", ((y - y.min()) / (y.max() - y.min())).reshape(side, side)[::-1]

    def step(self):
        self.mujoco.mj_step(self.model, self.data, nstep=SUBSTEPS)
        if self.data.warning[self.mujoco.mjtWarning.mjWARN_BADQACC].number:
            raise RuntimeError("MuJoCo: unstable, the state is reset")

    def states(self):
        m = self.mujoco
        m.mj_kinematics(self.model, self.data)
        m.mj_comPos(self.model, self.data)
        m.mj_comVel(self.model, self.data)
        velocities = np.empty((len(self.ids), 6))
        for row, body in zip(velocities, self.ids):
            m.mj_objectVelocity(self.model, self.data, m.mjtObj.mjOBJ_XBODY, body, row, 0)
        return self.data.xpos[self.ids], self.data.xquat[self.ids], velocities[:, 3:], velocities[:, :3]


def product(p, q):
    a, u, b, v = p[0], np.array(p[1:]), q[0], np.array(q[1:])
    return [a * b - u @ v, *(a * v + b * u + np.cross(u, v))]

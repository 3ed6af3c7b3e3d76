"""The stubs of the extension module, which the build makes."""

import ast
import pathlib

import pytest

import jfpx


@pytest.mark.parametrize("name", ["f32", "f64"])
def test_stubs_have_the_names_of_the_module(name):
    module = getattr(jfpx._core, name)
    stub = pathlib.Path(jfpx._core.__file__).parent / "_core" / f"{name}.pyi"
    declared = {node.name: node for node in ast.parse(stub.read_text()).body
                if isinstance(node, (ast.ClassDef, ast.FunctionDef))}
    public = {key: value for key, value in vars(module).items() if not key.startswith("_")}
    assert declared.keys() == public.keys()
    for key, value in public.items():
        if isinstance(value, type):
            members = {node.name for node in declared[key].body
                       if isinstance(node, ast.FunctionDef)}
            assert members >= {member for member in vars(value) if not member.startswith("_")}


def test_a_type_checker_sees_the_names_and_the_results(tmp_path):
    api = pytest.importorskip("mypy.api")
    program = tmp_path / "program.py"
    program.write_text("""
import jfpx
import jfpx.mpi
import numpy as np
points = [[0.0, 0.0, 0.0]]
contacts: jfpx.Contacts = jfpx.find_contacts(points, 1.0)
rows: jfpx.Rows = jfpx.find_pairs(points, 1.0, output="csr")
images: jfpx.PeriodicPairs = jfpx.find_pairs(points, 1.0, periodic=(9, 9, None))
report: jfpx.StepReport = jfpx.World("pile").step()
ranks: jfpx.mpi.Communicator = jfpx.mpi.Communicator()
rank: int = ranks.rank
world = jfpx.World("pile", communicator=ranks)
hinge: jfpx.HingeJoint = jfpx.place_joint(
    jfpx.HingeJoint(world.bodies[0]), world.state(world.bodies[0]), None, np.zeros(3), (1, 0, 0))
joint: jfpx.Joint = world.joint(world.add_joint(hinge))
world.apply_impulse(world.bodies[0], np.ones(3))
""")
    errors, _, status = api.run(["--strict", "--no-incremental", str(program)])
    assert status == 0, errors


def test_all_public_names_are_exported():
    modules = {name for name, value in vars(jfpx).items() if type(value) is type(jfpx)}
    assert set(jfpx.__all__) == {name for name in dir(jfpx) if not name.startswith("_")} - modules

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

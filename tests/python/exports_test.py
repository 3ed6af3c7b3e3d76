"""Exported symbols of the extension module."""
import shutil
import subprocess

import pytest

import jfpx._core


def test_the_module_exports_its_init_function_alone():
    """A wheel has the C++ run-time library in it, whose symbols must not replace those of other modules."""
    nm = shutil.which("nm")
    if nm is None:
        pytest.skip("no nm")
    lines = subprocess.run([nm, "-D", "--defined-only", jfpx._core.__file__],
                           capture_output=True, text=True, check=True).stdout.splitlines()
    assert [line.split()[-1] for line in lines] == ["PyInit__core"]

"""Fixtures of the tests of the Python package."""

import os
import secrets

import numpy as np
import pytest


@pytest.fixture
def rng():
    """A random generator of a fresh seed, or of JFPX_TEST_SEED. A failing test prints the seed."""
    seed = int(os.environ.get("JFPX_TEST_SEED", secrets.randbits(32)))
    print(f"JFPX_TEST_SEED={seed}")
    return np.random.default_rng(seed)


@pytest.fixture(params=["float32", "float64"])
def dtype(request):
    return np.dtype(request.param)

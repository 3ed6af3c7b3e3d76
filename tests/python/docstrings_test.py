"""The docstrings, which help() shows."""

import inspect
import re

import jfpx
import jfpx.mpi


def members():
    """Names and objects of the package, and of its classes, that users may call or read."""
    yield "jfpx", jfpx
    yield "jfpx.mpi", jfpx.mpi
    for name, value in [(name, getattr(module, name)) for module in (jfpx, jfpx.mpi) for name in module.__all__]:
        if inspect.isclass(value) or inspect.isfunction(value):
            yield name, value
        if inspect.isclass(value):
            for key, member in vars(value).items():
                if not key.startswith("_") and (callable(member) or isinstance(member, (property, classmethod))):
                    yield f"{name}.{key}", member


def test_everything_has_a_docstring_that_begins_with_a_sentence():
    for name, value in members():
        text = inspect.getdoc(value)
        assert text and re.match(r"[A-Z\"`(].*[a-z]{2}", text), name
        assert not re.match(r"\W*\[", text), f"{name} begins with a unit"


def test_docstrings_need_no_repository_and_no_other_language():
    for name, value in members():
        assert not re.search(r"docs/|\w::\w|\[-\]|std\b", inspect.getdoc(value)), name


def test_fields_are_described_in_the_docstring_of_their_class():
    found = 0
    for name, value in members():
        for field in getattr(value, "_fields", ()):
            found += 1
            assert re.search(rf"^ *{field} : \S.*\n +\S", inspect.getdoc(value), re.MULTILINE), f"{name}.{field}"
    assert found > 60

"""Parameters of which `make test` takes some and `make test-all` every one."""

from collections.abc import Container, Iterable

import pytest


def in_brief(values: Iterable, brief: Container) -> list:
    """Values for `parametrize`; those that are not among `brief` are slow."""
    return [value if value in brief else _slow(value) for value in values]


def _slow(value):
    several = value if type(value) is tuple else (value,)  # not a row of the models' table
    return pytest.param(*several, marks=pytest.mark.slow)

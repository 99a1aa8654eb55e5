"""Parameters of which `make test` takes some and `make test-all` every one."""

from collections.abc import Container, Iterable

import pytest


def in_brief(values: Iterable, brief: Container) -> list:
    """Values for `parametrize`; those that are not among `brief` are slow."""
    return [value if value in brief else pytest.param(value, marks=pytest.mark.slow) for value in values]

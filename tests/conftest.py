"""Results of the full study, for tests that judge them."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from pneumo.physics.parameters import load, study

RESULTS = Path(__file__).parents[1] / "results"


def study_is_complete() -> bool:
    """Whether results/ holds the paper's study, not nothing and not the smoke runs."""
    file = RESULTS / "exact" / "statistics.nc"
    if not (file.exists() and (RESULTS / "settling.nc").exists() and (RESULTS / "table7.md").exists()):
        return False
    with xr.open_dataset(file) as statistics:
        return statistics.sizes["experiment"] == 16


def pytest_collection_modifyitems(items):
    absent = pytest.mark.skip(reason="results/ does not hold the full study: `make reproduce` makes it")
    marked = [item for item in items if "results" in item.keywords]
    if marked and not study_is_complete():
        for item in marked:
            item.add_marker(absent)


@pytest.fixture(scope="session")
def results() -> Path:
    """Folder of the full study's results."""
    return RESULTS


@pytest.fixture(scope="session")
def plant():
    """Cylinder D at 0.5 W/K."""
    return study(load(Path(__file__).parents[1] / "config/paper.yaml")).experiments["E09"].plant


@pytest.fixture(scope="session")
def random_states() -> np.ndarray:
    """10,000 states (u, x, v, P_A, P_B) of `plant`, on every branch of valve and limiter."""
    low, high = (-12, -0.05, -2, 2e4, 2e4), (12, 0.05, 2, 9e5, 9e5)
    return np.random.default_rng(2006).uniform(low, high, (10_000, 5))

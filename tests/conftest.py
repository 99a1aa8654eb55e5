"""Fixtures for tests of several modules; each is made once per process."""

import copy
import gc
import os
import sys
from functools import cache
from pathlib import Path

import hypothesis
import pytest

# Before NumPy: workers share the processor, and idle threads of its linear algebra would wait by computing.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# Fixtures import what they need: pytest-xdist's first process runs no fixture, and the others wait for it.

# The same examples in every run; `pytest --hypothesis-profile=random` searches for new ones. No test fails
# for the time that it takes on a busy machine.
PATIENT = {"deadline": None, "suppress_health_check": [hypothesis.HealthCheck.too_slow]}
hypothesis.settings.register_profile("random", **PATIENT)
hypothesis.settings.register_profile("same", derandomize=True, **PATIENT)
hypothesis.settings.load_profile("same")

RESULTS = Path(__file__).parents[1] / "results"


def study_is_complete() -> bool:
    """Whether results/ holds the paper's study; the smoke study does not count."""
    if not all((RESULTS / name).exists() for name in ("exact/statistics.nc", "settling.nc", "verdict.json")):
        return False
    import xarray as xr

    with xr.open_dataset(RESULTS / "exact/statistics.nc") as statistics:
        return statistics.sizes["experiment"] == 16


def pytest_collection_modifyitems(items):
    absent = pytest.mark.skip(reason="results/ does not hold the full study: `make reproduce` makes it")
    marked = [item for item in items if "results" in item.keywords]
    if marked and not study_is_complete():
        for item in marked:
            item.add_marker(absent)


def pytest_collection_finish():
    gc.freeze()  # garbage collection skips the modules' objects: saves a twelfth of the time


@pytest.fixture(scope="session")
def results() -> Path:
    """Folder of the full study's results."""
    return RESULTS


@pytest.fixture(scope="session")
def evidence_file(results):
    """Path of a file of evidence by its name, in results or kept with the source; where absent, skip."""
    from paper.study import kept_evidence

    def path(name: str, target: str = "evidence") -> Path:
        file = kept_evidence.evidence_file(results, name)
        if file is None:
            pytest.skip(f"results/{name} is not there: `snakemake -j2 {target}` makes it")
        return file

    return path


@pytest.fixture(scope="session")
def chromium():
    """One browser for the tests of all pages."""
    from browser import chromium_launched

    with chromium_launched() as browser:
        yield browser


@pytest.fixture
def visit(chromium):
    """Function that loads a page in a tab of its own, closed after the test."""
    from browser import Tab

    tabs = []

    def load(file: Path, place: str = "", **options) -> Tab:
        tabs.append(Tab(chromium, **options))
        tabs[-1].open(file, place)
        return tabs[-1]

    yield load
    for tab in tabs:
        tab.context.close()


@pytest.fixture
def inside(tmp_path, monkeypatch, capsys):
    """Run a command in this process and an empty folder; return exit code, output and error."""
    from pneumo.cli.commands import main

    monkeypatch.chdir(tmp_path)

    def run(*arguments):
        monkeypatch.setattr(sys, "argv", ["pneumo", *map(str, arguments)])
        with pytest.raises(SystemExit) as end:
            main()
        return end.value.code or 0, *capsys.readouterr()

    return run


@pytest.fixture(scope="session")
def plant():
    """Cylinder D at 0.5 W/K."""
    from paper_study import STUDY

    return STUDY.experiments["E09"].plant


@pytest.fixture(scope="session")
def rod(plant):
    """A plant whose chambers differ, with a supply colder than the walls."""
    A_B, V_d_B = 0.8 * plant.cylinder.A_A, 2 * plant.cylinder.V_d_A
    conditions = plant.conditions._replace(T_in=283.0)
    return plant._replace(cylinder=plant.cylinder._replace(A_B=A_B, V_d_B=V_d_B), conditions=conditions)


@pytest.fixture(scope="session")
def random_states():
    """2,000 states (u, x, v, P_A, P_B) of `plant`, on every branch of valve and limiter."""
    import numpy as np

    low, high = (-12, -0.05, -2, 2e4, 2e4), (12, 0.05, 2, 9e5, 9e5)
    return np.random.default_rng(2006).uniform(low, high, (2000, 5))


@pytest.fixture(scope="session")
def printed_once(tmp_path_factory) -> Path:
    """The printed study, for tests of group "printed", which must not change it."""
    from printed_study import write_printed_study

    from paper.study.paper_2006.erratum_proofs import PROOFS

    PROOFS.update({name: cache(proof) for name, proof in PROOFS.items()})  # printed values do not change
    return write_printed_study(tmp_path_factory.mktemp("printed") / "results")


@pytest.fixture(scope="session")
def _judged_once(printed_once) -> dict:
    from paper.study.paper_2006.paper import PAPER_2006
    from paper_verdict.judging import verdict

    return verdict(PAPER_2006, printed_once)


@pytest.fixture(scope="module")
def judged_once(_judged_once) -> dict:
    """Verdict on the printed study, a copy for each module."""
    return copy.deepcopy(_judged_once)


@pytest.fixture(scope="session")
def judged_smoke_study(tmp_path_factory):
    """The smoke study up to its verdict and report, run with -j2 in a path with a space in it.

    For tests of group "workflow", which restore its results.
    """
    from tests.torture.study import Study  # not where tests run in a copy of some folders only

    folder = tmp_path_factory.mktemp("smoke") / "a path" / "pneumo"
    run = Study(folder, "config/smoke.yaml")
    done = run.run("-j2", *(f"{run.results.name}/{page}.html" for page in ("verdict", "report")))
    assert done.code == 0, done.output
    return run


@pytest.fixture(scope="session")
def smoke_study(judged_smoke_study):
    """The whole smoke study: figures and the paper of 2007 too."""
    done = judged_smoke_study.run()
    assert done.code == 0, done.output
    return judged_smoke_study

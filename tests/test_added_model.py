"""Adding a model is one row: with M11 in a copy of the checkout, the study and tests of the table run."""

import json
import re
import subprocess
import sys

import pytest
import xarray as xr
from torture.study import Study

pytestmark = [pytest.mark.slow, pytest.mark.workflow, pytest.mark.xdist_group("workflow")]

LAST_ROW = '    Model("M10",'
# Unlike all ten at every n: three indices, mixing without wall heat.
M11 = '    Model("M11", "n",     1.35,    "gamma", "polytropic", True,   "none"),\n'


@pytest.fixture(scope="module")
def copy(tmp_path_factory) -> Study:
    """Checkout with M11, in which the smoke study ran."""
    study = Study(tmp_path_factory.mktemp("added") / "pneumo", "config/smoke.yaml")
    models = study.folder / "pneumo/physics/models.py"
    lines = models.read_text(encoding="utf-8").splitlines(keepends=True)
    lines.insert(1 + next(i for i, line in enumerate(lines) if line.startswith(LAST_ROW)), M11)
    models.write_text("".join(lines), encoding="utf-8")
    done = study.run()
    assert done.code == 0, done.output
    return study


def test_study_statistics_and_figures_hold_the_added_model(copy):
    for transport in ("published", "exact"):
        with xr.open_dataset(copy.results / transport / "statistics.nc") as statistics:
            overall = statistics["mse"].sel(level="overall")
            assert 0 < overall.sel(model="M11") < overall.sel(model="M4")
    # Glyphs are outlines: a label in the picture is known from its comment.
    for name in ("fig08", "fig09", "fig10", "fig11", "traces"):
        assert "<!-- $M_{11}$" in (copy.results / f"figures/{name}.svg").read_text(encoding="utf-8"), name


def test_report_holds_the_added_model(copy):
    page = (copy.results / "report.html").read_text(encoding="utf-8")
    block = re.search(r'id="data">(.*?)</script>', page, re.DOTALL)
    assert block
    data = json.loads(block[1])
    names = [model["name"] for model in data["models"]]
    assert [name for name in names if not name.startswith("full")][-2:] == ["M10", "M11"]
    assert all(len(e["cells"]["exact"]["mse"]) == len(names) for e in data["experiments"])
    verdict = (copy.results / "verdict.html").read_text(encoding="utf-8")
    assert "M11" not in verdict  # the paper says nothing of it


def test_fast_tests_that_read_the_table_pass_with_the_added_model(copy):
    files = sorted((copy.folder / "tests").rglob("test_*.py"))
    reading = [str(file) for file in files if re.search(r"\bMODELS\b", file.read_text(encoding="utf-8"))]
    assert len(reading) > 20
    command = [sys.executable, "-m", "pytest", "-n", "2", "-q", "-m", "not slow and not wheel", *reading]
    done = subprocess.run(command, capture_output=True, **copy.options)
    assert done.returncode == 0, done.stdout[-10_000:]

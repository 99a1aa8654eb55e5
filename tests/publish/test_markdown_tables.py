"""Tables as Markdown: each number in its place."""

import pytest
import xarray as xr

from paper.study.paper_2006.paper_models import PAPER_MODELS
from paper.study.paper_2006.printed_tables import table7
from paper.study.text.markdown_tables import table_7

SHARES = [1.25, 1.0]  # reproduced over published, overall and at another level


@pytest.fixture
def statistics() -> xr.Dataset:
    level = xr.DataArray(SHARES, {"level": ["overall", "typical"]}, ("level",))
    reproduced = table7()[["mse", "mean_error", "std"]] * level
    reproduced["failure_time"] = ("experiment", [float("nan")])
    return reproduced.assign_coords(experiment=["E01"])


def test_rows_stand_beside_the_published_ones(statistics):
    rows = table_7(statistics, table7()).splitlines()
    assert len(rows) == 2 + len(PAPER_MODELS)
    for row, model in zip(rows[2:], PAPER_MODELS, strict=True):
        cells = [cell.strip() for cell in row.strip("|").split("|")]
        printed = table7().sel(model=model)
        assert cells[0] == model
        assert cells[3] == "1.25"  # reproduced over published
        # Half a unit of the last digit shown: three significant ones, or whole pascals.
        columns = (1, "mse", {"rel": 5e-3}), (4, "mean_error", {"abs": 0.5}), (6, "std", {"abs": 0.5})
        for place, name, rounding in columns:
            shown, expected = [float(cell) for cell in cells[place : place + 2]], printed[name].item()
            assert shown == [pytest.approx(expected, **rounding), pytest.approx(1.25 * expected, **rounding)]

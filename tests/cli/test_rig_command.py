"""`pneumo rig`: what it prints and writes, and one line for each mistake."""

import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr
import yaml
from typer.testing import CliRunner

import pneumo
from pneumo.cli.commands import app
from pneumo.errors import InputError

DATA = Path(__file__).parents[2] / "data"
TANK = str(DATA / "tank/discharge.yaml")
POINTS = str(DATA / "tank/discharge.nc")
VALVE = str(DATA / "valve_driven/rig.yaml")


def invoke(*words):
    return CliRunner().invoke(app, ["rig", *words])


def test_models_are_ranked_and_written(tmp_path):
    done = invoke(TANK, POINTS, "--model", "M1", "--model", "full order", "-o", str(tmp_path / "out"))
    assert done.exit_code == 0, done.output
    assert done.stdout.index("full order") < done.stdout.index("M1 ")
    assert re.search(r"C_d +0\.8", done.stdout) and "k_0 (W/K)" in done.stdout
    assert max(len(line) for line in done.stdout.splitlines() if "written" not in line) <= 80
    assert "rig.html" in done.stdout and "kPa fitted" in done.stderr and "kPa fitted" not in done.stdout
    page = (tmp_path / "out/rig.html").read_text(encoding="utf-8")
    assert "discharge.nc" in page and "every second point" in page and "(on its bound)" in page
    result = xr.load_dataset(tmp_path / "out/rig.nc")
    assert list(result["model"].values) == ["full order", "M1"]
    # Of 20 points each, as measured and as replayed.
    off = result["P"] - result["pressure"].sel(model="full order")
    rms = result["rms_fitted"].sel(model="full order").item()
    assert np.sqrt(np.mean(off**2)).item() == pytest.approx(rms, rel=1e-9)
    assert result["temperature"].sizes == {"model": 2, **result["T"].sizes}
    best = result.sel(model="full order", parameter="k_0")
    assert best["low"] < best["estimate"] < best["high"]
    assert np.isnan(result["estimate"].sel(model="M1", parameter="k_0"))


def test_the_function_gives_an_object_that_shows_what_the_command_writes(tmp_path):
    content = yaml.safe_load(Path(TANK).read_text(encoding="utf-8"))
    with xr.open_dataset(POINTS, decode_times=False) as points:
        fit = pneumo.rig(content, points.load(), models=["full order"])
    assert invoke(TANK, POINTS, "--model", "full order", "-o", str(tmp_path / "out")).exit_code == 0
    written = xr.load_dataset(tmp_path / "out/rig.nc")
    for name in ("estimate", "low", "high", "pressure"):
        np.testing.assert_array_equal(fit.to_xarray()[name], written[name])
    table = fit.to_pandas().loc["full order"]
    assert table.loc["k_0", "unit"] == "W K-1" and table.loc["C_d", "value"] == pytest.approx(0.8, abs=0.1)
    assert len(repr(fit).splitlines()) <= 10 and "k_0 = " in repr(fit) and "W/K" in repr(fit)
    assert "<table" in fit._repr_html_() and len(fit.plot().axes) >= 2
    with pytest.raises(InputError, match="command = 'u'"):
        pneumo.rig(TANK, POINTS, command="u")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ((TANK, POINTS, "--model", "M77"), "model = 'M77': must be one of M1,"),
        ((TANK, POINTS, "--model", "m8"), "model 'm8': no such model, perhaps M8"),
        ((TANK, "absent.csv"), "absent.csv: no such file"),
        (("absent.yaml", POINTS), "absent.yaml"),
        ((VALVE, "flat.csv"), "flat.csv: no column u: must have a header such as u_V"),
        ((VALVE, "uneven.csv", "--command", "edges"), "equally spaced"),
    ],
)  # fmt: skip
def test_a_mistake_ends_in_one_line(words, said, inside):
    t = np.arange(40) * 0.01
    flat = {"P_A_kPa": np.full(40, 101.3), "x_mm": np.full(40, 1.0)}
    pd.DataFrame({"t_s": t} | flat).to_csv("flat.csv", index=False)
    pd.DataFrame({"t_s": t**2 + t} | flat).to_csv("uneven.csv", index=False)
    code, out, err = inside("rig", *words)
    assert (code, out) == (2, "") and len(err.splitlines()) == 1 and said in err

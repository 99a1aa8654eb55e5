"""Commands that compute: `pneumo study`, `pneumo fit` and what follows from them."""

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from bad_input import assert_one_line

import pneumo
from pneumo.configuration.parameters import load, sonic_conductance, study
from pneumo.publish.text.formatting import significant
from pneumo.runs import simulate
from pneumo.selection.plants import configured_plant

QUICK = "n: [1.2, 1.3]\nrun: {seeds: 2, duration_limit_s: 0.3}\n"


def test_init_then_study(inside, tmp_path):
    assert inside("init")[:2] == (0, "cylinder.yaml: written; edit it, then: pneumo study cylinder.yaml\n")
    (tmp_path / "quick.yaml").write_text(QUICK)
    code, out, _ = inside("study", "cylinder.yaml", "quick.yaml")
    assert code == 0 and all(f"\nM{i} " in out for i in range(1, 11)) and "\nfull order " in out
    assert out.startswith("mine: Take ") and "Next: pneumo export " in out
    same = pneumo.study(pneumo.load(tmp_path / "cylinder.yaml", tmp_path / "quick.yaml"))
    assert repr(same).splitlines()[:-1] == out.splitlines()[: len(repr(same).splitlines()) - 1]
    assert (
        same.to_xarray().sizes["row"] == len(pneumo.MODELS) + 1 and len(same.plot().axes[0].containers) == 5
    )
    assert [file.name for file in same.save(tmp_path / "saved")] == ["study.html", "study.nc"]
    (source, *_) = same.export(tmp_path / "chosen.c")
    assert source.read_text().count("_step(") > 0 and "<strong>mine: Take " in same._repr_html_()
    assert same._repr_html_().count("<tr>") == len(pneumo.MODELS) + 2
    files = sorted(file.name for file in (tmp_path / "study-cylinder-quick").iterdir())
    assert files == ["study.html", "study.nc"]


WRONG = {
    "no file": (["study"], "Missing argument 'files'"),
    "absent file": (["study", "none.yaml"], "none.yaml: cannot be read"),
    "a folder": (["study", "."], ".: cannot be read"),
    "no number": (["study", "cylinder.yaml", "--seeds", "many"], "--seeds"),
    "too few seeds": (["study", "cylinder.yaml", "--seeds", "0"], "--seeds"),
    "too few threads": (["study", "cylinder.yaml", "--threads", "0"], "--threads"),
    "unknown option": (["study", "cylinder.yaml", "--seed", "3"], "No such option"),
    "unknown cylinder": (["study", "cylinder.yaml", "--cylinder", "D"], "in this study; there are mine"),
    "unknown experiment": (["study", "cylinder.yaml", "--experiment", "E01"], "there are closed, open"),
    "output is a file": (["study", "cylinder.yaml", "-o", "cylinder.yaml"], "is a file"),
    "foreign page": (["study", "cylinder.yaml", "-o", "foreign"], "study.html: not written by"),
    "init twice": (["init", "cylinder.yaml"], "already exists; not overwritten"),
    "init into a folder": (["init", "foreign"], "already exists; not overwritten"),
    "init too much": (["init", "a.yaml", "b.yaml"], "unexpected extra argument"),
    "wrong unit": (["study", "cylinder.yaml", "wrong.yaml"], "cylinders.mine.stroke_cm = 16: unknown key"),
}


@pytest.mark.parametrize("mistake", WRONG)
def test_wrong_use_is_one_line_and_changes_no_file(mistake, inside, tmp_path):
    inside("init")
    (tmp_path / "foreign").mkdir()
    (tmp_path / "foreign" / "study.html").write_text("mine")
    (tmp_path / "wrong.yaml").write_text("cylinders: {mine: {stroke_cm: 16}}")
    arguments, words = WRONG[mistake]
    before = {file: file.read_bytes() for file in tmp_path.rglob("*") if file.is_file()}
    assert_one_line(inside(*arguments), words)
    assert {file: file.read_bytes() for file in tmp_path.rglob("*") if file.is_file()} == before


def test_a_study_whose_runs_all_fail_says_so_and_writes_its_page(inside, tmp_path):
    inside("init")
    light = "cylinders: {mine: {mass_kg: 1.0e-6, friction_Ns_per_m: 1000}}\n"
    steps = "experiments: {open: {signal: {kind: steps, levels: [1, -1], hold_s: 0.1}}}\n"
    (tmp_path / "wild.yaml").write_text(f"{QUICK}step_s: 0.03\n{light}{steps}")
    options = ["--experiment", "open", "--seeds", 1, "-o", "one"]
    code, out, err = inside("study", "cylinder.yaml", "wild.yaml", *options)
    assert out.count("Left out: open, ") == 1 and "mine: No model" in out
    assert code == 2 and err.splitlines()[-1].startswith("pneumo: mine: no full-order run succeeded")
    assert (tmp_path / "one" / "study.html").exists()


def test_chambers_closed_after_the_end_of_the_record_are_refused(inside, tmp_path):
    inside("init")
    write_measurement(tmp_path)
    options = ["--config", "cylinder.yaml", "--trust", "--closed", "both"]
    code, _, err = inside("fit", "bench.csv", *options, "--closed-from", 10)
    assert code == 2 and "pneumo: --closed-from 10 s: leaves 0 samples" in err


@pytest.mark.parametrize(
    ("options", "named"),
    [
        (["--closed", "both", "--model", "M1"], "models"),
        (["--closed", "both", "--also", "b"], "also"),
        (["--closed-from", "0.2"], "--closed-from"),
    ],
)
def test_an_option_without_effect_is_refused(options, named, inside, tmp_path):
    inside("init")
    write_measurement(tmp_path)
    code, out, err = inside("fit", "bench.csv", "--config", "cylinder.yaml", "--trust", *options)
    assert code == 2 and not out and err.splitlines()[-1].startswith(f"pneumo: {named}")


def write_measurement(path):
    """Write 1.5 s of the template's cylinder at work, off its stops, its pressures with noise."""
    plant = configured_plant(study(load(path / "cylinder.yaml")))
    steps = np.arange(1500)
    run = simulate(plant, 1e-3, command=1.5 * np.sign(np.cos(steps / 60) + np.cos(steps / 23)) - 0.2)
    P = np.array([run.P_A, run.P_B]) + np.random.default_rng(1).normal(0.0, 500.0, (2, len(run.t)))
    columns = {"t_s": run.t, "u_V": run.u, "x_mm": 1e3 * run.x, "P_A_kPa": P[0] / 1e3, "P_B_bar": P[1] / 1e5}
    pd.DataFrame(columns).to_csv(path / "bench.csv", index=False)
    return plant


def test_fit_of_a_measurement_of_the_only_cylinder(inside, tmp_path):
    inside("init")
    plant = write_measurement(tmp_path)
    called = ["fit", "bench.csv", "--config", "cylinder.yaml", "--model"]
    code, out, err = inside(*called, "M6", "--model", "M2", "-o", "fitted")
    assert code == 0, err
    assert "Ranked" in out and "fitted/fit.html, fitted/fit.nc and fitted/fitted.yaml: written" in out
    assert "M6: rms" in err and "M2: rms" in err
    with xr.open_dataset(tmp_path / "fitted" / "fit.nc") as fit:
        k = fit.sel(model="M6", parameter="k_xu")
        assert k["low"] < k["estimate"] < k["high"]
        # The model without heat is not the truth; the valve's coefficient is what flows, to a tenth.
        assert k["estimate"].item() == pytest.approx(plant.valve.k_xu, rel=0.1)
        ranked = np.sqrt((fit["rms_held_out"] ** 2).mean("chamber")).values
        assert ranked[0] < ranked[1]
        C = sonic_conductance(plant.valve, plant.gas) * k["estimate"].item() / plant.valve.k_xu
    assert "(dm³/(s bar))" in out and "k_x k_u" not in out  # as the template has the valve
    assert f"{significant(C)} (" in out
    (tmp_path / "leak.yaml").write_text("cylinders: {mine: {valve: {leak_dm3_per_sbar: 0.01}}}")
    assert_one_line(inside(*called, "M6", "--config", "leak.yaml"), "leak_dm3_per_sbar")


@pytest.mark.slow
def test_what_was_fitted_is_studied_linearised_and_exported(inside, tmp_path):
    inside("init")
    plant = write_measurement(tmp_path)
    code, _, err = inside("fit", "bench.csv", "--config", "cylinder.yaml", "--model", "M7", "-o", ".")
    assert code == 0, err
    with xr.open_dataset("fit.nc") as fit:
        of_full = fit["estimate"].sel(model="full")
        estimates = {name: of_full.sel(parameter=name).item() for name in ("k_0", "k_xu")}
        n, k_0 = (fit["estimate"].sel(model="M7", parameter=name).item() for name in ("n", "k_0"))
    # The rig's own: intervals are within 3 %.
    assert estimates == pytest.approx({"k_0": plant.k_0, "k_xu": plant.valve.k_xu}, rel=0.05)
    (tmp_path / "quick.yaml").write_text("run: {seeds: 1, duration_limit_s: 0.3}\n")
    code, out, err = inside("study", "fitted.yaml", "quick.yaml")
    assert code == 0, err
    with xr.open_dataset("study-fitted-quick/study.nc") as cells:
        assert cells["k_0"].values == pytest.approx(estimates["k_0"], rel=1e-5)  # six digits are written
    code, out, err = inside("check", "fitted.yaml")
    assert code == 0 and f"k_0 = {estimates['k_0']:.3g} W/K" in out, err
    at = ["--u", "0.1", "--P_A", "5e5", "--P_B", "5e5"]
    options = ["--n", f"{n:.6g}", "--k0", f"{k_0:.6g}"]
    assert f"M7 {' '.join(options)}" in (tmp_path / "fitted.yaml").read_text(encoding="utf-8")
    code, _, err = inside("linearise", "M7", *options, "--config", "fitted.yaml", *at)
    assert code == 0, err
    code, out, err = inside("export", "M7", *options, "--to", "matlab", "--config", "fitted.yaml")
    assert code == 0, err
    conductance = next(
        float(line.split()[2].rstrip(";")) for line in out.splitlines() if line.strip().startswith("C =")
    )
    fitted_valve = plant.valve._replace(k_xu=estimates["k_xu"])
    assert conductance == pytest.approx(sonic_conductance(fitted_valve, plant.gas), rel=1e-5)

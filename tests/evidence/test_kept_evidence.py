"""Evidence that is kept with the source: whose it is, how much, and a sample of it computed again."""

import json
import re
import shutil
from datetime import date

import netCDF4
import numpy as np
import pytest
import xarray as xr
from paper_study import STUDY

from pneumo.evidence import kept_copies, kept_samples
from pneumo.evidence.seeds.seed_sets import read_seed_sets, seed_sets
from pneumo.storage import kept_evidence
from pneumo.storage.files import read, read_json, write, write_json
from pneumo.storage.kept_evidence import KEPT, NO_CONFIGURATION, kept_files, unlike_list

SEED_SETS = KEPT / "seed_sets.nc"
FILES = kept_files(KEPT)
README = (KEPT / "README.md").read_text(encoding="utf-8")


def origin(file):
    if file.suffix == ".json":
        content = json.loads(file.read_text(encoding="utf-8"))
        return content["config_sha256"], content["code_sha256"], content["date_created"]
    with netCDF4.Dataset(file) as dataset:
        return dataset.config_sha256, dataset.code_sha256, dataset.date_created


def test_each_file_names_what_made_it_and_all_are_small():
    for file in FILES:
        config, code, day = origin(file)
        assert len(code) == 64 and date.fromisoformat(day), file
        assert config == STUDY.config_sha256 or config.startswith(NO_CONFIGURATION), file
        digits = kept_copies.COPIES.get(file.name, kept_copies.Copy()).digits
        rounded = file.suffix == ".nc" and digits
        assert re.search(rf"^\| `{file.name}` \|.*\| {rounded or 'all'} \|", README, re.MULTILINE), file
    assert sum(file.stat().st_size for file in FILES) <= 4_200_000  # bytes, in every clone


def test_no_set_is_kept_twice_and_the_seeds_are_those_that_are_drawn():
    kept = read_seed_sets(SEED_SETS)
    drawn = seed_sets(STUDY, 100)
    numbers = kept["seeds"].values.tolist()
    assert len(set(numbers)) == len(numbers)
    for cylinder in ("D", "E"):
        assert kept[f"seed_{cylinder}"].values.tolist() == [drawn[number][cylinder] for number in numbers]


@pytest.mark.slow
@pytest.mark.parametrize("file", kept_samples.SAMPLES)
def test_samples_computed_again_are_those_that_are_kept(file):
    checked = kept_samples.check_samples(file)
    assert checked.numbers and checked.good, checked


def test_every_kept_file_has_samples():
    assert set(kept_samples.SAMPLES) == {file.name for file in FILES}


def test_kept_files_are_as_listed():
    assert unlike_list(KEPT) == [], "`python workflow/kept.py keep NAME` lists them"


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.name)
def test_a_number_doubled_in_a_file_with_a_good_seal_is_not_as_listed(file, tmp_path, monkeypatch, inside):
    folder = shutil.copytree(KEPT, tmp_path / "kept")
    if file.suffix == ".json":
        text = read_json(file)
        digit = re.search(r"(?<=: 0\.)[1-4](?=\d*[,\n])", text)
        write_json(text[: digit.start()] + str(2 * int(digit[0])) + text[digit.end() :], folder / file.name)
    else:
        dataset = read(file)
        variable = next(v for v in dataset.data_vars.values() if v.dtype.kind == "f" and (v > 0).any())
        place = np.flatnonzero(variable.values > 0)[0]
        variable.values.flat[place] *= 2
        write(dataset, folder / file.name, dataset.attrs)
    assert unlike_list(folder) == [file.name]
    monkeypatch.setattr(kept_evidence, "KEPT", folder)
    monkeypatch.setattr(kept_samples, "SAMPLES", {file.name: None})
    code, out, err = inside("paper", "check-evidence")
    assert code == 2 and f"{file.name}: not as listed" in err and out.count("CHANGED") == 1
    (folder / file.name).unlink()
    (folder / "floor2.nc").write_bytes(b"")
    assert unlike_list(folder) == sorted([file.name, "floor2.nc"])


@pytest.mark.parametrize("file", [file for file in FILES if file.suffix == ".nc"], ids=lambda file: file.name)
def test_a_doubled_number_is_found_in_any_variable_however_small(file):
    rng = np.random.default_rng(1)
    for name, variable in read(file).data_vars.items():
        limit = kept_copies.tolerance(file.name, str(name))
        values = variable.values.ravel()
        known = np.flatnonzero(np.isfinite(values) & (values != 0)) if values.dtype.kind in "fiu" else []
        if len(known):
            smallest = known[abs(values[known]).argmin()]
            for place in (smallest, rng.choice(known)):
                again = values.copy()
                again[place] *= 2
                assert kept_copies.difference(values, again) > limit, (name, place)
        assert kept_copies.difference(values, values.copy()) == 0.0


def test_files_are_compared_variable_by_variable_and_findings_value_by_value(tmp_path):
    file = KEPT / "floor.nc"
    dataset = read(file)
    dataset["reduced"][3, 1] *= 2
    write(dataset, tmp_path / "floor.nc", dataset.attrs)
    off = kept_copies.differences(file, tmp_path / "floor.nc")
    assert {name for name, value in off.items() if value} == {"reduced"} and off["reduced"] == 1.0
    file = KEPT / "findings.json"
    content = json.loads(read_json(file))
    place, row = next((i, row) for i, row in enumerate(content["claims"]) if row["numbers"])
    row["numbers"]["exact"]["share_low"] *= 2
    write_json(json.dumps(content | {"code_sha256": "other"}), tmp_path / "findings.json")
    off = kept_copies.differences(file, tmp_path / "findings.json")
    assert [name for name, value in off.items() if value] == [f"claims.{place}.numbers.exact.share_low"]


def test_a_number_that_is_missing_or_infinite_on_one_side_is_a_difference():
    kept = np.array([1.0, 0.0, np.nan, np.inf, 1e-14])
    assert kept_copies.difference(kept, np.array([1.0, 1e-13, np.nan, np.inf, 1e-14])) == 0.0  # rounded zero
    for place, value in ((0, np.nan), (1, 0.1), (2, 1.0), (3, -np.inf)):
        again = kept.copy()
        again[place] = value
        assert kept_copies.difference(kept, again) == np.inf, place
    assert kept_copies.difference(kept, kept[:-1]) == np.inf
    assert kept_copies.difference(np.array(["M8"]), np.array(["M7"])) == np.inf


def test_a_residual_counts_as_no_smaller_than_the_rms_of_its_curve(tmp_path):
    kept = read(KEPT / "measurements.nc")
    error = kept["error"]
    rms = (error**2).mean("t") ** 0.5
    curve = {"record": 1, "law": 2, "chamber": 0}
    nearest_zero = int(np.abs(error.isel(curve).values).argmin())
    for off, found in ((0.5e-3, False), (1.5e-3, True)):  # of the RMS; the limit is 1e-3
        again = kept.copy(deep=True)
        again["error"][curve | {"t": nearest_zero}] += off * rms.isel(curve)
        again["value"][{"parameter": kept["parameter"].values.tolist().index("leak")}] *= 1 + off
        write(again, tmp_path / "measurements.nc", kept.attrs)
        differs = kept_copies.differences(KEPT / "measurements.nc", tmp_path / "measurements.nc")
        limit = kept_copies.tolerance("measurements.nc")
        assert [name for name, value in differs.items() if value > limit] == ["value", "error"] * found
    assert (kept_copies.least_sizes("floor.nc", kept, "error") == 0.0).all()


def test_an_estimate_and_its_ends_may_differ_by_half_the_intervals_half_width():
    def made(shift):
        by = ("case", "model")
        columns = {"estimate": [[9.0, 1e-9]], "low": [[8.0, np.nan]], "high": [[10.0, np.nan]]}
        data = xr.Dataset({name: (by, values) for name, values in columns.items()})
        data["estimate"][0, 0] += shift
        return data.assign(low=data["low"] + shift, high=data["high"] + shift)

    def differs(again):
        kept = made(0.0)
        return {
            name: kept_copies.difference(
                kept[name].values, again[name].values, kept_copies.least_sizes("measured_air.nc", kept, name)
            )
            > kept_copies.tolerance("measured_air.nc", name)
            for name in kept.data_vars
        }

    assert differs(made(0.49)) == dict.fromkeys(("estimate", "low", "high"), False)
    assert differs(made(0.51)) == dict.fromkeys(("estimate", "low", "high"), True)
    for zero, found in ((-1e-9, False), (0.01, False), (0.05, True)):  # on a bound, beside 9 of others
        again = made(0.0)
        again["estimate"][0, 1] = zero
        assert differs(again)["estimate"] == found


def test_one_end_in_a_thousand_may_be_beyond_the_search_on_one_machine():
    kept = np.ones((200, 10))
    for count, found in ((2, 0.0), (3, np.inf)):
        again = kept.copy()
        again.flat[:count] = np.nan
        assert kept_copies.difference(kept, again, missing=1e-3) == found
        assert kept_copies.difference(again, kept, missing=1e-3) == found
    again = np.where(kept == 1.0, np.inf, kept)
    assert kept_copies.difference(again, kept, missing=1e-3) == np.inf
    listed = kept_copies.MISSING | kept_copies.INTERVALS | kept_copies.ALLOWED | kept_copies.AS_LARGE_AS
    assert all(name in read(KEPT / file) for file, name in listed)


def test_what_one_file_may_differ_by_is_not_allowed_in_another():
    assert kept_copies.tolerance("measured_air.nc", "estimate") == 4e-3
    assert kept_copies.tolerance("identification.nc", "estimate") == pytest.approx(1e-3, rel=1e-12)


def test_an_estimate_that_is_not_determined_may_be_any():
    by = ("case", "model")
    kept = xr.Dataset({"estimate": (by, [[9.0]]), "low": (by, [[-np.inf]]), "high": (by, [[np.inf]])})
    sizes = kept_copies.least_sizes("measured_air.nc", kept, "estimate")
    assert kept_copies.difference(kept["estimate"].values, np.array([[1e3]]), sizes) == 0.0
    assert kept_copies.difference(kept["low"].values, np.array([[8.0]]), sizes) == np.inf


def test_the_command_prints_a_table_and_refuses_what_differs(inside, monkeypatch):
    def samples():
        yield kept_samples.Sample("a number", np.array([1.0]), np.array([1.01]), 0.1)

    monkeypatch.setattr(kept_samples, "SAMPLES", {"floor.nc": samples})
    monkeypatch.setattr(kept_samples, "of_this_study", lambda _file: True)
    code, out, err = inside("paper", "check-evidence")
    assert (code, err) == (0, "") and out.splitlines()[1].split()[:4] == ["floor.nc", "1", "as", "kept"]
    monkeypatch.setattr(
        kept_samples, "SAMPLES", {"floor.nc": lambda: iter([next(samples())._replace(tolerance=1e-3)])}
    )
    code, out, err = inside("paper", "check-evidence")
    assert code == 2 and "DIFFERENT" in out and "floor.nc: not what is computed today" in err
    monkeypatch.setattr(kept_samples, "of_this_study", lambda _file: False)
    code, out, _ = inside("paper", "check-evidence")
    assert code == 2 and "OTHER STUDY" in out

"""Evidence that is kept with the source: whose it is, how much, and a sample of it computed again."""

import json
from datetime import date

import netCDF4
import numpy as np
import pytest
from brief import in_brief
from checkout import ROOT
from paper_study import EARLIER_SETUP, STUDY

from pneumo.configuration.parameters import read_yaml
from pneumo.evidence.identification.open_loop import Likelihood, numbers_over_seeds, penalty
from pneumo.evidence.identification.open_loop_cells import (
    SETUPS,
    draws_of,
    joined_cells,
    reversals,
    with_setup,
)
from pneumo.evidence.random_cylinders.cylinder_runs import cylinder_cells
from pneumo.evidence.seeds.seed_sets import both_chambers, read_seed_sets, seed_sets, with_seeds
from pneumo.evidence.sensitivity.alternatives import ledger_alternatives
from pneumo.evidence.sensitivity.toggled_assumptions import toggled_tables
from pneumo.papers.paper_2006.numbers_of_tables import TABLES, numbers_of_tables
from pneumo.papers.paper_2006.printed_tables import PAPER_FOLDER
from pneumo.physics.models import MODELS
from pneumo.simulation.full_order import record
from pneumo.storage.files import read
from pneumo.storage.kept_evidence import KEPT, NO_CONFIGURATION
from pneumo.verdict.claims import read_claims

SEED_SETS = KEPT / "seed_sets.nc"
ANY_CYLINDER = 1234
DIGITS = 2**-17 + 2**-18  # five digits, from which the file was written; and those that its blocks had before
README = (KEPT / "README.md").read_text(encoding="utf-8")


def origin(file):
    if file.suffix == ".json":
        content = json.loads(file.read_text(encoding="utf-8"))
        return content["config_sha256"], content["code_sha256"], content["date_created"]
    with netCDF4.Dataset(file) as dataset:
        return dataset.config_sha256, dataset.code_sha256, dataset.date_created


def of_todays_setup(name: str) -> None:
    """Skip a test of evidence that is of the setup before."""
    if name in EARLIER_SETUP:
        pytest.skip(f"{name} is of the setup before decisions 35 and 62")


def test_each_file_names_what_made_it_and_all_are_small():
    files = [file for file in KEPT.rglob("*") if file.suffix in (".nc", ".json")]
    for file in files:
        config, code, day = origin(file)
        assert len(code) == 64 and date.fromisoformat(day), file
        of_today = config == STUDY.config_sha256 or config.startswith(NO_CONFIGURATION)
        assert of_today != (file.name in EARLIER_SETUP), file
        assert f"`{file.name}`" in README, file
    assert sum(file.stat().st_size for file in files) <= 2_200_000  # bytes, in every clone


def test_no_set_is_kept_twice_and_the_seeds_are_those_that_are_drawn():
    kept = read_seed_sets(SEED_SETS)
    drawn = seed_sets(STUDY, 100)
    numbers = kept["seeds"].values.tolist()
    assert len(set(numbers)) == len(numbers)
    for cylinder in ("D", "E"):
        assert kept[f"seed_{cylinder}"].values.tolist() == [drawn[number][cylinder] for number in numbers]


@pytest.mark.parametrize("name", in_brief(["E10", "E13", "E16"], ["E16"]))
def test_experiments_of_a_set_computed_again_are_those_that_are_kept(name):
    of_todays_setup("seed_sets.nc")
    kept = read_seed_sets(SEED_SETS)
    number = int(kept["seeds"].values[0])
    short = STUDY.with_halvings()
    short = short._replace(experiments={name: short.experiments[name]})
    again = both_chambers(with_seeds(short, seed_sets(STUDY, 100)[number], threads=1))
    for quantity in ("mse", "mean_error"):
        before = kept[quantity].sel(seeds=number, experiment=[name]).transpose(*again[quantity].dims)
        after = again[quantity].sel(model=kept["model"])  # a model may have been added since
        np.testing.assert_allclose(before, after, rtol=DIGITS, err_msg=quantity)


def test_a_random_cylinder_run_again_gives_the_errors_that_are_kept():
    kept = read(KEPT / "cylinders.nc")["lowest"].sel(cylinder=ANY_CYLINDER)
    again = cylinder_cells(ANY_CYLINDER)["mse"].min("n").sel(model=kept["model"]).transpose(*kept.dims)
    np.testing.assert_allclose(kept, again, rtol=1e-4)  # four digits are kept


def test_an_assumption_toggled_again_gives_what_is_kept(evidence_file):
    of_todays_setup("assumptions.nc")
    name, experiment = "gas_constant.R_287_05", "E13"
    alternative = ledger_alternatives(read_yaml(ROOT / "config/paper.yaml"))[name]
    alone = {experiment: alternative.study.experiments[experiment]}
    alternative = alternative._replace(study=alternative.study._replace(experiments=alone))
    claims = read_claims(PAPER_FOLDER).items.items()
    items = {key: claim for key, claim in claims if f".{experiment}." in key}
    again = toggled_tables({name: alternative}, items)["reproduced"].sel(alternative=name)
    assert again.sizes["item"] == 10 and again.notnull().all()
    kept = read(evidence_file("assumptions.nc"))["reproduced"].sel(alternative=name, item=again["item"])
    np.testing.assert_allclose(kept, again, rtol=1e-4)  # four digits are kept


def test_the_chosen_open_loop_computed_again_gives_what_is_kept():
    kept = read(KEPT / "open_loop.nc")
    first = kept.sel(pair="1")
    pair = [SETUPS[number] for number in first["setup_number"].values]
    e = with_setup(STUDY.experiments["E15"], pair[1])
    recording, draws = record(e), draws_of(e)
    number = int(first["setup_number"].sel(cylinder="E"))
    on_time = record(with_setup(e, pair[1]._replace(late=0.0)))
    assert reversals(on_time, draws) == kept["reversals"].sel(open_loop="E15").values[number]
    models = np.isin(list(MODELS), kept["model"].values)
    again = joined_cells(STUDY, e, recording)[:, models]
    for quantity, values in zip(("mean_error", "mse"), again, strict=True):
        np.testing.assert_allclose(kept[quantity].sel(experiment="E15"), values, rtol=1e-5)

    # Its score, from all of its cells, is the kept one and the lowest of all.
    assert kept["score"].values[tuple(first["setup_number"].values)] == kept["score"].min()
    if "open_loop.nc" in EARLIER_SETUP:
        return  # its covariance is that of the seed sets with the setup before
    likelihood = Likelihood(numbers_over_seeds(STUDY, read_seed_sets(SEED_SETS))[1:])
    cells = [kept[name].values.astype(float) for name in ("mean_error", "mse")]
    experiments = kept["experiment"].values.tolist()
    numbers = numbers_of_tables(*cells, STUDY.n, experiments, STUDY.experiments_by_level)
    score = likelihood.chi_square(numbers, TABLES) + penalty(pair)
    assert first["scores"].values[0] == pytest.approx(score, abs=0.05)

"""The tables' numbers as one vector, printed and from cells; their chi-squares; arguments for misprints."""

import numpy as np
import pytest
from paper_study import STUDY

from paper.study.averages import OVERALL, at_n, concatenated, statistics
from paper.study.kept_evidence import KEPT
from paper.study.paper_2006.numbers_of_tables import TABLES, numbers_of_tables, printed_numbers
from paper.study.paper_2006.paper_models import PAPER_MODELS
from paper.study.paper_2006.printed_tables import PAPER_FOLDER
from paper.study.paper_2006.table_likelihood import TableLikelihood
from paper_verdict.claims import read_claims
from pneumo.storage.files import read

PRINTED = printed_numbers()
LEVELS = STUDY.experiments_by_level
SEEDS = PRINTED["printed"].to_numpy() + np.random.default_rng(3).normal(0.0, 0.2, (40, len(PRINTED)))
LIKELIHOOD = TableLikelihood(SEEDS)


def test_each_number_is_that_of_a_claim():
    claims = read_claims(PAPER_FOLDER).items
    sizes = PRINTED.groupby("table", sort=False).size()
    assert sizes.to_dict() == dict(zip(TABLES, (30, 90, 96, 36, 36), strict=True))
    for name, row in PRINTED.iterrows():
        value = np.log(claims[name].value) if name.endswith((".mse", ".sigma")) else claims[name].value
        assert row["printed"] == pytest.approx(value, rel=1e-12, abs=1e-12), name
    variances = {"T7.M1.mu": 100**2 / 12, "T8.E01.M5": 0.05**2 / 12, "F9.M1.p10": 0.016**2}
    assert PRINTED["variance"][list(variances)].to_dict() == pytest.approx(variances)
    assert PRINTED.index.is_unique and (PRINTED["variance"] > 0).all()


def test_numbers_from_cells_are_those_of_the_statistics():
    seeds = read(KEPT / "seed_sets.nc").sel(transport="published", model=list(PAPER_MODELS)).astype(float)
    cells = seeds.isel(seeds=1, drop=True).transpose("experiment", "model", "n", "chamber")
    both = [cells[name].squeeze("chamber").values for name in ("mean_error", "mse")]
    vector = numbers_of_tables(*both, STUDY.n, cells["experiment"].values.tolist(), LEVELS)
    tables, joined = statistics(cells, LEVELS), concatenated(cells)
    for (name, row), value in zip(PRINTED.iterrows(), vector, strict=True):
        *place, model, column = name.split(".")
        level = place[1] if len(place) > 1 else OVERALL
        if row["table"] == "T8":
            expected = tables["best_n"].sel(experiment=model, model=column)
        elif column in ("p10", "p90"):
            n = tables["best_n"] if level == OVERALL else tables["constant_n"].sel(level=level, drop=True)
            names = cells["experiment"].values if level == OVERALL else LEVELS[level]
            mse = at_n(joined, n)["mse"].sel(experiment=names, model=model)
            expected = np.log10(np.percentile(mse, float(column[1:])))
        else:
            variable = {"mu": "mean_error", "sigma": "std", "mse": "mse"}[column]
            average = tables[variable].sel(level=level, model=model).item()
            expected = average if column == "mu" else np.log(average)
        assert value == pytest.approx(expected, rel=1e-9), name


def test_chi_square_of_one_deviation():
    meant = PRINTED["meant"].fillna(PRINTED["printed"]).to_numpy()
    assert LIKELIHOOD.chi_square(meant, TABLES) == 0
    i = PRINTED.index.get_loc("T7.M8.mse")
    variance = SEEDS[1:, i].var(ddof=1) + PRINTED["variance"].iloc[i]
    off = meant.copy()
    off[i] += 2 * np.sqrt(variance)
    of_printed = off - meant + PRINTED["printed"].to_numpy()
    assert LIKELIHOOD.of_items(of_printed, ["T7.M8.mse"]) == pytest.approx(4.0)
    assert LIKELIHOOD.of_items(of_printed, ["T7.M7.mse", "T9.isothermal.M10.mse"]) == 0
    assert LIKELIHOOD.of_items(of_printed, ["T7.M8.mse", "T5.E01.P_A"]) is None
    assert LIKELIHOOD.chi_square(off, ("T9",)) == 0
    # Independent seeds have hardly any correlation left: that of the number alone.
    assert LIKELIHOOD.chi_square(off, ("T7",)) == pytest.approx(4.0, rel=0.2)
    printed = PRINTED["printed"].to_numpy()
    assert LIKELIHOOD.chi_square(printed, ("T8",), "printed") == 0 < LIKELIHOOD.chi_square(printed, ("T8",))
    assert LIKELIHOOD.degrees_of_freedom(("T9",)) == LIKELIHOOD.degrees_of_freedom(("T9",), "printed") - 3

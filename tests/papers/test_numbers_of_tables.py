"""The tables' numbers as one vector: as printed, and from cells."""

import numpy as np
import pytest
from paper_study import STUDY

from paper.study.kept_evidence import KEPT
from paper.study.paper_2006.numbers_of_tables import TABLES, numbers_of_tables, printed_numbers
from paper.study.paper_2006.paper_models import PAPER_MODELS
from paper.study.paper_2006.printed_tables import PAPER_FOLDER
from pneumo.statistics.averages import OVERALL, at_n, concatenated, statistics
from pneumo.storage.files import read
from pneumo.verdict.claims import read_claims

PRINTED = printed_numbers()
LEVELS = STUDY.experiments_by_level


def test_each_number_is_that_of_a_claim():
    claims = read_claims(PAPER_FOLDER).items
    sizes = PRINTED.groupby("table", sort=False).size()
    assert sizes.to_dict() == dict(zip(TABLES, (30, 90, 96, 36, 36), strict=True))
    for name, row in PRINTED.iterrows():
        claim = claims[name]
        value = float(claim.printed) * claim.scale
        if name.endswith((".mse", ".sigma")):
            value = np.log(value)
        assert row["printed"] == pytest.approx(value, rel=1e-12, abs=1e-12), name
    assert PRINTED.index.is_unique and (PRINTED["variance"] > 0).all()


@pytest.mark.parametrize(
    ("name", "deviation"),
    [
        ("T7.M1.mu", 100 / 12**0.5),  # -1.02e4 Pa
        ("T9.adiabatic.M1.sigma", 1e3 / 21.0e3 / 12**0.5),  # 21.0 kPa, of two digits
        ("T8.E01.M5", 0.05 / 12**0.5),
        ("F9.M1.p10", 0.016),
        ("F11.adiabatic.M1.p90", 0.008),
    ],
)
def test_variances_are_those_of_printing_or_reading(name, deviation):
    assert PRINTED.loc[name, "variance"] ** 0.5 == pytest.approx(deviation, rel=1e-3)


def test_two_suspected_misprints_are_undone_in_what_is_meant():
    odd = PRINTED[PRINTED["meant"].isna()].index.tolist()
    assert odd == [f"T9.isothermal.M10.{column}" for column in ("mu", "sigma", "mse")]
    for experiment in STUDY.experiments:
        first, second = (f"T8.{experiment}.{model}" for model in ("M8", "M9"))
        assert PRINTED.loc[first, "meant"] == PRINTED.loc[second, "printed"]
        assert PRINTED.loc[second, "meant"] == PRINTED.loc[first, "printed"]
    others = PRINTED.drop([*odd, *PRINTED.filter(regex=r"^T8\..*\.M[89]$", axis=0).index])
    assert (others["meant"] == others["printed"]).all() and len(others) == 288 - 3 - 32


def test_numbers_from_cells_are_those_of_the_statistics():
    seeds = read(KEPT / "seed_sets.nc").sel(transport="published", model=list(PAPER_MODELS)).astype(float)
    seeds = seeds.isel(seeds=slice(2)).transpose("seeds", "experiment", "model", "n", "chamber")
    both = [seeds[name].squeeze("chamber").values for name in ("mean_error", "mse")]
    vectors = numbers_of_tables(*both, STUDY.n, seeds["experiment"].values.tolist(), LEVELS)
    assert vectors.shape == (2, 288)
    cells = seeds.isel(seeds=1).drop_vars("seeds")
    tables = statistics(cells, LEVELS)
    joined = concatenated(cells)
    for (name, row), value in zip(PRINTED.iterrows(), vectors[1], strict=True):
        parts = name.split(".")
        if row["table"] == "T8":
            assert value == tables["best_n"].sel(experiment=parts[1], model=parts[2]), name
            continue
        *place, model, column = parts
        level = place[1] if len(place) > 1 else OVERALL
        if column in ("p10", "p90"):
            n = tables["best_n"] if level == OVERALL else tables["constant_n"].sel(level=level, drop=True)
            names = cells["experiment"].values if level == OVERALL else LEVELS[level]
            mse = at_n(joined, n)["mse"].sel(experiment=names, model=model)
            expected = np.log10(np.percentile(mse, float(column[1:])))
        else:
            average = tables.sel(level=level, model=model)
            pairs = {"mu": average["mean_error"], "sigma": average["std"], "mse": average["mse"]}
            expected = pairs[column].item() if column == "mu" else np.log(pairs[column].item())
        assert value == pytest.approx(expected, rel=1e-9), name

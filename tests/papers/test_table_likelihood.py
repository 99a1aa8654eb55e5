"""Chi-squares of the tables' numbers, and the arguments of the doubts on known cells."""

from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr

from paper.study.paper_2006.doubt_arguments import columns_of_table_8
from paper.study.paper_2006.numbers_of_tables import TABLES, printed_numbers
from paper.study.paper_2006.printed_tables import table7, table8
from paper.study.paper_2006.table_likelihood import TableLikelihood

PRINTED = printed_numbers()
SEEDS = PRINTED["printed"].to_numpy() + np.random.default_rng(3).normal(0.0, 0.2, (40, len(PRINTED)))
LIKELIHOOD = TableLikelihood(SEEDS)


def test_chi_square_of_one_deviation():
    names = PRINTED.index.tolist()
    meant = PRINTED["meant"].fillna(PRINTED["printed"]).to_numpy()
    assert LIKELIHOOD.chi_square(meant, TABLES) == 0
    i = names.index("T7.M8.mse")
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


def test_exchanged_columns_count_as_printed_only():
    exchanged = PRINTED["printed"].to_numpy()
    assert (
        LIKELIHOOD.chi_square(exchanged, ("T8",), "printed") == 0 < LIKELIHOOD.chi_square(exchanged, ("T8",))
    )
    assert LIKELIHOOD.degrees_of_freedom(("T9",)) == 87
    assert LIKELIHOOD.degrees_of_freedom(("T9",), "printed") == 90


@pytest.mark.parametrize("exchanged", [True, False])
def test_argument_for_exchanged_columns(exchanged):
    """A study whose n, and whose mean errors at these n, are those of the one or the other column."""
    printed = table8().reset_coords(drop=True)
    copy = printed.copy()
    if exchanged:
        for model, other in (("M8", "M9"), ("M9", "M8")):
            copy.loc[{"model": model}] = printed.sel(model=other).values
    of_table_7 = table7()["mean_error"].reset_coords(drop=True).sel(model=printed["model"])
    n = xr.DataArray(np.linspace(1, 1.4, 9).round(2), dims="n", name="n")
    n = n.assign_coords(n=n)
    mean_error = of_table_7 + 5000.0 * (n - copy)  # Table 7's at the study's own n
    results = SimpleNamespace(
        statistics=xr.Dataset({"best_n": copy}), cells=xr.Dataset({"mean_error": mean_error})
    )
    finding = columns_of_table_8(results)
    assert finding.holds == exchanged
    assert f"{32 if exchanged else 26} exchanged" in finding.shown

"""Page and table of `pneumo fit`: the fit's numbers, open ends said, nothing from outside, texts escaped."""

import io
import re
from dataclasses import replace

import numpy as np
import pytest
from brief import in_brief
from page_checks import assert_fit_for_a_phone, in_chromium
from rich.console import Console

from pneumo.fit.fit_result import Estimate, FitResult, fit_data
from pneumo.fit.fitted_parameters import REPORTED
from pneumo.fit.record.measurement import Measurement
from pneumo.publish.pages.fit_page import fit_page
from pneumo.publish.text.terminal_tables import fit_heads, fit_rows, fit_tables

SAMPLES = 200


@pytest.fixture(scope="module")
def a_fit():
    rng = np.random.default_rng(3)
    P = 4e5 + 1e3 * rng.normal(size=(2, SAMPLES))
    m = Measurement("m", 1e-3, np.ones(SAMPLES), np.zeros(SAMPLES), P, None, np.nan, ("column <b>: odd",))

    def estimate(k_0, low, high, held_out):
        values = {"n": 1.25, "k_0": k_0, "k_xu": 7.3e-7, "V_d_A": 4e-6, "V_d_B": 5e-6}
        ends = {"k_0": low}, {"k_0": high}
        return Estimate(values, *ends, np.array([900.0, 1100.0]), np.full(2, held_out), P + 100.0)

    estimates = {"M8": estimate(0.3, 0.2, np.nan, 1e3), "M3": estimate(0.5, 0.4, 0.6, 3e3)}
    data = fit_data(m, estimates, REPORTED)
    return FitResult(data=data, notes=m.notes, warnings=("P_A: <i>", "P_B: odd"), held_out_from=0.12)


def test_cells_have_the_fits_numbers_and_the_page_stands_alone_and_escapes(a_fit):
    cells = [dict(zip(fit_heads(a_fit), row, strict=True)) for row in fit_rows(a_fit)]
    assert [row["model"] for row in cells] == ["M8", "M3"]
    assert [row["rms held out (kPa)"] for row in cells] == ["1", "3"]
    assert cells[0]["k_0 (W/K)"] == "0.300 (at least 0.200)"
    assert cells[1]["k_0 (W/K)"] == "0.500 (0.400 to 0.600)"
    assert cells[0]["k_x k_u (mm²/V)"].startswith("0.730")
    assert cells[0]["V_d of B (cm³)"].startswith("5.00")
    page = fit_page(a_fit, "<script>bench</script>.csv")
    assert "<script>" not in page and "&lt;script&gt;" in page
    assert "column &lt;b&gt;: odd" in page and "P_A: &lt;i&gt;" in page and "P_B: odd" in page
    assert not re.search(r"(?:src|href)=\"(?!data:)", page)
    assert len(re.findall(r"<img src=\"data:image/png;base64,", page)) == 2
    assert "0.300 (at least 0.200)" in page and "t = 0.12 s" in page
    assert page.index('<th scope="row">M8') < page.index('<th scope="row">M3')


def test_tables_fit_a_terminal(a_fit):
    console = Console(width=80, record=True, file=io.StringIO())
    wide = replace(a_fit, data=a_fit.data.assign(estimate=a_fit.data["estimate"] * 1.2345678))
    for fit in (a_fit, wide):
        for table in fit_tables(fit):
            console.print(table)
    text = console.export_text()
    assert "…" not in text and "0.300 (at least 0.200)" in text
    assert text.count(" M8 ") == text.count(" M3 ") == 4  # a line in each table


@in_chromium
@pytest.mark.xdist_group("chromium")
@pytest.mark.parametrize("scheme", in_brief(["light", "dark"], ["dark"]))
def test_page_is_readable_on_a_phone_in_both_schemes(scheme, a_fit, visit, tmp_path):
    assert_fit_for_a_phone(visit, fit_page(a_fit, "bench.csv"), tmp_path / "fit.html", scheme, least=20)

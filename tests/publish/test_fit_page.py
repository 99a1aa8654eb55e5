"""Page and table of `pneumo fit`: the fit's numbers, open ends said, nothing from outside, texts escaped."""

import io
import re
from dataclasses import replace
from typing import get_args

import numpy as np
import pytest
import xarray as xr
from page_checks import assert_fit_for_a_phone, in_chromium

from pneumo.fitting.fit_result import Estimate, FitResult, Light, fit_data
from pneumo.fitting.lights import ADDS_LITTLE, light_and_reason, within_commands
from pneumo.fitting.record.measurement import Measurement
from pneumo.publish.pages.fit_page import LIGHT_LOOKS, fit_page
from pneumo.publish.text.fit_text import answer_text, next_experiments
from pneumo.publish.text.terminal_tables import (
    fit_heads,
    fit_rows,
    fit_tables,
    full_order_table,
    lights_text,
    print_table,
    rig_rows,
)
from pneumo.quantities.table import ALSO, QUANTITIES, REPORTED, SHIFTING, VALVE

SAMPLES = 200


def printed(*tables) -> str:
    """Text of tables in a terminal."""
    file = io.StringIO()
    for table in tables:
        print_table(table, file=file, color_system=None)
    return file.getvalue()


def columns(text: str) -> int:
    return max(len(line.rstrip()) for line in text.splitlines())


@pytest.fixture(scope="module")
def a_fit():
    rng = np.random.default_rng(3)
    P = 4e5 + 1e3 * rng.normal(size=(2, SAMPLES))
    m = Measurement("m", 1e-3, np.ones(SAMPLES), np.zeros(SAMPLES), P, notes=("column <b>: odd",))

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
    assert "column &lt;b&gt;: odd" in page
    assert "P<sub>A</sub>: &lt;i&gt;" in page and "P<sub>B</sub>: odd" in page
    assert not re.search(r"(?:src|href)=\"(?!data:)", page)
    assert len(re.findall(r"<img src=\"data:image/png;base64,", page)) == 1
    assert "0.300 (at least 0.200)" in page and "t = 0.12 s" in page
    assert page.index('<th scope="row">M8') < page.index('<th scope="row">M3')


def test_tables_fit_a_terminal_and_keep_their_digits_where_they_do_not(a_fit):
    names = ("estimate", "low", "high")
    for factor, most in ((1.0, 80), (1.2345678, 80), (1.2345678e4, 200)):
        changes = {name: a_fit.data["estimate"] * factor for name in names}
        fit = replace(a_fit, data=a_fit.data.assign(changes))
        text = printed(*fit_tables(fit))
        assert "…" not in text and columns(text) <= most
        for cell in (cell for row in fit_rows(fit) for cell in row):
            assert cell in text


def of_full_order(a_fit, factor=1.0, names=REPORTED, doubts=()):
    """Fit of the full order alone, whose every parameter has an interval `factor` wide to either side."""
    names = [name for name in names if name != "n"]
    # Many digits, and signs where a parameter may have one.
    shown = {name: 12.345678 for name in VALVE} | {"null": -0.12345678, "k_0": 0.12345678}
    value = np.array([[shown.get(name, 123.45678) / QUANTITIES[name].factor for name in names]])
    ends = {"estimate": value, "low": value / factor, "high": value * factor}
    data = {name: (("model", "parameter"), end) for name, end in ends.items()}
    moved = value[..., None] * np.linspace(0.01, 0.02, len(SHIFTING))
    data |= {"moved_by": (("model", "parameter", "quantity"), moved)}
    coords = {"model": ["full"], "parameter": names, "quantity": list(SHIFTING)}
    fit = replace(a_fit, data=xr.Dataset(data, coords))
    lights = {
        name: light_and_reason(name, ends, [text for of, text in doubts if of in ("", name)], 1e6)
        for name, ends in fit.estimates("full").items()
    }
    return replace(fit, judgements=lights)


def test_every_parameter_of_a_rig_has_a_line_with_its_light_in_a_terminal(a_fit):
    fit = of_full_order(a_fit, 1.1, (*REPORTED, *ALSO))
    text = printed(full_order_table(rig_rows(fit)))
    assert "…" not in text and columns(text) <= 80
    for row in rig_rows(fit):
        assert len(re.findall(rf"^ {re.escape(row[0])} .* green ", text, re.MULTILINE)) == 1
        value, *ends = (float(number) for number in re.split(r" \(| to |\)", row[2])[:3])
        assert min(ends) <= value <= max(ends) and value != 0
    assert rig_rows(fit)[0][4] == "offset P_B"  # the last quantity moves most


def test_C_is_green_at_the_largest_command_of_the_record_only(a_fit):
    fit = of_full_order(a_fit, 1.1)
    t = np.arange(SAMPLES) * 1e-3
    data = fit.data.assign_coords(t=t).assign(u=("t", np.full(SAMPLES, 4.5)))
    fit = replace(fit, data=data, u_max=10.0, C_per_k_xu=1e6)
    plain = rig_rows(fit)
    fit = replace(fit, judgements=within_commands(fit.judgements, fit.reached, fit.u_max))
    rows = rig_rows(fit)
    assert len(rows) == len(plain) + 1
    at_most, at_4_5 = (next(row for row in rows if row[0].startswith(name)) for name in ("C (", "C at 4.5 V"))
    assert at_most[1] == "yellow" and at_4_5[1] == "green"
    C, lower = (float(row[2].partition(" ")[0]) for row in (at_most, at_4_5))
    assert lower == pytest.approx(0.45 * C, rel=0.01)
    assert lights_text(rows) == f"{len(rows) - 1} green, 1 yellow (C)"
    as_stated = {name: ("as stated", ADDS_LITTLE) for name in fit.judgements}
    assert columns(printed(full_order_table(rig_rows(replace(fit, judgements=as_stated))))) <= 80
    assert LIGHT_LOOKS.keys() == {*get_args(Light)}


@pytest.mark.slow
@in_chromium
@pytest.mark.xdist_group("chromium")
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_page_is_readable_on_a_phone_in_both_schemes(scheme, a_fit, visit, tmp_path):
    assert_fit_for_a_phone(visit, fit_page(a_fit, "bench.csv"), tmp_path / "fit.html", scheme, least=20)


def test_the_page_begins_with_the_best_model_and_the_next_experiment(a_fit):
    assert answer_text(a_fit).startswith("M8 predicts the part held out best: 1 kPa RMS")
    assert next_experiments(a_fit) == []  # without the full order no light
    sure, unsure = (of_full_order(a_fit, factor) for factor in (1.1, 4.0))
    assert next_experiments(sure) == []
    # At most two lines: those that settle most.
    advised = [line.partition(":")[0] for line in next_experiments(unsure)]
    assert advised == ["V_d of A, V_d of B", "k_0"]
    assert next_experiments(of_full_order(a_fit, 1.1, doubts=[("", "the stops are elsewhere")])) == []
    page = fit_page(a_fit, "bench.csv")
    assert page.index("predicts the part held out best") < page.index("Warning:") < page.index("<main>")

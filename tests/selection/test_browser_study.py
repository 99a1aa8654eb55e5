"""A cylinder studied in the browser: its runs, choice and errors in Chromium against those of Python."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from brief import in_brief
from hypothesis import example, given, settings
from hypothesis import strategies as st
from page_checks import assert_accessible, assert_fit_for_a_phone, assert_quiet, in_chromium, stands_alone

from pneumo.configuration.parameters import read_sources, read_yaml, study
from pneumo.configuration.plausible_cylinders import checked
from pneumo.errors import ConfigurationError
from pneumo.physics.models import MODELS
from pneumo.selection.browser_study import browser_study
from pneumo.selection.cylinder_ranking import run_study
from pneumo.selection.cylinder_template import TEMPLATE
from pneumo.statistics.ranking import rank_models

SOURCES = Path(__file__).parents[2] / "docs/live"
CLANG = pytest.mark.skipif(
    not (shutil.which("clang") and shutil.which("wasm-ld")), reason="clang and lld are not installed"
)
pytestmark = [CLANG, in_chromium, pytest.mark.xdist_group("live page")]
TEXTS = "Object.fromEntries([...document.querySelectorAll('#fields input')].map((i) => [i.id, i.value]))"
SHORT = 2000  # steps of a run here
DIMS = ("experiment", "run", "model", "n", "chamber")


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    file = tmp_path_factory.mktemp("own") / "your-cylinder.html"
    file.write_text(browser_study(SOURCES), encoding="utf-8")
    return file


@pytest.fixture(scope="module")
def tab(page, chromium):
    from browser import Tab

    one = Tab(chromium)
    one.open(page)
    yield one
    one.context.close()


def configured(text, folder):
    """Configuration that the page's YAML gives, as `pneumo check` reads it."""
    file = folder / "my.yaml"
    file.write_text(text, encoding="utf-8")
    return checked(read_sources(file))


CYLINDERS = {
    "template": {},
    "long": {
        "bore_mm": "40",
        "stroke_mm": "300",
        "rod_mm": "16",
        "mass_kg": "12",
        "C_dm3_per_sbar": "4",
        "b": "0.35",
    }
    | {"P_s_Pa": "900000", "amplitude_mm": "40", "k_p_V_per_m": "60", "k_0_low": "0.4", "k_0_high": "0.9"},
    "no Coulomb friction": {
        "bore_mm": "32",
        "stroke_mm": "100",
        "rod_mm": "0",
        "mass_kg": "5",
        "coulomb_N": "0",
    }
    | {"dead_volume_m3": "6e-6", "dead_volume_B_m3": "9e-6", "amplitude_V": "0.5", "amplitude_mm": "10"},
}


@pytest.mark.parametrize("name", in_brief(CYLINDERS, ["template"]))
def test_errors_and_ranking_are_those_of_pneumo_study(name, tab, tmp_path):
    texts = tab.run(TEXTS) | CYLINDERS[name]
    script = """async ([texts, runs, steps]) => {
      study.layout.steps = steps;
      const table = await study.run(texts, runs), {headline, rows} = study.rank(table);
      return {...table, headline, rows};
    }"""
    found = tab.page.evaluate(script, [texts, 2, SHORT])
    plan = study(configured(tab.page.evaluate("(texts) => study.yaml(texts)", texts), tmp_path))
    plan = plan._replace(seeds=2).changed(lambda e: e._replace(steps=SHORT))
    cells = run_study(plan, 2, traced=False)
    errors = np.array(found["errors"])[..., :-1, :, :]  # experiment, run, model, n, chamber
    np.testing.assert_allclose(errors, cells["mse"].transpose(*DIMS).values, rtol=1e-6)
    np.testing.assert_allclose(
        found["swing"], cells["swing"].transpose("experiment", "run").values, rtol=1e-6
    )
    rows = rank_models(cells, "mine").rows
    assert [row["name"] for row in found["rows"]] == [row.model for row in rows]
    assert f"{rows[0].model} at n = {rows[0].n:g} has the lowest error" in found["headline"]
    for mine, row in zip(found["rows"], rows, strict=True):
        assert mine["rms"] == pytest.approx(row.mse.value**0.5, rel=1e-6)
        assert mine["n"] == pytest.approx(row.n, nan_ok=True)


def one_in(*usual, odd=("", "abc", "-1", "0", "1e9")):
    """Text of a field, mostly a usual one."""
    return st.one_of(st.sampled_from(usual), st.sampled_from(usual), st.sampled_from(odd))


FIELD_TEXTS = {
    "bore_mm": one_in("25", "0.4", "12.5", "80"),
    "stroke_mm": one_in("160", "0.2", "33", "2000"),
    "rod_mm": one_in("10", "0", "12", odd=("25", "90", "x")),
    "P_s_Pa": one_in("7e5", "700000", "1.1e5", odd=("1e5", "101325", "6e6", "")),
    "mass_kg": one_in("3", "0.5", "1e4", odd=("0", "1e6")),
    "friction_Ns_per_m": one_in("60", "0", "9e5", odd=("-2", "1e7")),
    "coulomb_N": one_in("10", "0", "150", "3e3", odd=("nan", "-1")),
    "C_dm3_per_sbar": one_in("1.5", "0.2", "90", "1e-5", odd=("0", "")),
    "b": one_in("0.3", "0.5", odd=("0", "1", "1.5")),
    "dead_volume_m3": one_in("", "4e-6", "4e-3", odd=("0", "2")),
    "dead_volume_B_m3": one_in("", "5e-6", odd=("-1",)),
    "k_0_low": one_in("", "0.1", "2e-3", odd=("-1", "9")),
    "k_0_high": one_in("", "0.7", "30", odd=("0.05", "1e5")),
    "amplitude_V": one_in("0.8", "2", "800", odd=("0", "1e4")),
    "amplitude_mm": one_in("15", "100", "1500", odd=("0", "1e4")),
}


@pytest.mark.slow
def test_fields_are_judged_and_converted_as_by_pneumo_check(tab, tmp_path):
    given_texts, judged = tab.run(TEXTS), set()

    @settings(max_examples=100)
    @given(changed=st.fixed_dictionaries({}, optional=FIELD_TEXTS))
    @example({"rod_mm": "25"})
    @example({"P_s_Pa": "1e5"})
    @example({"bore_mm": "0.4", "rod_mm": "0"})
    @example({"coulomb_N": "3e3"})
    @example({"C_dm3_per_sbar": "90", "bore_mm": "12.5"})
    @example({"C_dm3_per_sbar": "1e-5"})
    @example({"k_0_low": "9"})
    @example({"dead_volume_B_m3": "4e-3"})
    @example({"mass_kg": "3000"})
    @example({"amplitude_V": "800"})
    @example({"amplitude_mm": "1500"})
    def same(changed):
        texts = given_texts | changed
        script = (
            "(texts) => ({yaml: study.yaml(texts), refused: study.check(texts), plant: study.plant(texts)})"
        )
        found = tab.page.evaluate(script, texts)
        try:
            plan = study(configured(found["yaml"], tmp_path))
        except ConfigurationError as error:
            assert found["refused"] is not None, str(error)
            assert str(error) == f"{tmp_path / 'my.yaml'}: {found['refused']['line']}"
            judged.add(str(error).split(": ", 2)[2][:14])
            return
        assert found["refused"] is None
        plant, made = plan.experiments["open"].plant, found["plant"]
        expected = (
            plant.cylinder._asdict() | plant.conditions._asdict() | plant.valve._asdict() | {"k_0": plant.k_0}
        )
        for name in set(expected) & set(made):
            assert made[name] == pytest.approx(expected[name], rel=1e-9), name
        assert made["critical_ratio"] == plant.gas.critical_ratio

    same()
    assert len(judged) >= 10
    assert read_yaml_of(
        tab.page.evaluate("(texts) => study.yaml(texts)", given_texts), tmp_path
    ) == read_yaml(TEMPLATE)


def read_yaml_of(text, folder):
    (folder / "read.yaml").write_text(text, encoding="utf-8")
    return read_yaml(folder / "read.yaml")


@pytest.mark.slow
def test_a_link_holds_the_inputs_and_a_change_cancels(page, visit):
    browser = visit(page, "#bore_mm=32&k_0_low=0.2&seeds=1&unknown=1")
    assert browser.run("[bore_mm.value, k_0_low.value, runs.value]") == ["32", "0.2", "1"]
    browser.run("study.layout.steps = 500; document.getElementById('run').click()")
    browser.wait("document.body.dataset.seconds")
    told = browser.run("document.getElementById('told').textContent")
    assert told.startswith("With everything known, M")
    assert browser.run("document.querySelectorAll('#ranking tr').length") == len(MODELS)
    assert browser.run("document.querySelectorAll('#ranking .best').length") == 1
    browser.run("study.layout.steps = 20000; document.getElementById('run').click()")
    browser.page.fill("#mass_kg", "4")
    assert browser.run("location.hash") == "#bore_mm=32&mass_kg=4&k_0_low=0.2&seeds=1"
    assert browser.run("document.getElementById('result').hidden")
    browser.page.fill("#rod_mm", "40")
    assert browser.run("document.getElementById('told').textContent").startswith(
        "cylinders.mine.rod_mm = 40.0: must be below bore_mm = 32"
    )
    assert browser.run("[document.getElementById('run').disabled, rod_mm.ariaInvalid]") == [True, "true"]
    assert browser.console == []
    assert {url.split(":")[0] for url in browser.requests} <= {"file", "blob", "data"}


@pytest.mark.slow
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_the_page_is_small_accessible_and_fits_a_phone(scheme, page, visit, tmp_path):
    text = page.read_text(encoding="utf-8")
    stands_alone(text)
    assert len(text) < 120_000
    assert_fit_for_a_phone(visit, text, tmp_path / "own.html", scheme, 40)
    assert_accessible(visit, page, "document.getElementById('result').hidden = false")
    assert_quiet(visit(page), page)

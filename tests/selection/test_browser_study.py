"""A cylinder studied in the browser: its runs, choice and errors in Chromium against those of Python."""

import shutil
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from brief import in_brief
from hypothesis import example, given, settings
from hypothesis import strategies as st
from page_checks import assert_accessible, assert_fit_for_a_phone, assert_quiet, in_chromium, stands_alone

from pneumo.configuration.known_within import known_within
from pneumo.configuration.parameters import load, read_sources, read_yaml, study
from pneumo.configuration.plausible_cylinders import checked
from pneumo.errors import ConfigurationError
from pneumo.physics.models import MODELS
from pneumo.selection.answer import answer, next_command
from pneumo.selection.browser_study import browser_study
from pneumo.selection.cylinder_ranking import run_study
from pneumo.selection.cylinder_template import TEMPLATE
from pneumo.storage.layout import CHAMBERS

SOURCES = Path(__file__).parents[2] / "docs/live"
CLANG = pytest.mark.skipif(
    not (shutil.which("clang") and shutil.which("wasm-ld")), reason="clang and lld are not installed"
)
pytestmark = [CLANG, in_chromium, pytest.mark.xdist_group("live page")]
TEXTS = "Object.fromEntries([...document.querySelectorAll('#fields input')].map((i) => [i.id, i.value]))"
SHORT = 2000  # steps of a run here


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


def difference(tab, changed, steps, runs, folder):
    """Largest relative difference of any error, and the answers of page and Python, on a cylinder."""
    texts = tab.run(TEXTS) | changed
    script = """async ([texts, runs, steps]) => {
      study.layout.steps = steps;
      const table = await study.run(texts, runs), {headline, reason, next, rows} = study.choose(table);
      return {...table, headline, reason, next, names: rows.map((row) => row.name)};
    }"""
    found = tab.page.evaluate(script, [texts, runs, steps])
    configuration = configured(tab.page.evaluate("(texts) => study.yaml(texts)", texts), folder)
    plan = study(configuration)._replace(seeds=runs)
    plan = plan.changed(lambda e: e._replace(steps=steps))
    cells = run_study(plan, 2, known=known_within(configuration), traced=False)
    errors = np.array(found["errors"])  # case, experiment, run, row, n, chamber
    dims = ("experiment", "run", "model", "n", "chamber")
    low, high = (
        cells["mse_of_wrong_k_0"].sel(k_0_end=end).transpose(*dims).values for end in ("low", "high")
    )
    ratio = errors[:, ..., :-1, :, :] / np.stack([low, cells["mse"].transpose(*dims).values, high])
    full = cells["mse_of_full_order"].transpose("k_0_end", "experiment", "run", "chamber").values
    largest = max(np.abs(ratio - 1).max(), np.abs(errors[::2, ..., -1, 0, :] / full - 1).max())
    swing = np.array(found["swing"]) / cells["swing"].transpose("experiment", "run").values
    expected = answer(cells, "mine")
    assert found["next"] == next_command(expected, plan, ["my.yaml"])
    return max(largest, np.abs(swing - 1).max()), found, expected


@pytest.mark.parametrize("name", in_brief(CYLINDERS, ["template"]))
def test_errors_and_answer_are_those_of_pneumo_study(name, tab, tmp_path):
    largest, found, expected = difference(tab, CYLINDERS[name], SHORT, 2, tmp_path)
    assert largest < 1e-6
    assert found["names"] == [contender.row.model for contender in expected.contenders]
    assert (found["headline"], found["reason"]) == (expected.headline, expected.reason)


def table(random, runs):
    """Random errors of a study, as of a page: rows close to each other, few runs of which some failed."""
    rows, n = len(MODELS) + 1, len(read_yaml(TEMPLATE)["n"])
    scale = random.choice([0.02, 0.3, 2.0])
    each = np.exp(
        random.normal(0, scale, (3, 1, 1, rows, n, 1)) + random.normal(0, scale / 4, (3, 2, runs, rows, n, 2))
    )
    has_n = [model.has_n for model in MODELS.values()] + [False]
    each = 1e7 * np.where(np.array(has_n)[:, None, None], each, each[..., :1, :])
    if random.random() < 0.2:
        each[:, 0, 0, random.integers(rows)] = np.nan
    swing = random.uniform(1e4, 2e5, (2, runs))
    if random.random() < 0.2:
        swing[random.integers(2), random.integers(runs)] = np.nan
    return each, swing


def as_cells(each, swing, k_0, factor):
    """Dataset of `run_study` with these errors."""
    grid = read_yaml(TEMPLATE)["n"]
    dims = ("k_0_end", "experiment", "run", "model", "n", "chamber")
    ends = xr.DataArray(each[::2, ..., :-1, :, :], dims=dims)
    failed = np.where(np.isnan(swing), 1, 0).astype(np.int8)
    runs = swing.shape[1]
    by_run, by_experiment = ("experiment", "run"), ("experiment",)
    return xr.Dataset(
        {
            "mse": (dims[1:], each[1, ..., :-1, :, :]),
            "mse_of_wrong_k_0": ends,
            "mse_of_right_k_0": ends,
            "mse_of_full_order": ((*dims[:3], "chamber"), each[::2, ..., -1, 0, :]),
            "run_status": (by_run, failed, {"flag_meanings": "ok diverged"}),
            "run_failure_time": (by_run, np.zeros(swing.shape)),
            "swing": (by_run, swing),
            "k_0_factor": (by_experiment, np.full(2, factor)),
            "random": (by_experiment, np.ones(2, np.int8)),
            "duration": (by_experiment, np.full(2, 20.0)),
            "time_constant": (by_experiment, np.full(2, 0.5)),
        },
        {
            "experiment": ["open", "closed"],
            "cylinder": (by_experiment, ["mine", "mine"]),
            "k_0": (by_experiment, np.full(2, k_0)),
            "seed": (by_run, np.tile(np.arange(runs), (2, 1))),
            "model": list(MODELS),
            "n": grid,
            "k_0_end": ["low", "high"],
            "chamber": CHAMBERS,
        },
    )


@pytest.mark.slow
def test_the_choice_is_that_of_python(tab):
    kinds, plan = set(), study(load(TEMPLATE))

    @settings(max_examples=100)
    @given(seed=st.integers(0, 2**32 - 1), runs=st.integers(1, 5), factor=st.sampled_from([1.0, 2.0, 2.71]))
    def same(seed, runs, factor):
        each, swing = table(np.random.default_rng(seed), runs)
        plain = [np.where(np.isnan(values), None, values).tolist() for values in (each, swing)]
        script = """([errors, swing, factor]) => {
          const number = (x) => (Array.isArray(x) ? x.map(number) : x ?? NaN);
          return study.choose({errors: number(errors), swing: number(swing), k_0: 0.3, factor}); }"""
        found = tab.page.evaluate(script, [*plain, factor])
        expected = answer(as_cells(each, swing, 0.3, factor), "mine")
        assert (found["headline"], found["reason"]) == (expected.headline, expected.reason)
        assert [row["name"] for row in found["rows"]] == [c.row.model for c in expected.contenders]
        for row, (choice, over, _) in zip(found["rows"], expected.contenders, strict=True):
            assert row["n"] == pytest.approx(choice.n, nan_ok=True)
            assert row["rms"] == pytest.approx(choice.rms, rel=1e-12, nan_ok=True)
            assert row["over"] == pytest.approx(over, rel=1e-9, nan_ok=True)
        assert found["next"] == next_command(expected, plan, ["my.yaml"])
        kinds.add((expected.headline.split()[0], *found["next"].split()[1:2]))

    same()
    decided = {("Recommended:", "export"), ("Tie:", "export"), ("Recommended:",)}
    assert kinds == decided | {("Tie:", "study"), ("Undecided", "study")}


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
    assert told.startswith("Undecided by one run of a random signal: ")
    assert browser.run("document.querySelectorAll('#ranking tr').length") == len(MODELS) + 1
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

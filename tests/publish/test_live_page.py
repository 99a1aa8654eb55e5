"""The page of `pneumo live`: it is current, and its figures are those of `pneumo study` and `simulate`."""

import json
import re
import shutil
import subprocess

import numpy as np
import pytest
from brief import in_brief
from page_checks import assert_accessible, assert_readable, in_chromium, stands_alone

from live.build import assembled
from pneumo import runs
from pneumo.configuration.parameters import load, study
from pneumo.configuration.priors import uncertainties
from pneumo.publish.pages.page import LIVE_PAGE as PAGE
from pneumo.selection.answer import answer
from pneumo.selection.cylinder_ranking import run_study
from pneumo.selection.plants import configured_plant

TEXT = PAGE.read_text(encoding="utf-8")
PARTS = dict(re.findall(r'<script id="(\w+)"[^>]*>\n?(.*?)</script>', TEXT, re.DOTALL))
TEMPLATE = {"bore": 25, "stroke": 160, "rod": 10, "mass": 3, "flow": 380, "supply": 6, "within": 10}
LARGER = {
    "bore": 50,
    "stroke": 300,
    "rod": 20,
    "mass": 12.5,
    "flow": 900,
    "supply": 5,
    "within": 3,
    "deadB": 45,
}
BOTH = {**TEMPLATE, "deadA": 6, "deadB": 7.25}
SCRIPT = """
const fs = require("fs"), {parts, inputs} = JSON.parse(fs.readFileSync(0));
const whole = JSON.parse(parts.layout), points = whole.points.slice(0, 16);
const layout = {...whole, runs: 2, steps: 4000, points};
const page = eval(parts.engine + "; engine")(layout, Buffer.from(parts.wasm, "base64"));
const found = page.bestOf(page.runs.map((run) => page.configured({inputs, ...run})));
const draws = layout.points.map((_, draw) => page.drawn({inputs, best: found.best, draw}));
const few = layout.points.slice(0, layout.strokes);
const intoRest = few.map((_, draw) => page.strokeInto({inputs, best: found.best, draw}));
const {best} = found, from = ["vented", "shut", "rest"];
const strokes = Object.fromEntries(from.map((start) => [start, page.stroke(inputs, best, start)]));
console.log(JSON.stringify({...page.answer(found, draws, intoRest), best, strokes, yaml: page.yaml(inputs)}));
"""


def test_the_page_in_the_package_is_current():
    """`make live` writes it; all but the compiled code is compared, that by a hash of its sources."""
    wasm = re.search('<script id="wasm"[^>]*>(.*?)</script>', TEXT, re.DOTALL).group(1)
    assert assembled(b"").replace('type="text/plain"></script>', f'type="text/plain">{wasm}</script>') == TEXT


@pytest.mark.skipif(not shutil.which("node"), reason="node is not installed")
@pytest.mark.parametrize("inputs", in_brief([TEMPLATE, LARGER, BOTH], [TEMPLATE]))
def test_figures_are_those_of_pneumo_study_and_simulate(inputs, tmp_path, monkeypatch):
    monkeypatch.setattr("pneumo.selection.cylinder_ranking.DRAWS", 16)
    given = json.dumps({"parts": PARTS, "inputs": inputs})
    done = subprocess.run(["node", "-e", SCRIPT], input=given, check=True, capture_output=True, text=True)
    page, file = json.loads(done.stdout), tmp_path / "my.yaml"
    file.write_text(page["yaml"], encoding="utf-8")
    configuration = load(file)
    plan = study(configuration)
    short = {name: e._replace(steps=4000) for name, e in plan.experiments.items()}
    plan = plan._replace(seeds=2, experiments=short)
    cells = run_study(plan, 2, uncertain=uncertainties(configuration), draws=16)
    expected, near = answer(cells, "mine"), 1e-6 * page["swing"]
    assert page["chosen"]["name"] == expected.chosen
    as_good, _, into_rest = expected.reason.partition("; into rest")
    assert set(re.findall(r"M\d+", as_good)) == {row["name"] for row in page["good"]}
    assert bool(into_rest) == page["worseIntoRest"]
    assert any("for both take" in line for line in expected.advice) == bool(page["forBoth"])
    for row, expected_row in zip(page["rows"], expected.rows, strict=True):
        assert row["name"] == expected_row.model
        assert [row[key] for key in ("rms", "low", "high", "stroke")] == pytest.approx(
            [expected_row.rms, expected_row.low, expected_row.high, expected_row.stroke], abs=near
        )
    plant = configured_plant(plan)
    for start, stroke in page["strokes"].items():
        command = np.where(np.arange(6001) < stroke["open"], plant.valve.u_max, 0.0)
        run = runs.simulate(plant, 1e-3, command=command, start=start.replace("shut", "vented"))
        shown = slice(0, None, round(stroke["h"] / 1e-3)), slice(0, len(stroke["x"]))
        near = 1e-6 * (plant.conditions.P_s - plant.conditions.P_atm)  # swing of a stroke
        np.testing.assert_allclose(run.x[shown[0]][shown[1]], stroke["x"], atol=1e-6 * plant.cylinder.stroke)
        for model, pressures in stroke["models"].items():
            name, n = ("full", None) if model == "full order" else (model, page["best"][model])
            replayed = runs.replay(name, n, run)
            for P, in_browser in zip((replayed.P_A, replayed.P_B), pressures, strict=True):
                np.testing.assert_allclose(P[shown[0]][shown[1]], in_browser, rtol=0, atol=near)


DONE = "document.body.dataset.done"


@in_chromium
def test_the_answer_follows_the_slider_and_the_numbers(visit, inside):
    assert inside("live", "-o", "page.html")[0] == 0
    stands_alone(TEXT)
    browser = visit(PAGE)
    words = "document.getElementById('headline').textContent"
    browser.wait(DONE)
    before = browser.run(words)
    assert before.startswith("Take ")
    browser.run("document.getElementById('within').focus()")
    browser.press("End")
    browser.wait(f"{DONE} === '2'")
    after = browser.run(words)
    assert after.startswith("Take ") and after != before
    assert "± 30 %" in browser.run("decodeURIComponent(document.getElementById('yaml').href)")
    rest = "(list => { list.value = 'rest'; list.dispatchEvent(new Event('change')); })"
    arrival = "document.getElementById('arrival').textContent"
    vented = browser.run(arrival)
    browser.run(f"{rest}(document.getElementById('from'))")
    assert "after" in browser.run(arrival) and browser.run(arrival) != vented
    browser.page.fill("#rod", "40")
    assert browser.run(words) == "The rod must be thinner than the bore."
    assert all(url.startswith(("file:", "blob:", "data:")) for url in browser.requests)
    assert browser.console == []


@pytest.mark.slow
@in_chromium
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_the_page_fits_a_phone(scheme, visit):
    browser = visit(PAGE, color_scheme=scheme, width=420, height=740, device_scale_factor=2, is_mobile=True)
    browser.wait(DONE)
    assert_readable(browser, 40)
    assert browser.run("[innerWidth, document.documentElement.scrollWidth]") == [420, 420]
    assert_accessible(visit, PAGE)

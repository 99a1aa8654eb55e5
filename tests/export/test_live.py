"""The cylinder in the browser: its WebAssembly in Chromium against Python, and how the page behaves."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from brief import in_brief
from page_checks import assert_accessible, assert_quiet, assert_readable, in_chromium, stands_alone

from pneumo import MODELS
from pneumo.equations.system import METHODS, step, system
from pneumo.errors import InputError
from pneumo.export import live
from pneumo.export.live import live_page

SOURCES = Path(__file__).parents[2] / "docs/live"
CLANG = pytest.mark.skipif(
    not (shutil.which("clang") and shutil.which("wasm-ld")), reason="clang and lld are not installed"
)
pytestmark = pytest.mark.xdist_group("live page")
N, H, STEPS = 1.2, 1e-3, 300
PAUSE = "(run => run.getAttribute('aria-pressed') === 'true' && run.click())(document.getElementById('run'))"


@pytest.fixture(scope="module")
def page(plant, tmp_path_factory):
    file = tmp_path_factory.mktemp("live") / "live.html"
    file.write_text(live_page(plant, 1.35, SOURCES), encoding="utf-8")
    return file


def test_without_clang_the_reason_is_said(plant, monkeypatch):
    monkeypatch.setattr(live.shutil, "which", lambda _: None)
    with pytest.raises(InputError, match="clang: not installed, so that there is no page"):
        live_page(plant, 1.35, SOURCES)


@CLANG
def test_the_page_stands_alone(page):
    stands_alone(page.read_text())
    assert page.stat().st_size < 200_000


@CLANG
@in_chromium
def test_all_models_and_the_full_order_are_python_s(page, plant, visit):
    browser = visit(page)
    t = np.arange(STEPS) * H
    command = 2.5 * np.sign(np.sin(25 * t)) + np.sin(90 * t)
    changed = {"k_0": 0.8, "M": 3.0, "k_xu": 2e-7, "n": N}
    script = "".join(f"live.set('{name}', {value!r});" for name, value in changed.items())
    in_browser = browser.run(
        f"(() => {{{PAUSE};{script} live.start(); const good = live.advance({command.tolist()});"
        "const [state, pressures, squares] = [live.state, live.pressures, live.squares].map((a) => [...a]);"
        "return {good, state, pressures, squares}})()"
    )
    actuator = plant._replace(
        k_0=0.8, cylinder=plant.cylinder._replace(M=3.0), valve=plant.valve._replace(k_xu=2e-7)
    )
    method, P_0, T_0 = METHODS["DORMAND_PRINCE"], actuator.conditions.P_0, actuator.conditions.T_0
    full, models = system("full", None, actuator, piston=True), [system(name, N, actuator) for name in MODELS]
    state, pressures = [0.0, 0.0, P_0, T_0, P_0, T_0], [[P_0, P_0] for _ in models]
    squares = np.zeros(2 * len(models))
    for u in command.tolist():
        before = [u, *state[:2]]
        state = step(full, method, state, [u, 0.0], [u, 0.0], H)
        pairs = zip(models, pressures, strict=True)
        pressures = [step(model, method, P, before, [u, *state[:2]], H) for model, P in pairs]
        squares += (np.ravel(pressures) - np.tile([state[2], state[4]], len(models))) ** 2
    assert in_browser["good"]
    assert abs(state[0]) > 0.005  # it moved
    np.testing.assert_allclose(in_browser["state"], state, rtol=1e-9)
    np.testing.assert_allclose(in_browser["pressures"], np.ravel(pressures), rtol=1e-9)
    np.testing.assert_allclose(in_browser["squares"], squares, rtol=1e-6)  # differences of pressures


@CLANG
@in_chromium
def test_the_page_runs_and_takes_the_keyboard(page, visit):
    browser = visit(page)
    assert browser.run("document.getElementById('run').textContent") == "Pause"
    browser.wait("live.steps() > 20")
    browser.run("document.getElementById('k_0').focus()")
    k_0 = browser.run("live.get('k_0')")
    browser.press("ArrowRight")
    assert browser.run("live.get('k_0')") == pytest.approx(k_0 + 0.02, abs=0.01)  # on the slider's grid
    browser.run("document.getElementById('bore').focus()")
    browser.press("ArrowRight")
    assert browser.run("live.get('A_A')") == pytest.approx(np.pi / 4 * 0.021**2)
    browser.run(f"{PAUSE}")
    assert browser.run(
        "[...document.querySelectorAll('#errors th')].map((head) => head.textContent)"
    ) == list(MODELS)
    assert_quiet(browser, page)


@CLANG
@in_chromium
@pytest.mark.parametrize("scheme", in_brief(["light", "dark"], ["dark"]))
def test_the_page_is_readable_and_fits_a_phone(scheme, page, visit):
    browser = visit(page, color_scheme=scheme, width=360, height=740, device_scale_factor=2, is_mobile=True)
    browser.wait("live.steps() > 0")
    assert_readable(browser, 40)
    assert browser.run("[innerWidth, document.documentElement.scrollWidth]") == [360, 360]


@CLANG
@in_chromium
def test_axe_finds_nothing(page, visit):
    assert_accessible(visit, page)

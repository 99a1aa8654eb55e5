"""The cylinder in the browser: its WebAssembly in Chromium against Python, and how the page behaves."""

import ctypes
import re
import shutil
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from brief import in_brief
from page_checks import assert_accessible, assert_quiet, assert_readable, in_chromium, stands_alone

from pneumo import MODELS
from pneumo.equations.system import METHODS, step, system
from pneumo.errors import InputError
from pneumo.export import live
from pneumo.export.c_source import compiled
from pneumo.export.live import live_page, sources
from pneumo.export.printing import printed

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


SLIDER = re.compile(r'\["(\w+)", "[^"]*", "[^"]*", ([\d.e-]+), ([\d.]+), ([\d.]+), [\d.]+\]')


@pytest.mark.skipif(not shutil.which("cc"), reason="no C compiler is installed")
def test_every_corner_of_the_sliders_runs(plant, tmp_path):
    """The page's source in native code; small cylinders with the largest valve failed at steps of 1 ms."""
    files, systems = sources(plant, 1.35)
    (tmp_path / "live.so").write_bytes(
        compiled(["cc", "-std=c99", "-O2", "-shared", "-fPIC", "-I."], files, "live.so", ["-lm"])
    )
    code = ctypes.CDLL(str(tmp_path / "live.so"))

    def numbers(place, count, *of):
        place.restype = ctypes.POINTER(ctypes.c_double)
        return np.ctypeslib.as_array(place(*of), (count,))

    constants = [[constant.name for constant in printed(each).constants] for each in systems]
    known = [numbers(code.place_of_parameters, len(names), i) for i, names in enumerate(constants)]

    def put(name, value):
        for names, values in zip(constants, known, strict=True):
            if name in names:
                values[names.index(name)] = value

    found = SLIDER.findall((SOURCES / "live.js").read_text())
    limits = {name: [float(factor) * float(end) for end in ends] for name, factor, *ends in found}
    assert list(limits) == ["bore", "stroke", "M", "k_xu", "k_0", "n", "amplitude", "frequency"]
    amplitude, frequency = limits.pop("amplitude")[1], limits.pop("frequency")[1]
    t = np.arange(250) * H
    command = numbers(code.place_of_commands, len(t))
    pressures = numbers(code.place_of_pressures, 2 * len(MODELS))
    full = numbers(code.place_of_state, 6)
    code.advance.argtypes = ctypes.c_int, ctypes.c_double
    for corner in product(*limits.values()):
        values = dict(zip(limits, corner, strict=True))
        code.take_defaults()
        for name, value in values.items():
            put(name, value)
        for side in "AB":
            put(f"A_{side}", np.pi / 4 * values["bore"] ** 2)
        put("x_min", -values["stroke"] / 2)
        put("x_max", values["stroke"] / 2)
        code.start()
        command[:] = amplitude * np.sign(np.sin(2 * np.pi * frequency * t))
        assert code.advance(len(t), H) == 0, values
        assert np.all(pressures > 0.0) and np.all(np.isfinite(pressures)), values
        assert np.all(full[2:] > 0.0) and abs(full[0]) <= values["stroke"] / 2, values


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

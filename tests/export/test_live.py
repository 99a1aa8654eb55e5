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
from paper_study import STUDY as PAPER

import pneumo
from pneumo import MODELS
from pneumo.configuration.sampling import INTERPOLATED
from pneumo.equations.system import step, system
from pneumo.errors import InputError
from pneumo.export import live
from pneumo.export.c_source import compiled
from pneumo.export.live import live_page, sources
from pneumo.export.printing import printed
from pneumo.physics.models import full_order_lane
from pneumo.simulation.replay import full_order_mse

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
    plants = {"D": plant, "E": PAPER.experiments["E11"].plant}
    text = live_page(plants, 1.35, SOURCES, dict.fromkeys(MODELS, ("#123456", "#abcdef")))
    file.write_text(text, encoding="utf-8")
    return file


def test_without_clang_the_reason_is_said(plant, monkeypatch):
    monkeypatch.setattr(live.shutil, "which", lambda _: None)
    with pytest.raises(InputError, match="clang: not installed, so that there is no page"):
        live_page({"D": plant}, 1.35, SOURCES, {})


@CLANG
def test_the_page_stands_alone(page):
    stands_alone(page.read_text())
    assert page.stat().st_size < 200_000


SLIDER = re.compile(r'\["(\w+)", "[^"]*", "[^"]*", ([\d.e-]+), ([\d.]+), ([\d.]+), [\d.]+\]')


@pytest.mark.slow
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
            area = np.pi / 4 * values["bore"] ** 2
            put(f"A_{side}", area)
            put(f"V_d_{side}", live.DEAD_PER_SWEPT * area * values["stroke"])
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
    command = 2.0 * np.sign(np.sin(25 * t)) + np.sin(90 * t)  # no step is halved
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
    P_0, T_0 = actuator.conditions.P_0, actuator.conditions.T_0
    full, models = system("full", None, actuator, piston=True), [system(name, N, actuator) for name in MODELS]
    state, pressures = [0.0, 0.0, P_0, T_0, P_0, T_0], [[P_0, P_0] for _ in models]
    squares = np.zeros(2 * len(models))
    for u in command.tolist():
        before = [u, *state[:2]]
        state = step(full, state, [u, 0.0], [u, 0.0], H)
        pairs = zip(models, pressures, strict=True)
        pressures = [step(model, P, before, [u, *state[:2]], H) for model, P in pairs]
        squares += (np.ravel(pressures) - np.tile([state[2], state[4]], len(models))) ** 2
    assert in_browser["good"]
    assert abs(state[0]) > 0.005  # it moved
    np.testing.assert_allclose(in_browser["state"], state, rtol=1e-3)
    np.testing.assert_allclose(in_browser["pressures"], np.ravel(pressures), rtol=1e-3)
    np.testing.assert_allclose(in_browser["squares"], squares, rtol=0.05)  # differences of pressures


SAMPLES = 1501


@pytest.fixture(scope="module")
def record(plant):
    """Signals by name, every H s, of a run with fast changes; noise on the pressures."""
    t = np.arange(SAMPLES) * H
    command = 4 * np.sign(np.sin(25 * t)) + 2 * np.sin(90 * t)
    run = pneumo.simulate(plant, H, command=command)
    noise = np.random.default_rng(5).normal(0, 300, (2, SAMPLES))
    return {"u": run.u, "x": run.x, "v": run.v, "P_A": run.P_A + noise[0], "P_B": run.P_B + noise[1]}


def csv(record, *, velocity=True, separator=",", names=None) -> str:
    """Text of a record's CSV file, every digit of its numbers."""
    columns = {"t": np.arange(len(record["u"])) * H} | record
    if not velocity:
        del columns["v"]
    rows = zip(*(values.tolist() for values in columns.values()), strict=True)
    head = separator.join(names or columns)
    body = "\n".join(separator.join(map(repr, row)) for row in rows)
    return f"{head}\n{body}\n"


@CLANG
@in_chromium
@pytest.mark.parametrize("velocity", in_brief([True, False], [False]))
def test_a_dropped_record_is_replayed_as_in_python(velocity, page, plant, record, visit):
    browser = visit(page)
    browser.run(PAUSE)
    signals = {name: record[name] for name in ("u", "x", "v")}
    if not velocity:
        signals["v"] = np.gradient(record["x"], H)
    run = pneumo.recorded(plant, H, P_A=record["P_A"], P_B=record["P_B"], **signals)
    browser.run("Object.entries(live.layout.plants.D).forEach(([name, value]) => live.set(name, value))")
    browser.run(f"live.set('n', {N})")
    text = csv(record, velocity=velocity)
    pressures = np.array(
        browser.page.evaluate(
            "(text) => live.replay(readRecord(text), 2 ** live.rows.length - 1)"
            ".map((pair) => pair.map((P) => Array.from(P)))",
            text,
        )
    )
    for row, model in enumerate(MODELS.values()):
        expected = pneumo.replay(model, N if model.has_n else None, run)
        # By the polynomials of the fast kernel, and t of 15 digits in the file.
        np.testing.assert_allclose(pressures[row], [expected.P_A, expected.P_B], rtol=1e-8)
    states = run.recording.states.copy()
    states[:, [3, 5]] = plant.conditions.T_0
    states[0, [2, 4]] = plant.conditions.P_0
    full = full_order_mse(
        run.recording._replace(states=states), [full_order_lane(run.recording.plant.gas.gamma)], INTERPOLATED
    )[0]
    squares = np.sum((pressures[-1] - [record["P_A"], record["P_B"]])[:, 1:] ** 2, axis=1) / SAMPLES
    np.testing.assert_allclose(squares, full, rtol=1e-7)


@pytest.mark.slow
@CLANG
@in_chromium
def test_a_record_is_ranked_and_nothing_is_asked_of_a_network(page, plant, record, visit, tmp_path):
    browser = visit(page)
    file = tmp_path / "mine.csv"
    file.write_text(csv(record, separator=";").replace(".", ","), encoding="utf-8")
    browser.page.set_input_files("#file", file)
    browser.wait("document.body.dataset.ranked === 'mine.csv'")
    rows = browser.run(
        "[...document.querySelectorAll('#ranking tr')]"
        ".map((row) => [...row.cells].map((cell) => cell.textContent))"
    )
    assert rows[0][0] == "full order" and {row[0] for row in rows} == {"full order", *MODELS}
    both = [float(row[4]) for row in rows]
    assert both == sorted(both)
    run = pneumo.recorded(plant, H, **{name: values for name, values in record.items()})
    grid = [1 + 0.05 * i for i in range(9)]
    for name, n, A, B, _, _ in rows[1:]:
        model = MODELS[name]
        tried = {f"{i:.2f}": pneumo.replay(name, i, run).mse for i in grid} if model.has_n else {}
        mse = tried[n] if model.has_n else pneumo.replay(name, None, run).mse
        assert np.mean(mse) <= min((np.mean(each) for each in tried.values()), default=np.inf) * (1 + 1e-6)
        assert [float(A), float(B)] == pytest.approx(np.sqrt(mse) / 1e3, rel=0.006)  # three digits
    assert browser.run("document.getElementById('told').textContent").endswith("full order is nearest.")
    assert_quiet(browser, page)


@pytest.mark.slow
@CLANG
@in_chromium
@pytest.mark.parametrize(
    ("change", "told"),
    [
        (lambda text: text.replace("P_B", "pressure"), "column P_B is missing"),
        (lambda text: text.replace("0.003,", "abc,", 1), "row 5, column t: abc is not a number"),
        (lambda text: text.replace("0.003,", "0.0038,", 1), "row 5: t is not evenly spaced"),
        (lambda text: text[:40], "fewer than three samples"),
        (lambda text: "", "column t, u, x, P_A, P_B is missing"),
    ],
)
def test_a_file_that_is_no_record_is_one_line(change, told, page, record, visit, tmp_path):
    browser = visit(page)
    file = tmp_path / "bad.csv"
    file.write_text(change(csv(record)), encoding="utf-8")
    browser.page.set_input_files("#file", file)
    browser.wait("document.getElementById('told').className === 'bad'")
    assert told in browser.run("document.getElementById('told').textContent")
    assert browser.run("document.getElementById('result').hidden")


@pytest.mark.slow
@CLANG
@in_chromium
def test_the_address_holds_cylinder_and_command(page, visit):
    browser = visit(
        page, "#bore=32&stroke=275&M=5&k_xu=1&k_0=0.5&n=1.2&amplitude=3&frequency=2&shape=sine&model=M7"
    )
    chosen = browser.run("['preset', 'shape', 'drawn'].map((id) => document.getElementById(id).value)")
    assert chosen == ["E", "sine", "M7"]
    assert browser.run("['A_A', 'V_d_A', 'M'].map(live.get)") == pytest.approx(
        [np.pi / 4 * 0.032**2, PAPER.experiments["E11"].plant.cylinder.V_d_A, 5.0], rel=1e-12
    )
    browser.run("document.getElementById('bore').focus()")
    browser.press("ArrowRight")
    assert "bore=33&stroke=275" in browser.run("location.hash")
    swept = np.pi / 4 * 0.033**2 * 0.275
    assert browser.run("live.get('V_d_A')") == pytest.approx(live.DEAD_PER_SWEPT * swept)
    assert browser.run("document.getElementById('preset').value") == "own"
    browser.page.select_option("#preset", "D")
    assert browser.run("live.get('V_d_B')") == PAPER.experiments["E09"].plant.cylinder.V_d_B
    assert "bore=20&stroke=100" in browser.run("location.hash")
    nonsense = visit(page, "#bore=x&stroke=&M=1e9&shape=round&model=M99")
    assert nonsense.run("['A_A', 'stroke', 'M'].map(live.get)") == pytest.approx(
        [np.pi / 4 * 0.02**2, 0.1, 20]
    )
    assert nonsense.console == []


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
    tops = browser.run(
        "['cylinder', 'errors', 'sliders'].map((id) => document.getElementById(id))"
        ".map((part) => part.getBoundingClientRect().top)"
    )
    assert tops == sorted(tops)  # the cylinder first


@pytest.mark.slow
@CLANG
@in_chromium
def test_axe_finds_nothing(page, visit):
    assert_accessible(visit, page)
    assert_accessible(visit, page, "document.getElementById('result').hidden = false")

"""First strokes: against SciPy on equations written again, and in `pneumo simulate`."""

import math

import numpy as np
import pandas as pd
import paper_equations as paper
import pytest
import xarray as xr
from bad_input import assert_one_line
from exported_c import C_COMPILER, CompiledModel
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from valve_paths import BASE

import pneumo
from pneumo.configuration.parameters import Sources, load, plant_of, study
from pneumo.runs import STARTS, State
from pneumo.selection.plants import configured_plant


@pytest.fixture
def mine(inside, tmp_path):
    """Plant of the template, untouched, beside its file my.yaml."""
    inside("init", "my.yaml")
    return configured_plant(study(load(tmp_path / "my.yaml")))


def iso_6358(C, b, P_u, P_d, T_u):
    """Mass flow of a sonic conductance C, m^3/(s Pa), by the standard's formula."""
    choked = C * 1.185 * P_u * math.sqrt(293.15 / T_u)
    return choked if P_d / P_u <= b else choked * math.sqrt(1 - ((P_d / P_u - b) / (1 - b)) ** 2)


def through_two(C_1, C_2, b, P_u, P_d, T_u):
    """Mass flow through two restrictions, from the pressure between them at which both flows are equal."""

    def excess(P):
        return iso_6358(C_1, b, P_u, P, T_u) - iso_6358(C_2, b, P, P_d, T_u)

    return iso_6358(C_2, b, brentq(excess, P_d, P_u, xtol=1e-6, rtol=1e-12), P_d, T_u)


def stroke_by_scipy(C, plant, y_0, end, throttles=(None, None), spring=(0.0, 0.0), rtol=1e-7):
    """Arrival time and speed at the end of the stroke, and highest T_A, by Radau: first held, then moving.

    `throttles` are conductances at the ports for the air that leaves, `spring` is a preload and a rate.
    """
    c, s, R, gamma = plant.cylinder, plant.conditions, 287.0, 1.4
    outward, way = y_0[0] < 0, math.copysign(1, end)

    def chamber(supplied, area, V_d, x, v, P, T, throttle):
        P_port = s.P_s if supplied else s.P_atm
        m_in = iso_6358(C, 0.3, P_port, P, s.T_in) if P_port > P else 0.0
        m_out = 0.0
        if P_port < P:
            m_out = (
                through_two(throttle, C, 0.3, P, P_port, T) if throttle else iso_6358(C, 0.3, P, P_port, T)
            )
        V = V_d + area * (c.stroke / 2 + x)
        A_q, A_q0 = (math.pi * c.bore * (c.bore / 2 + c.stroke / 2 + at) for at in (x, 0.0))
        surroundings = s.T_amb, s.T_in, s.P_0, s.T_0, gamma, R
        return paper.full_order(P, T, V, area * v, m_in, m_out, *surroundings, plant.k_0, A_q, A_q0)

    def net_force(y):
        x, v, P_A, _, P_B, _ = y
        pressed = P_A * c.A_A - P_B * c.A_B - s.P_atm * (c.A_A - c.A_B)
        return pressed - spring[0] - spring[1] * (x + c.stroke / 2) - 60.0 * v - 10.0 * way

    def rates(_, y, moves):
        x, v, P_A, T_A, P_B, T_B = y
        of_A = chamber(outward, c.A_A, c.V_d_A, x, v, P_A, T_A, throttles[0])
        of_B = chamber(not outward, c.A_B, c.V_d_B, -x, -v, P_B, T_B, throttles[1])
        return [v, net_force(y) / 3.0 * moves, *of_A, *of_B]

    def breaks_away(_, y, moves):
        return way * net_force(y)

    def arrives(_, y, moves):
        return way * (y[0] - end)

    for event in (breaks_away, arrives):
        event.terminal, event.direction = True, 1
    options = {"method": "Radau", "rtol": rtol, "atol": rtol}
    held = solve_ivp(rates, (0, 5), y_0, events=breaks_away, args=(0,), **options)
    t, y = held.t[-1], held.y[:, -1]
    done = solve_ivp(rates, (t, 5), y, events=arrives, args=(1,), **options)
    return done.t[-1], abs(done.y[1, -1]), max(held.y[3].max(), done.y[3].max())


@pytest.mark.parametrize(
    "start, conductance", [("vented", 1.5), ("vented", 0.4), ("retracted", 1.5), ("extended", 4.0)]
)
def test_stroke_agrees_with_scipy_within_a_thousandth(mine, start, conductance):
    valve = mine.valve._replace(k_xu=mine.valve.k_xu * conductance / 1.5)
    plant, u = mine._replace(valve=valve), -10.0 if start == "extended" else 10.0
    run = pneumo.simulate(plant, 1e-3, command=np.full(1501, u), start=start)
    (stroke,) = run.strokes
    y_0 = np.array([run.x[0], 0.0, run.P_A[0], run.T_A[0], run.P_B[0], run.T_B[0]])
    time, speed, T_A = stroke_by_scipy(conductance * 1e-8, plant, y_0, math.copysign(0.08, u))
    assert stroke.time == pytest.approx(time, rel=1e-3)
    assert stroke.end_speed == pytest.approx(speed, rel=5e-3)
    assert stroke.distance == pytest.approx(math.copysign(0.16, u))
    until = run.t <= time
    assert run.T_A[until].max() == pytest.approx(T_A, abs=2.0)  # K; a peak between two samples


THROTTLES = {"throttle_A_dm3_per_sbar": 0.2, "throttle_B_dm3_per_sbar": 0.15}
DRIVES = [  # more keys of a cylinder, its rods in A and B, m, and the command, V
    (THROTTLES | {"rod_A_mm": 10.0, "spring_N_per_m": 500.0, "spring_preload_N": 20.0}, (0.01, 0.01), 10.0),
    ({"throttle_A_dm3_per_sbar": 0.5, "rod_mm": 0.0}, (0.0, 0.0), -10.0),
    ({"throttle_B_dm3_per_sbar": 1.5}, (0.0, 0.01), 10.0),  # as wide as the valve
    ({"spring_N_per_m": 1000.0}, (0.0, 0.01), 10.0),
]


@C_COMPILER
@pytest.mark.parametrize(("keys", "rods", "u"), DRIVES)
def test_stroke_with_throttles_spring_and_through_rod_agrees_with_scipy(keys, rods, u, tmp_path):
    """Runs and exported C; the two restrictions in series are solved for the pressure between them."""
    content = {"cylinders": {"mine": BASE["cylinders"]["mine"] | keys}}
    plant, end = plant_of(Sources(BASE | content).validated(), "open"), math.copysign(0.08, u)
    areas = [math.pi / 4 * (0.025**2 - rod**2) for rod in rods]
    assert pytest.approx(areas) == (plant.cylinder.A_A, plant.cylinder.A_B)
    run = pneumo.simulate(plant, 1e-3, command=np.full(1501, u), start="extended" if u < 0 else "retracted")
    y_0 = [run.x[0], 0.0, run.P_A[0], run.T_A[0], run.P_B[0], run.T_B[0]]
    throttles = [keys.get(key) and 1e-8 * keys[key] for key in THROTTLES]
    spring = keys.get("spring_preload_N", 0.0), keys.get("spring_N_per_m", 0.0)
    C = 1.5e-8 * abs(u) / 10
    time, speed, _ = stroke_by_scipy(C, plant, y_0, end, throttles, spring, rtol=1e-6)
    assert run.strokes[0].time == pytest.approx(time, rel=5e-3)
    assert run.strokes[0].end_speed == pytest.approx(speed, rel=1e-2)
    compiled, h = CompiledModel("full", None, plant, tmp_path, piston=True), 2e-4
    names, inputs, steps = ("x", "v", "P_A", "T_A", "P_B", "T_B"), [u, 0.0], 0
    state = [y_0[names.index(name)] for name in compiled.system.states]
    while state[0] != end and steps < 7500:
        failed, state = compiled.step(inputs, inputs, h, state)
        steps += 1
        assert not failed
    assert (steps - 0.5) * h == pytest.approx(time, rel=5e-3, abs=h / 2)


def test_after_the_stroke_the_chambers_rest_at_their_ports(mine):
    run = pneumo.simulate(mine, 1e-3, command=np.full(3001, 10.0), start="vented")
    assert run.P_A[-1] == pytest.approx(mine.conditions.P_s, abs=500)
    assert run.P_B[-1] == pytest.approx(mine.conditions.P_atm, abs=500)
    assert run.T_B[-1] == pytest.approx(mine.conditions.T_amb, abs=1)
    filled = run.P_A * (mine.cylinder.V_d_A + mine.cylinder.A_A * (0.08 + run.x)) / (287.0 * run.T_A)
    normal = (filled[-1] - filled[0]) * 287.0 * 273.15 / 101325 * 1e3
    assert run.strokes[0].air == pytest.approx(normal, rel=1e-6)
    leaking = mine._replace(valve=mine.valve._replace(leak=1e-9))
    more = pneumo.simulate(leaking, 1e-3, command=np.full(3001, 10.0), start="vented").strokes[0].air
    lost = 2 * 1e-9 * mine.gas.sonic_coefficient * 7e5 / 293.15**0.5 * 3.0  # both chambers' closed paths
    assert (more - normal) / (lost * 287.0 * 273.15 / 101325 * 1e3) == pytest.approx(1.0, abs=0.1)


CATALOGUE = [(bore, stroke) for bore in (32, 40, 50, 63, 80) for stroke in (50, 100, 160, 250, 320, 400)]


@pytest.mark.parametrize("exhaust", [0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 1.0])
def test_a_stroke_is_whole_whatever_rebounds_on_its_way(mine, exhaust):
    """Thirty sizes, and throttled exhausts, whose cushion of air throws the piston back."""
    rebounds = 0
    for bore, stroke in CATALOGUE if exhaust == 1.0 else [(25, 160)]:
        half, area = stroke / 2000, math.pi * (bore * 1e-3) ** 2 / 4
        cylinder = mine.cylinder._replace(x_min=-half, x_max=half, stroke=2 * half)
        if exhaust == 1.0:
            scale = area / cylinder.A_A
            cylinder = cylinder._replace(
                bore=bore * 1e-3,
                A_A=area,
                A_B=scale * cylinder.A_B,
                M=(bore / 10) ** 2,
                load=scale * cylinder.load,
            )
        k_xu = mine.valve.k_xu * (3.0 if exhaust == 1.0 else 1.0)
        plant = mine._replace(cylinder=cylinder, valve=mine.valve._replace(k_xu=k_xu, exhaust=exhaust))
        u = np.where(np.arange(6001) < 3000, 10.0, -10.0)
        run = pneumo.simulate(plant, 1e-3, command=u, start="vented")
        assert [s.distance for s in run.strokes] == pytest.approx([2 * half, -2 * half])
        for stroke_, since in zip(run.strokes, (0.0, 3.0), strict=True):
            first = (
                1e-3 * np.flatnonzero((run.x == math.copysign(half, stroke_.distance)) & (run.t > since))[0]
            )
            assert stroke_.switched == since and first - 1e-3 <= stroke_.arrives <= first + 1e-9
        rebounds += sum(s.rebounds for s in run.strokes)
        assert ("rebound" in repr(run)) == any(s.rebounds for s in run.strokes)
    assert rebounds > 0 or exhaust == 0.35  # too little throttled to turn the piston back


def test_names_of_starts_and_what_the_run_says(mine):
    for start, (end, P_A, P_B) in STARTS.items():
        run = pneumo.simulate(mine, 1e-3, command=np.zeros(11), start=start)
        assert (run.x[0], run.P_A[0], run.P_B[0]) == (
            end * 0.08,
            getattr(mine.conditions, P_A),
            getattr(mine.conditions, P_B),
        )
    toggled = np.where(np.arange(6001) % 1000 < 500, 10.0, -10.0)
    run = pneumo.simulate(mine, 1e-3, command=toggled, start="vented")
    assert len(run.strokes) == 12 and len(repr(run).splitlines()) <= 10
    assert "... and 8 more" in repr(run)
    of_four = pneumo.simulate(mine, 1e-3, command=toggled[:2001], start="vented")
    assert len(of_four.strokes) == 4 and "more" not in repr(of_four)
    assert [s.switched for s in run.strokes] == pytest.approx([0.5 * i for i in range(12)])
    data = run.to_xarray()
    assert data["P"].dims == ("t", "chamber") and data["P"].attrs["units"] == "Pa"
    np.testing.assert_array_equal(data["P"].sel(chamber="B"), run.P_B)
    assert len(run.plot().axes) == 5


def test_a_reduced_model_starts_where_the_run_starts(mine):
    run = pneumo.simulate(mine, 1e-3, command=np.full(501, 10.0), start="vented")
    for model in ("M1", "M8"):
        replayed = pneumo.replay(model, 1.35, run)
        assert (replayed.P_A[0], replayed.P_B[0]) == pytest.approx((101325.0, 101325.0))


@pytest.mark.parametrize(
    ("start", "words"),
    [
        ("upright", "vented"),
        (State(0.09, 0, 1e5, 293, 1e5, 293), "within the stroke"),
        (State(0.0, 0, -1e4, 293, 1e5, 293), "P_A = -10000"),
        (State(0.0, 0, 1e5, 293, 1e5, math.nan), "T_B"),
        (State(0.0, math.inf, 1e5, 293, 1e5, 293), "v = inf"),
    ],
)
def test_impossible_starts_are_refused(mine, start, words):
    with pytest.raises(pneumo.InputError, match=words):
        pneumo.simulate(mine, 1e-3, command=np.zeros(11), start=start)


def test_the_command_prints_the_stroke_and_writes_run_and_figure(inside, mine, tmp_path):
    code, out, err = inside("simulate", "my.yaml", "--from", "vented", "--command", 10, "-o", "run.nc")
    expected = pneumo.simulate(mine, 1e-3, command=np.full(3001, 10.0), start="vented")
    assert code == 0 and repr(expected) in out and not err
    with xr.open_dataset(tmp_path / "run.nc") as stored:
        np.testing.assert_array_equal(stored["x"], expected.x)
    assert (tmp_path / "run.svg").is_file() and (tmp_path / "run.png").is_file()
    code, out, _ = inside("simulate", "my.yaml", "--command", "10,-10@0.5", "--time", 1, "-o", "run.csv")
    assert code == 0 and out.count("stroke of") == 2
    record = pneumo.read_record(tmp_path / "run.csv", tmp_path / "my.yaml")
    np.testing.assert_allclose(record.P[0], pd.read_csv(tmp_path / "run.csv")["P_A_Pa"])
    inside(
        "simulate", "my.yaml", "--command", "run.csv", "--time", 1, "-o", "again.csv"
    )  # with units: t_s, u_V
    assert (tmp_path / "again.csv").read_bytes() == (tmp_path / "run.csv").read_bytes()
    code, out, _ = inside("simulate", "my.yaml", "--from", "rest", "--reference", "0,20@0.5", "--time", 1.5)
    assert code == 0 and "x: " in out
    pd.DataFrame({"t": [0, 0.5], "u": [10, 0]}).to_csv(tmp_path / "u.csv", index=False)
    assert inside("simulate", "my.yaml", "--command", "u.csv")[1].count("stroke of") == 1


@pytest.mark.parametrize(
    "options",
    [
        ("--from", "nowhere"),
        ("--command", "ten"),
        ("--command", "1@1"),
        ("--command", "1,2@0.5,3@0.2"),
        ("--command", "missing.csv"),
        ("--command", "1", "--reference", "1"),
        ("--time", "0"),
        ("--time", "1e9"),
        ("-o", "run.txt"),
        ("--reference", "10", "--gain", "0"),
    ],
)
def test_wrong_options_are_one_line_and_nothing_is_written(inside, mine, tmp_path, options):
    before = set(tmp_path.iterdir())
    done = inside("simulate", "my.yaml", *options)
    assert_one_line(done)
    assert set(tmp_path.iterdir()) == before

"""The compiled core: its types, its elementary functions, its equations, and what its boundary refuses."""

import math
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from checkout import ROOT, copy_checkout
from hypothesis import given
from hypothesis import strategies as st
from numpy.polynomial import Polynomial
from paper_study import STUDY, lasting
from readable_equations import E, chamber_rates, dormand_prince, full_order_rates, full_order_step

import pneumo.core as core
from pneumo.configuration.experiment import Drive, Plant
from pneumo.configuration.sampling import INTERPOLATED, Sampling
from pneumo.physics.cylinder import Cylinder, Side, chamber_of, volume
from pneumo.physics.models import MODELS, Lane, full_order_lane, lane, lane_array
from pneumo.physics.valve import Conditions, Gas, Valve, choked_flow, limited
from pneumo.simulation import polynomials
from pneumo.simulation.excitation import command
from pneumo.simulation.fitted_pressures import Inputs, pressures_of_sets
from pneumo.simulation.full_order import equilibrium, record, run
from pneumo.simulation.replay import replay_one_by_one
from pneumo.testing import plants

EPS = np.finfo(float).eps
TYPES = (Gas, Valve, Conditions, Cylinder, Plant, Drive, Lane)
HEADER = Path(core.__file__).with_name("maths.h").read_text(encoding="utf-8")


@pytest.mark.parametrize("kind", TYPES, ids=lambda kind: kind.__name__)
def test_structs_have_the_fields_of_the_named_tuples_in_their_order(kind):
    assert [name for name, _ in core.ffi.typeof(kind.__name__).fields] == list(kind._fields)


EXPONENTIAL = Polynomial([1 / math.factorial(k) for k in range(20)])
SERIES = {  # of the header's arrays, and where they hold
    "EXP": (EXPONENTIAL, (-polynomials.EXP_REACH, polynomials.EXP_REACH)),
    "LOG": (Polynomial([2 / (2 * k + 1) for k in range(20)]), (0.0, (3 - math.sqrt(8)) ** 2)),
}


@pytest.mark.parametrize("name", SERIES)
def test_polynomials_in_the_header_are_the_series(name):
    (listed,) = re.findall(rf"{name}\[\d+\] = \{{(.*?)\}}", HEADER, re.DOTALL)
    series, reach = SERIES[name]
    x = np.linspace(*reach, 101)
    found = Polynomial([float.fromhex(text) for text in listed.split(",")])(x)
    np.testing.assert_allclose(found, series(x), rtol=1e-14)
    assert f"EXP_REACH {polynomials.EXP_REACH}" in HEADER


@given(st.floats(min_value=5e-324, allow_infinity=False))
def test_logarithm_of_any_positive_number(x):
    # Near 1 the logarithm is a difference of a tabulated one and a remainder, up to twice as large as itself.
    assert core.lib.core_log(x) == pytest.approx(math.log(x), rel=4 * EPS, abs=0)


@given(st.floats(-745.0, 709.7))
def test_exponential_of_any_number(t):
    assert core.lib.core_exp(t) == pytest.approx(math.exp(t), rel=2 * EPS, abs=5e-324)


def test_elementary_functions_beyond_the_numbers():
    log, exp, power = core.lib.core_log, core.lib.core_exp, core.lib.core_pow
    assert (log(0.0), log(math.inf), exp(-800.0), exp(800.0)) == (-math.inf, math.inf, 0.0, math.inf)
    assert all(math.isnan(value) for value in (log(-1.0), log(math.nan), exp(math.nan), power(-1.0, 0.3)))
    assert (power(0.3, 0.0), power(0.3, 1.0), power(0.49, 0.5)) == (1.0, 0.3, 0.7)


@given(st.floats(1e-3, 1e3), st.floats(-3.0, 3.0))
def test_power(x, y):
    # The error of the logarithm is multiplied by y ln x, at most 21.
    assert core.lib.core_pow(x, y) == pytest.approx(x**y, rel=40 * EPS, abs=0)


@given(
    plants(),
    st.sampled_from([None, *MODELS.values()]),
    st.floats(-10.0, 10.0),
    st.floats(-0.9, 0.9),
    st.floats(-2.0, 2.0),
    st.floats(0.9e5, 12e5),
    st.floats(250.0, 350.0),
    st.sampled_from([0, 1]),
)
def test_rates_are_those_of_the_readable_equations(plant, model, u, at, v, P, T, side):
    c = plant.conditions
    x, sign, chamber = at * plant.cylinder.stroke / 2, Side(side).sign, chamber_of(plant.cylinder, side)
    row = full_order_lane(plant.gas.gamma) if model is None else lane(model, 1.2, plant.gas.gamma)
    arguments = sign * u, sign * x, sign * v, P
    wanted = chamber_rates(*arguments, T, chamber, plant, row)
    rates = np.empty(2)
    structs = core.struct("Plant", plant), core.struct("Lane", row)
    core.lib.chamber_rate(u, x, v, P, T, side, *structs, core.out(rates))
    # Where pressures are nearly equal, eq (1) loses digits: a rounding of 1e-16 of P moves the flow by 1e-8.
    near = min(abs(P / c.P_s - 1), abs(P / c.P_atm - 1))
    sizes = P, T
    for ours, theirs, size in zip(rates, wanted, sizes, strict=True):
        scale = abs(theirs) + size * (abs(v) / plant.cylinder.stroke + 100.0)
        assert abs(ours - theirs) <= scale * (1e-12 + 1e-15 / max(near, 1e-15) ** 0.5)


SHORT = record(lasting("E06", 0.02))
LANES = lane_array([lane(MODELS["M8"], 1.2, 1.4), full_order_lane(1.4)])


def sets(**change):
    inputs = Inputs(np.zeros((2, 3)), np.zeros((2, 3, 2)), SHORT.plant)._replace(**change)
    return [inputs], np.zeros(1, int), LANES[:1], np.full((1, 2), 1e-5), 1e-3, 1, np.full((1, 2), 5e5)


UNREADABLE = [
    *(
        (replay_one_by_one, SHORT._replace(**change), LANES, INTERPOLATED)
        for change in (
            {"states": SHORT.states[:, :5]},
            {"states": SHORT.states[:0]},
            {"u": SHORT.u[:-1]},
            {"reference": np.append(SHORT.reference, 0.0)},
            {"halvings": SHORT.halvings[:-1]},
            *({"halvings": np.full(len(SHORT.halvings), halvings)} for halvings in (31, -1, 257)),
            {"most_halvings": 64},
            {"most_halvings": -1},
            {"u": None},
        )
    ),
    *((replay_one_by_one, SHORT, lanes, INTERPOLATED) for lanes in (LANES[:, :9], LANES[0], LANES.T)),
    *((replay_one_by_one, SHORT, LANES, Sampling(every=every)) for every in (0, 2**40)),
    (core.array, "P", None, (None,)),
    (replay_one_by_one, SHORT, LANES, Sampling(delay=(np.nan, 0.0, 0.0))),
    (pressures_of_sets, *sets(motion=np.zeros((3, 3, 2)))),
    (pressures_of_sets, *sets(P_s=np.zeros((1, 3)))),
]


@pytest.mark.parametrize(("function", "arguments"), [(first, rest) for first, *rest in UNREADABLE])
def test_what_the_core_could_not_read_is_refused(function, arguments):
    with pytest.raises(ValueError, match=r"needed is|must be"):
        function(*arguments)


@given(st.sampled_from([np.float32, np.int64, np.float64]), st.booleans(), st.booleans())
def test_arrays_of_another_type_or_layout_give_the_same(dtype, transposed, strided):
    e = STUDY.experiments["E14"]
    reference = np.array([0.0, 1.0, -1.0, 0.0], dtype)
    given_one = np.repeat(reference, 2)[::2] if strided else reference
    start = np.asfortranarray(equilibrium(e.plant)) if transposed else equilibrium(e.plant)
    plain = run(equilibrium(e.plant), reference.astype(float), 0.0, e.drive, e.plant, e.h).states
    assert run(start, given_one, 0.0, e.drive, e.plant, e.h).states.tobytes() == plain.tobytes()


@given(st.lists(st.floats(), min_size=1, max_size=20), st.floats(), st.integers(0, 3))
def test_a_run_on_any_numbers_ends(reference, force, most):
    e = STUDY.experiments["E01"]
    done = run(equilibrium(e.plant), np.array(reference), force, e.drive, e.plant, e.h, most)
    assert done.states.shape == (len(reference), 6)


@given(st.floats(), st.floats(), st.floats())
def test_a_replay_of_any_signals_ends(u, x, v):
    signals = SHORT.states.copy()
    signals[5:, 0], signals[5:, 1] = x, v
    made = replay_one_by_one(SHORT._replace(u=np.full_like(SHORT.u, u), states=signals), LANES, INTERPOLATED)
    assert made.mse.shape == (2, 2)


@given(plants(), st.floats(-500.0, 500.0), st.floats(0.0, 400.0), st.sampled_from([-5.0, 0.0, 5.0]))
def test_a_run_is_that_of_the_readable_step(plant, force, coulomb, u):
    # From rest, where Coulomb friction holds the piston, or opposes the way on which a greater force sets it.
    plant = plant._replace(cylinder=plant.cylinder._replace(coulomb=coulomb))
    drive, h = Drive(closed_loop=False, k_p=0.0, x_reverse=np.inf, each_stage=False), 1e-4
    done = run(equilibrium(plant), np.full(4, u), force, drive, plant, h).states
    y = equilibrium(plant)
    for k in range(3):
        y = full_order_step(y, u, drive, plant, h, force)
        scale = np.array([plant.cylinder.stroke, 1.0, *y[2:]])
        if not np.isfinite(y).all() or not (y[2:] > 0).all():
            break
        # A rounding of 1e-16 of P changes eq (1) by 1e-8 of the choked flow where pressures are equal.
        np.testing.assert_allclose(done[k + 1] / scale, y / scale, rtol=0, atol=1e-9)


def coarse_run(factor=10):
    e = lasting("E06", 3.0)
    every = e.excitation.every // factor
    e = e._replace(h=factor * e.h, steps=e.steps // factor, most_halvings=6)
    return record(e._replace(excitation=e.excitation._replace(every=every)))


def far_from_ports(states, u, plant, h):
    """Whether h times the slope of the flow is below 1 at every stage, so that an explicit step is stable."""
    c, gas = plant.conditions, plant.gas
    for side in Side:
        chamber = chamber_of(plant.cylinder, side)
        P, T = np.array(states).T[2 + 2 * side.value :][:2]
        P_port = c.P_s if side.sign * u >= 0 else c.P_atm
        T_u, P_u = (c.T_in, P_port) if P_port > P[0] else (T[0], max(P_port, P[0]))
        m = choked_flow(plant.valve.k_xu * abs(u), P_u, T_u, gas)
        V = volume(side.sign * states[0][0], chamber, plant.cylinder)
        K = gas.gamma * gas.R * T_u * m / V * (2 / (1 - gas.critical_ratio) / P_u) ** 0.5
        if not min((P_port - P) * (1 if P_port > P[0] else -1)) >= (h * K) ** 2 / 4:
            return False
    return True


def test_a_run_halves_the_steps_whose_error_is_too_large_on_its_own_scale_and_no_others():
    r = coarse_run()
    c = r.plant.conditions
    scale = np.array([r.plant.cylinder.stroke, np.inf, c.P_0, c.T_0, c.P_0, c.T_0])
    largest, far = np.empty(len(r.halvings)), np.empty(len(r.halvings), bool)
    for k, state in enumerate(r.states[:-1]):

        def rates(y, _, k=k):
            return full_order_rates(y, r.reference[k], r.drive, r.plant)

        with np.errstate(invalid="ignore"):  # a stage of a step that is too large can have P < 0
            end, stages = dormand_prince(rates, state, r.h)
            K = np.array([rates(y, 0) for y in [*stages, end]])
        error = abs(r.h * E @ K) / scale
        largest[k] = error.max() if np.isfinite(error).all() and (end[2:] > 0).all() else np.inf
        u = limited(command(r.reference[k], state[0], r.drive), r.plant.valve.u_max)
        far[k] = far_from_ports([*stages, end], u, r.plant, r.h)
    clear, halved = (abs(largest / 1e-4 - 1) > 1e-6) & far, r.halvings > 0
    assert np.array_equal(halved[clear], (largest > 1e-4)[clear]) and halved.any() and not halved.all()


@pytest.mark.parametrize("edited", [False, True])
def test_a_checkout_takes_an_installed_core_of_the_same_sources_or_says_how_to_compile_one(edited, tmp_path):
    """`pip install .` compiles none in the checkout, whose `pneumo` Python imports when it starts there."""
    folder = copy_checkout(tmp_path / "checkout")
    for compiled in folder.glob("pneumo/core/_core*"):
        compiled.unlink()
    if edited:
        (folder / "pneumo/core/rates.h").write_text("/* another core */")
    code = "import pneumo.core as core; print(core.__file__, core.lib.core_exp(0.0))"
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
    )
    if edited:
        assert done.stderr.splitlines()[-1].endswith("type `pip install -e .` in this folder")
    else:
        assert done.stdout == f"{folder}/pneumo/core/__init__.py 1.0\n", done.stderr

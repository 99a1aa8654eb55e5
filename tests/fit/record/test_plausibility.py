"""Checks of a record's columns on either side of what they allow, and the numbers in their messages."""

import re
from pathlib import Path

import numpy as np
import pytest

from pneumo.errors import InputError
from pneumo.fit.record.columns import PRESSURE
from pneumo.fit.record.plausibility import COMMON, Samples, check_signals, check_time, check_velocity

SAMPLES = 200
T = 1e-3 * np.arange(SAMPLES)


def samples(**values):
    return Samples(Path("m.csv"), 2, values)


def signals(plant, **changes):
    """Signals of a piston in half of its stroke, between the atmosphere's pressure and the supply's."""
    wave, c = np.sin(20 * T), plant.conditions
    P = (c.P_atm + c.P_s) / 2 + 0.4 * (c.P_s - c.P_atm) * wave
    return {"u": wave, "x": 0.5 * plant.cylinder.stroke / 2 * wave, "P_A": P, "P_B": P[::-1]} | changes


def check(plant, from_end=False, closed=False, **changes):
    return check_signals(samples(**signals(plant, **changes)), plant, from_end, closed)


def refusal(call, *arguments, **options):
    with pytest.raises(InputError) as error:
        call(*arguments, **options)
    assert "\n" not in str(error.value)
    return str(error.value)


def test_a_measured_temperature_is_said_with_what_it_replaces(plant):
    (note,) = check(plant, T=np.full(SAMPLES, 301.0))
    c = plant.conditions
    configured = f"T_amb {c.T_amb:.4g} K and T_in {c.T_in:.4g} K"
    assert note == f"column T: 301 K on average, of the surroundings, in place of the configured {configured}"


def test_a_usual_record_has_no_notes(plant):
    assert check(plant) == [] and check_time(samples(t=T)) == (pytest.approx(1e-3, rel=1e-12), [])


@pytest.mark.parametrize(
    ("closed", "allowed", "refused"),
    [(False, (1.01e-5, 0.099), (0.99e-5, 0.101)), (True, (1.01e-5, 9.9), (0.99e-5, 10.1))],
)
def test_a_period_is_refused_outside_of_what_the_message_allows(closed, allowed, refused):
    for period in allowed:
        assert check_time(samples(t=1e3 * period * T), closed)[0] == pytest.approx(period, rel=1e-12)
    for period in refused:
        text = refusal(check_time, samples(t=1e3 * period * T), closed)
        assert f"{period:.3g} s apart" in text
        assert f"must be 1e-05 to {10 if closed else 0.1:g} s" in text


def test_a_period_may_be_as_short_or_long_as_the_message_says():
    for closed, periods in ((False, (1e-5, 0.1)), (True, (1e-5, 10.0))):
        assert [check_time(samples(t=np.array([0.0, h])), closed)[0] for h in periods] == [*periods]


def test_time_may_begin_anywhere_and_must_increase():
    assert check_time(samples(t=5.0 + T)) == (pytest.approx(1e-3, rel=1e-9), [])
    for again in (0.03, 0.049):  # back, and the same time twice
        t = np.where(np.arange(SAMPLES) == 50, again, T)
        text = refusal(check_time, samples(t=t))
        assert text == f"m.csv: line 52, column t: {again:g} s follows 0.049 s: time must increase"


def test_a_period_in_another_unit_is_asked_about_where_that_unit_would_be_right():
    assert refusal(check_time, samples(t=1e3 * T)).endswith("; is t in ms?")  # 1 ms read as 1 s
    assert refusal(check_time, samples(t=1e-3 * T)).endswith("; is t in s?")
    # 1,000 s is no period in ms either, and 0.1 ns none in s.
    assert refusal(check_time, samples(t=1e6 * T)).endswith("to 0.1 s")
    assert refusal(check_time, samples(t=1e-7 * T)).endswith("to 0.1 s")


def test_a_gap_is_more_than_two_missing_samples():
    def without(*numbers):
        return samples(t=np.delete(T, numbers))

    assert "not uniform" in check_time(without(50, 51))[1][0]
    text = refusal(check_time, without(50, 51, 52))
    assert "line 52, column t: a gap of 0.004 s after t = 0.049 s" in text and "more gap" not in text
    assert text.endswith("cut the file there and fit one part")
    several = refusal(check_time, without(50, 51, 52, 100, 101, 102, 150, 151, 152))
    assert several.startswith("m.csv: line 52,")
    assert several.endswith("cut the file there and fit one part; 2 more gaps")


def test_an_uneven_time_is_noted_with_its_largest_deviation_in_periods():
    late = np.where(np.arange(SAMPLES) == 100, 0.2e-3, 0.0)
    period, (note,) = check_time(samples(t=T + late))
    assert period == pytest.approx(1e-3, rel=1e-12)
    assert "deviate by up to 0.2 periods of 0.001 s" in note
    assert check_time(samples(t=T + 1e-3 * late))[1] == []  # 0.0002 of a period


@pytest.mark.parametrize("from_end", [False, True])
def test_a_position_outside_the_stroke_is_refused_with_the_span_in_its_own_coordinate(plant, from_end):
    half = plant.cylinder.stroke / 2
    span, shift = ((0, 2 * half), half) if from_end else ((-half, half), 0.0)
    x = signals(plant)["x"]
    beyond = np.where(np.arange(SAMPLES) == 17, 1.06 * half, x)
    text = refusal(check, plant, from_end, x=beyond)
    assert text.startswith(f"m.csv: line 19, column x: {1.06 * half + shift:.4g} m is outside the stroke")
    low, high = re.search(r"the stroke, (\S+) to (\S+) m", text).groups()
    assert (float(low), float(high)) == pytest.approx(span, rel=1e-5)
    assert check(plant, from_end, x=np.where(np.arange(SAMPLES) == 17, 1.04 * half, x)) == []


def test_a_position_outside_the_stroke_is_asked_about_its_origin_or_unit(plant):
    half, x = plant.cylinder.stroke / 2, signals(plant)["x"]
    assert refusal(check, plant, x=x + half).endswith("does it count from the end? --x-from end")
    for factor in (1e3, 10.0, 2.8):
        assert refusal(check, plant, x=factor * x).endswith("; is the unit right?")
    assert refusal(check, plant, x=x - half).endswith(" m")
    # The whole stroke from the end on, with a sensor that is a little off there, and motion about mid-stroke.
    for low, high, asked in ((-0.05, 1.85, "--x-from end"), (-0.5, 1.2, " m")):
        assert refusal(check, plant, x=half * np.linspace(low, high, SAMPLES)).endswith(asked)


def test_a_command_beyond_the_limiter_is_noted_with_its_part_of_the_time(plant):
    u = signals(plant)["u"].copy()
    u[:14] = 1.01 * plant.valve.u_max
    (note,) = check(plant, u=u)
    assert note == f"column u: beyond the limiter's {plant.valve.u_max:g} V in 7 % of samples; limited"
    assert check(plant, u=np.clip(u, -plant.valve.u_max, plant.valve.u_max)) == []


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_command_of_one_sign_is_refused_where_the_piston_goes_to_and_fro(plant, sign):
    half, u = plant.cylinder.stroke / 2, 5 + signals(plant)["u"]
    shown = sorted(sign * end for end in (u.min(), u.max()))
    text = refusal(check, plant, u=sign * u)
    assert f"column u: {shown[0]:.4g} to {shown[1]:.4g} V, of one sign" in text
    middle = f"{sum(shown) / 2:.2g}"
    assert f"shut at, say, {middle} V" in text and f"`offset: -{middle}`" in text
    # One way, or within a tenth of half the stroke, one sign may be right.
    for direction in (1.0, -1.0):
        assert check(plant, u=sign * u, x=direction * np.linspace(-half, half, SAMPLES)) == []
    assert check(plant, u=sign * u, x=0.05 * half * np.sin(200 * T)) == []
    flows = {"m_A": signals(plant)["u"], "m_B": signals(plant)["u"]}
    assert check(plant, u=sign * u, **flows) == []
    # A command that reaches zero without crossing it has one sign, too.
    assert "of one sign" in refusal(check, plant, u=sign * np.abs(signals(plant)["u"]))


def test_each_constant_signal_is_refused_in_open_chambers_alone(plant):
    for name in ("x", "P_A", "P_B", "u"):
        still = {name: np.full(SAMPLES, signals(plant)[name][7])}
        assert f"column {name}: " in refusal(check, plant, **still)
        assert f"column {name}: " in refusal(check_signals, samples(**signals(plant, **still)), plant, False)
        assert check(plant, closed=True, **still) == []
    flows = {"m_A": signals(plant)["u"], "m_B": np.full(SAMPLES, 1e-5)}
    assert "column m_B: 1e-05 in every sample" in refusal(check, plant, **flows)


@pytest.mark.parametrize(("T_mean", "right"), [(199.5, False), (200.5, True), (399.5, True), (400.5, False)])
def test_a_temperature_in_another_unit_is_refused(plant, T_mean, right):
    T_amb = np.full(SAMPLES, T_mean)
    if right:
        assert len(check(plant, T=T_amb)) == 1
    else:
        assert f"column T: {T_mean:.4g} K on average: must lie between 200 and 400 K" in refusal(
            check, plant, T=T_amb
        )


@pytest.mark.parametrize(
    ("low", "high", "right"),
    [(0.41, 1.59, True), (0.39, 1.0, False), (1.0, 1.61, False)],  # of the configured supply
)
def test_a_measured_supply_is_refused_outside_of_what_the_message_allows(plant, low, high, right):
    P_s = plant.conditions.P_s
    measured = P_s * np.linspace(low, high, SAMPLES)
    if right:
        (note,) = check(plant, P_s=measured)
        ends = f"{low * P_s / 1e3:.4g} to {high * P_s / 1e3:.4g} kPa"
        assert note == f"column P_s: {ends}, in place of the configured {P_s / 1e3:.4g} kPa"
    else:
        text = refusal(check, plant, P_s=measured)
        assert f"column P_s: {low * P_s:.4g} to {high * P_s:.4g} Pa: must lie between 0.4 and 1.6" in text


def test_a_pressure_is_refused_far_above_the_supply_and_far_below_the_atmosphere(plant):
    c, P = plant.conditions, signals(plant)["P_A"]
    assert check(plant, P_A=P * 1.1 * c.P_s / P.max()) == []
    high = P * 1.5 * c.P_s / P.max()
    text = refusal(check, plant, P_A=high)
    assert f"up to {np.percentile(high, 99):.4g} Pa, far above the supply's {c.P_s:.4g} Pa" in text
    assert check(plant, closed=True, P_A=high) == []
    low = P.copy()
    low[3] = 0.49 * c.P_atm
    text = refusal(check, plant, P_A=low)
    assert text.startswith(f"m.csv: line 5, column P_A: {low[3]:.4g} Pa is far below the atmosphere's")
    low[3] = 0.51 * c.P_atm
    assert check(plant, P_A=low) == []
    low[:20] = 0.8 * c.P_atm
    (note,) = check(plant, P_A=low)
    assert note.startswith(f"column P_A: down to {np.percentile(low, 1):.4g} Pa, below the atmosphere")
    low[:20] = 0.95 * c.P_atm
    assert check(plant, P_A=low) == []  # a sensor that is 5 kPa off


def test_one_sample_in_a_hundred_may_be_odd_and_not_three_in_two_hundred(plant):
    c = plant.conditions
    P = np.where(np.arange(SAMPLES) < 1, 2 * c.P_s, signals(plant)["P_A"])
    assert check(plant, P_A=P) == []
    P[:3] = 2 * c.P_s
    assert "far above" in refusal(check, plant, P_A=P)
    P[:3] = 0.8 * c.P_atm
    (note,) = check(plant, P_A=P)
    assert "below the atmosphere" in note


@pytest.mark.parametrize(
    ("P_s", "low", "high", "said"),  # in Pa; half of the samples are low, half high
    [
        # In kPa: a chamber at the atmosphere by a sensor that reads 5 to 10 % less, one above the supply.
        (7e5, 90.0, 95.0, "read in Pa; is it in kPa"),
        (7e5, 120.0, 840.0, "read in Pa; is it in kPa"),
        (7e5, 2.5e3, 7e3, "read in Pa; is it in mbar"),
        # At 60 bar, a hundredth of some pressures is possible as well as these.
        (6e6, 5.2e6, 5.8e6, ""),
        (6e6, 6.0e6, 7.2e6, ""),
        (6e6, 7.0e6, 1.5e7, "far above the supply's"),
        (6e6, 7.0e6, 2.1e7, "far above the supply's"),  # no unit is below Pa
        (6e6, 6.5e4, 7.0e4, "below the atmosphere: is it absolute"),
        (6e6, 3.8e4, 4.0e4, "is far below the atmosphere's"),
        (6e6, 2.8e4, 3.0e4, "read in Pa; is it in mbar"),
    ],
)
def test_another_unit_is_asked_about_only_where_it_would_be_right(plant, P_s, low, high, said):
    tested = plant._replace(conditions=plant.conditions._replace(P_s=P_s))
    P = np.where(np.arange(SAMPLES) % 2, high, low)
    columns = samples(**signals(tested, P_A=P))
    try:
        text = "; ".join(check_signals(columns, tested, False))
    except InputError as error:
        text = str(error)
    assert said in text and bool(text) == bool(said)


def test_every_unit_of_a_pressure_is_tried():
    assert {*COMMON} == {*PRESSURE}


@pytest.mark.parametrize(
    ("header", "truth", "factor"),
    [
        *(("Pa", "kPa", 1e3), ("Pa", "bar", 1e5), ("kPa", "bar", 100), ("kPa", "Pa", 1e3)),
        *(("bar", "kPa", 100), ("bar", "Pa", 1e5), ("bar(g)", "kPa", 100), ("barg", "kPa", 100)),
        *(("MPa", "bar", 10), ("bar(g)", "mbar", 1000), ("psi", "Pa", 6894.76)),
    ],
)
def test_a_pressure_in_another_unit_is_asked_about_with_the_headers_unit(plant, header, truth, factor):
    unit = header.removesuffix("(g)").removesuffix("g")
    zero = 0.0 if unit == header else plant.conditions.P_atm
    P = zero + PRESSURE[unit] / PRESSURE[truth] * (signals(plant)["P_B"] - zero)
    columns = samples(**signals(plant, P_B=P))._replace(units={"P_B": header})
    text = refusal(check_signals, columns, plant, False)
    assert text.endswith(f"it was read in {unit}; is it in {truth} (a factor of {factor:g})?")


def test_a_vented_chamber_by_a_gauge_is_in_no_other_unit(plant):
    P = plant.conditions.P_atm + np.abs(signals(plant)["u"])
    columns = samples(**signals(plant, P_B=P))._replace(units={"P_B": "bar(g)"})
    assert check_signals(columns, plant, False) == []


def test_pressures_far_below_the_supply_are_said_unless_a_chamber_reaches_a_quarter(plant):
    c, wave = plant.conditions, np.sin(20 * T)
    low = c.P_atm + 0.1 * (c.P_s - c.P_atm) * (1 + 0.1 * wave)  # gauges in MPa, read in bar
    (note,) = check(plant, P_A=low, P_B=low[::-1])
    assert note == (
        f"columns P_A and P_B: up to {np.percentile(low, 99) / 1e5:.3g} bar, but the supply has"
        f" {c.P_s / 1e5:.3g} bar (both absolute): is their unit right?"
    )
    assert check(plant, P_A=low) == [] and check(plant, P_B=low) == []  # the other is high
    assert check(plant, closed=True, P_A=low, P_B=low[::-1]) == []
    for part, notes in ((0.24, 1), (0.26, 0)):
        P = np.full(SAMPLES, c.P_atm + part * (c.P_s - c.P_atm)) + wave
        assert len(check(plant, P_A=P, P_B=P[::-1])) == notes
    # The supply as measured is higher than configured: a quarter of it is more.
    P = np.full(SAMPLES, c.P_atm + 0.26 * (c.P_s - c.P_atm)) + wave
    notes = check(plant, P_A=P, P_B=P[::-1], P_s=np.full(SAMPLES, 1.2 * c.P_s))
    assert any(f"supply has {1.2 * c.P_s / 1e5:.3g} bar" in note for note in notes)


@pytest.mark.parametrize("supply", [0.99, 1.0])  # over the atmosphere
def test_a_supply_not_above_the_atmosphere_is_refused(plant, supply):
    c = plant.conditions
    wrong = plant._replace(conditions=c._replace(P_s=supply * c.P_atm))
    P = c.P_atm * (1 + 0.01 * np.sin(20 * T))
    assert "must exceed P_atm" in refusal(check, wrong, P_A=P, P_B=P[::-1])


@pytest.mark.parametrize(("factor", "right"), [(0.7, False), (0.9, True), (1.15, True), (1.35, False)])
def test_a_velocity_is_compared_with_the_derivative_of_x(factor, right):
    x = 0.1 * np.sin(20 * T)
    values = samples(x=x, v=factor * 2.0 * np.cos(20 * T))
    if right:
        # The difference over 20 ms ends half a millisecond before the mean of 20 velocities: 1e-4 at most.
        (note,) = check_velocity(values, 1e-3)
        assert float(note.split()[2]) == pytest.approx(factor, rel=6e-3)  # three digits are written
    else:
        assert "column v: " in refusal(check_velocity, values, 1e-3)
    assert check_velocity(samples(x=x), 1e-3) == []


@pytest.mark.parametrize(("size", "period"), [(1e-4, 1e-3), (0.1, 0.05)])
def test_slow_motion_and_long_periods_are_compared_with_a_velocity_too(size, period):
    t = period * np.arange(SAMPLES)
    (note,) = check_velocity(samples(x=size * np.sin(2 * t), v=2 * size * np.cos(2 * t)), period)
    # Over a period h the mean of the velocity differs from the one at its begin by (w h)^2 / 12: 1e-3.
    assert float(note.split()[2]) == pytest.approx(1.0, abs=5e-3)


def test_noise_in_the_position_hardly_changes_the_comparison_with_a_velocity():
    """Noise of 1 mm is 1.4 m/s from sample to sample, as much as the motion, and 0.07 m/s over 20 ms."""
    x = 0.1 * np.sin(20 * T) + np.random.default_rng(1).normal(0.0, 1e-3, SAMPLES)
    (note,) = check_velocity(samples(x=x, v=2.0 * np.cos(20 * T)), 1e-3)
    # 200 samples with 5 % of noise: the slope is known to a per cent or so, and a square of 5 % is its bias.
    assert float(note.split()[2]) == pytest.approx(1.0, abs=0.05)

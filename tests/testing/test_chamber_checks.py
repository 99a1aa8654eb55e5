"""The checks of chamber models: what they accept, and the physical mistakes that they notice."""

from pathlib import Path

import pytest
import textbook_chamber
from brief import in_brief
from hypothesis import Phase, settings
from paper_study import STUDY

from pneumo import MODELS
from pneumo.errors import InputError
from pneumo.testing import check_model, model_checks
from pneumo.testing.chamber_checks import DERANDOMISED

TEXT = Path(textbook_chamber.__file__).read_text(encoding="utf-8")
# (text, what stands there instead), of mistakes that people make.
MUTANTS = [
    ("(c.T_amb - T)", "(T - c.T_amb)"),  # sign of the wall heat, as printed in the paper
    ("sqrt(P * T / (c.P_0 * c.T_0)) * (c.T_amb - T)", "c.T_amb - T"),  # the conductance multiplies T_amb only
    ("m_out * T)\n    dP", "m_out * c.T_in)\n    dP"),  # air leaves at T_in
    ("m_in * c.T_in - m_out * T)\n", "m_in * T - m_out * T)\n"),  # air enters at T
    ("dead + area", "area"),  # no dead volume
    ("H = g * R / (g - 1)", "H = R / (g - 1)"),  # internal energy for enthalpy: gamma on the wrong term
    ("H = g", "H = 2 * g"),  # factor of 2 in the enthalpy
    ('cylinder.A_A if side == "A" else cylinder.A_B', 'cylinder.A_B if side == "A" else cylinder.A_A'),
    (
        'cylinder.V_d_A if side == "A" else cylinder.V_d_B',
        "cylinder.V_d_A",
    ),  # dead volume of the wrong chamber
    ("** (g / (g - 1))\n    ratio", "** (1 / (g - 1))\n    ratio"),  # exponent of the critical ratio
    ("ratio ** (2 / g)", "ratio ** (1 / g)"),  # exponent of the flow
    ("(cylinder.stroke / 2 + x)\n    dV", "(cylinder.stroke + x)\n    dV"),  # x from the end of the stroke
    ("u, x, v = -u, -x, -v", "u, x = -u, -x"),  # sign of B's velocity
    ("u, x, v = -u, -x, -v", "x, v = -x, -v"),  # sign of B's command
    ("- P * dV_dt / V\n", "+ P * dV_dt / V\n"),  # sign of the work
    ("(H + Q - P * dV_dt) - P * dV_dt / V", "(H + Q - P * dV_dt)"),  # P dV/dt once for twice
    ("(g - 1) / V * (H + Q", "(g - 1) / V * (H + g * Q"),  # gamma on the wall heat
    ("dP_dt / P + dV_dt / V -", "dP_dt / P -"),  # temperature forgets the volume
    ("dm_dt = m_in - m_out", "dm_dt = m_in"),  # mass that never leaves
    ("mass_flow(throat, P, port, T, gas)", "mass_flow(throat, P, port, c.T_in, gas)"),  # outflow at T_in
    ("if port > P:", "if port > c.P_0:"),  # direction by the ports, not by the pressures
    ("P_d / P_u, critical", "P_u / P_d, critical"),  # ratio upside down
    ("R * T_u)", "R)"),  # flow without the temperature
    ("max(-u, 0)", "max(u, 0)"),  # exhaust opens with the supply
]


BRIEFLY = settings(derandomize=True, database=None, max_examples=5, phases=[Phase.generate])


def noticed(model, plant):
    """Whether any check fails; the first is enough, and its counterexample need not be small."""
    for check in model_checks(model, plant, settings=settings(DERANDOMISED, phases=[Phase.generate])):
        try:
            check()
        except AssertionError:
            return True
    return False


def mutant(old, new):
    assert TEXT.count(old) == 1, old
    names = {}
    exec(compile(TEXT.replace(old, new), "<mutant>", "exec"), names)  # noqa: S102 - the text above
    return names["rates"]


def test_a_textbook_chamber_passes(rod):
    report = check_model(textbook_chamber.rates, rod)
    assert not report.failed and not report.not_claimed, report


@pytest.mark.slow
def test_physical_mistakes_are_noticed(rod):
    missed = [(old, new) for old, new in MUTANTS if not noticed(mutant(old, new), rod)]
    assert len(missed) <= 1, missed


@pytest.mark.parametrize("model", in_brief(["full", *MODELS], ["full", "M1", "M9"]))  # M8: below
def test_every_model_passes_what_its_row_declares(model, rod):
    report = check_model(model, rod, 1.35)
    assert not report.failed, report


@pytest.mark.parametrize("check", model_checks(MODELS["M8"], STUDY.experiments["E01"].plant, 1.3), ids=str)
def test_checks_run_one_by_one_as_parameters_of_a_test(check):
    check()
    assert check.physics.endswith(".") and ": " in check.physics


def test_a_function_is_checked_for_what_it_reads_and_claims(rod):
    """A reduced model, with the features that it declares and without."""

    def isothermal(P, x, v, u):
        return textbook_chamber.isothermal(P, x, v, u, rod)

    declared = check_model(isothermal, rod, like="M1", settings=BRIEFLY)
    assert not declared.failed and {"choked inflow", "indices"} <= {*declared.passed}
    silent = check_model(isothermal, rod, settings=BRIEFLY)
    assert not silent.failed and {"choked inflow", "indices"} <= silent.not_claimed.keys()
    excused = {"compression": "a test"}
    doubled = check_model(
        lambda P, x, v, u: 2 * isothermal(P, x, v, u), rod, like="M1", not_claimed=excused, settings=BRIEFLY
    )
    assert "isothermal" in doubled.failed and "failed: indices: " in repr(doubled)
    assert doubled.not_claimed.items() >= excused.items() and "compression" not in doubled.failed


@pytest.mark.parametrize(
    ("result", "words"),
    [((1.0, 2.0), "1 finite"), (float("nan"), "1 finite"), (1j, "TypeError"), ("a", "Value")],
)
def test_what_is_no_rate_fails_every_check(result, words, rod):
    report = check_model(lambda P, x, v, u: result, rod, settings=BRIEFLY)
    assert not report.passed and all(words in text for text in report.failed.values())


@pytest.mark.parametrize(
    ("model", "options", "words"),
    [
        (lambda P, x, v: 0.0, {}, "must have P, x, v and u"),
        (lambda P, x, v, u, speed: 0.0, {}, "speed"),
        ("M99", {}, "no such model"),
        ("M5", {}, "needs a polytropic index"),
        ("M1", {"not_claimed": {"speed": ""}}, "no such check; there are rest"),
    ],
)
def test_models_and_checks_that_do_not_exist_are_refused(model, options, words, rod):
    with pytest.raises(InputError, match=words):
        check_model(model, rod, **options)

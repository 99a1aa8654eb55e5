"""`pneumo recommend`: the model for a cylinder at once, from the tree that random cylinders gave.

The tree travels with the package; `snakemake cylinders` makes it, and paper/decisions/0029 says how.
"""

import json
from collections.abc import Mapping, Sequence
from math import isfinite, pi
from pathlib import Path
from typing import Any, NamedTuple

from pneumo.configuration.experiment import Experiment, Plant
from pneumo.evidence.dimensionless import full_speed, groups, reversal_time
from pneumo.evidence.random_cylinders import AIR, SIZES, sizes
from pneumo.evidence.tree import Step, tightest, walk
from pneumo.physics.cylinder import volume
from pneumo.simulation.excitation import reference_series
from pneumo.simulation.settling import thermal_time_constant
from pneumo.storage.files import read_json

FILE = Path(__file__).parent / "recommendation.json"
PRINTED = 5e-3  # what rounding to three digits may have taken from the ends of a range
SHOWN = {  # sizes as they are told: factor from SI, unit
    "bore": (1e3, " mm"),
    "stroke": (1e3, " mm"),
    "rod_share": (1.0, ""),
    "P_s": (1e-5, " bar"),
    "lambda_0": (1.0, " W/(m² K)"),
}


class Advice(NamedTuple):
    """What the tree says of one experiment.

    Attributes
    ----------
    experiment, cylinder : str
    model : str
    n : float
        Best for runs like this one; a fit to a measurement is better.
    reasons : tuple of str
        The way to the leaf, in words and units.
    leaf : dict
        What is known of the leaf: ``runs`` and ``answers`` it was grown from, and ``held_out``.
    outside : tuple of str
        Where it lies outside what was sampled.
    groups : dict
        Every dimensionless group.
    """

    experiment: str
    cylinder: str
    model: str
    n: float
    reasons: tuple[str, ...]
    leaf: dict[str, Any]
    outside: tuple[str, ...]
    groups: dict[str, float]


def shipped() -> dict[str, Any]:
    """Read the tree that travels with the package."""
    return json.loads(read_json(FILE))


def told(step: Step, value: float, plant: Plant, time_constant: float, between: float) -> str:
    """Tell one answer on the way to a leaf.

    Parameters
    ----------
    step : Step
    value : float
        Of the step's group.
    plant : Plant
    time_constant : float
        Thermal time constant, s.
    between : float
        Mean time between reversals of the excitation, s.
    """
    c, conditions = plant.cylinder, plant.conditions
    air = 1e3 * conditions.P_0 * volume(0.0, c.A_A, c) / (plant.gas.R * conditions.T_0)
    force, u_max = conditions.P_0 * c.A_A, plant.valve.u_max
    if step.group == "closed":
        return "the loop is open" if step.below else "the loop is closed"
    words = {
        "thermal": f"the thermal time constant, {time_constant:.3g} s, is {value:.3g} times the"
        f" {between:.3g} s between reversals",
        "exchange": f"in a thermal time constant, {time_constant:.3g} s, the valve passes {value:.3g} times"
        f" the {air:.3g} g of air in a chamber",
        "breath": f"in the {between:.3g} s between reversals the valve passes {value:.3g} times the"
        f" {air:.3g} g of air in a chamber",
        "way": f"the way between reversals, {1e3 * value * c.stroke:.3g} mm, is {value:.3g} of the stroke",
        "command": f"the command expected, {value * u_max:.3g} V rms, is {value:.3g} of its limit, which"
        f" would give {full_speed(plant):.3g} m/s",
        "friction": f"friction, {value * force:.3g} N, is {value:.3g} of P_0 A, {force:.3g} N",
        "inertia": f"the force to reverse, {value * force:.3g} N, is {value:.3g} of P_0 A, {force:.3g} N",
        "stiffness": f"the mass on the air, {value / between / 2 / pi:.3g} Hz, swings by {value:.3g} rad in"
        f" the {between:.3g} s between reversals",
        "dead": f"the dead volume, {1e6 * c.V_d:.3g} cm³, is {value:.3g} of half the stroke's",
        "supply": f"the supply, {conditions.P_s / 1e5:.3g} bar, is {value:.3g} times the atmosphere",
    }
    side = "not above" if step.below else "above"
    return f"{words[step.group]}: {side} {step.threshold:g}"


def beyond(experiment: Experiment, found: dict[str, float], known: dict[str, Any]) -> tuple[str, ...]:
    """Where an experiment lies outside what was sampled."""
    plant, notes = experiment.plant, []
    for name, value in sizes(plant).items():
        low, high = known["sizes"][name]
        factor, unit = SHOWN[name]
        if not low * (1 - PRINTED) <= value <= high * (1 + PRINTED):
            ends = f"{factor * low:.3g} to {factor * high:.3g}{unit}"
            notes.append(f"{SIZES[name][1]} = {factor * value:.3g}{unit}: sampled was {ends}")
    for name, value in found.items():
        low, high = known["groups"][name]["range"]
        if not low * (1 - PRINTED) <= value <= high * (1 + PRINTED):
            notes.append(f"{known['groups'][name]['meaning']} = {value:.3g}: sampled was {low:g} to {high:g}")
    valve, c = plant.valve, plant.cylinder
    if plant.gas.elliptic or valve.leak or valve.laminar or valve.exhaust != 1:
        notes.append("valve: sampled were symmetric ones without leak and with the flow of eq (1)")
    if abs(c.load + (c.A_A - c.A_B) * plant.conditions.P_atm) > 1e-9 * plant.conditions.P_s * c.A_A:
        notes.append("constant force on the piston: sampled was none but the atmosphere's on a rod")
    if (plant.gas.R, plant.gas.gamma) != (AIR.R, AIR.gamma):
        notes.append("gas: sampled was air")
    return tuple(notes)


def advice(experiment: Experiment, known: dict[str, Any]) -> Advice:
    """Ask the tree about an experiment.

    Parameters
    ----------
    experiment : Experiment
    known : dict
        From `shipped`.
    """
    e, found = experiment, groups(experiment)
    way, leaf = walk(known["tree"], found)
    asked = tightest(way)
    time_constant = thermal_time_constant(experiment.plant)
    between = reversal_time(reference_series(e.drive, e.excitation, e.steps), e.h)
    reasons = tuple(told(step, found[step.group], experiment.plant, time_constant, between) for step in asked)
    outside = beyond(experiment, found, known)
    return Advice(e.name, e.cylinder, leaf["model"], leaf["n"], reasons, leaf, outside, found)


def as_json(found: Sequence[Advice]) -> str:
    """What `pneumo recommend --json` prints: a list; numbers that are not finite are null."""
    rows = [
        answer._asdict()
        | {"groups": {name: value if isfinite(value) else None for name, value in answer.groups.items()}}
        for answer in found
    ]
    return json.dumps(rows, indent=1, ensure_ascii=False, allow_nan=False)


def percent(values: Sequence[float]) -> str:
    """A share with its interval."""
    value, low, high = (f"{100 * v:.0f}" for v in values)
    return f"{value} % ({low} to {high})"


def in_words(answer: Advice) -> list[str]:
    """What is told of one experiment, line by line."""
    told = answer.leaf["held_out"]
    lines = [f"{answer.experiment} ({answer.cylinder}): take {answer.model}, n = {answer.n:g}"]
    lines += [f"  since {reason}" for reason in answer.reasons]
    if told["runs"]:
        lines.append(
            f"  right for {told['right']} of {told['runs']} such runs of cylinders held out; mean square"
            f" error there {told['cost']:.3g} times the best model's at this n (worst tenth: above"
            f" {told['cost_90_percent']:.3g}), {told['cost_at_best_n']:.3g} times with n fitted"
        )
    lines += [f"  OUTSIDE what was sampled: {note}" for note in answer.outside]
    return lines


def worth(known: Mapping[str, Any]) -> str:
    """What the whole tree is worth, beside the majority guess."""
    tree, majority = known["score"]["tree"], known["score"]["majority"]
    return (
        f"The tree is right in {percent(tree['right'])} of runs of {known['cylinders']['held_out']} cylinders"
        f" held out, always {majority['model']} in {percent(majority['right'])}; mean square error"
        f" {tree['cost'][0]:.3g} times the best model's, always {majority['model']}"
        f" {majority['cost'][0]:.3g} times. Judged against the full-order model, k_0 known; `pneumo study`"
        " runs the models on this very cylinder."
    )

"""The observer in Structured Text: a function block with one call a cycle, and its test program."""

from pneumo.equations.system import System
from pneumo.export.c_source import TEMPLATES
from pneumo.export.known_estimates import SAMPLE, known_estimates
from pneumo.export.observer_noise import CONSTANTS, FIRST_VARIANCES, OBSERVER_TOLERANCE, STEPS, ObserverNoise
from pneumo.export.printing import heading
from pneumo.export.st_parts import (
    TYPES,
    Cost,
    Unit,
    Variable,
    comparing_program,
    described,
    number,
    numbers,
    system_text,
)


def _call_cost(
    states: int, per_chamber: int, readings: int, chamber: Cost, piston: Cost, stops: Cost
) -> Cost:
    """Operations of one call of the observer, which corrects the estimate and predicts the next.

    `states` counts all states, `per_chamber` those of one chamber.
    """
    probes, N, lower = per_chamber + 4, states, states * (states + 1) // 2
    rates = chamber.times(2 * probes).plus(piston.times(2)).plus(stops)
    slopes = (
        Cost(1, 4 + 2 * per_chamber * (2 + per_chamber), 0, 0)
        if per_chamber == 1
        else Cost(2, 5 + 2 * per_chamber * (2 + per_chamber), 0, 0)
    )
    covariance = Cost(2 * N**3 + lower * N + 2 * N**2 + 2, 0, 0, 0)
    noise = Cost(2 + 4 + (5 if per_chamber == 2 else 0), 1 + (1 if per_chamber == 2 else 0), 0, 0)
    correction = Cost(1 + N + 2 * lower, N, 0, 0).times(readings)
    moved = Cost(2 + N * 2 + N, 0, 0, 0)  # dx, dP; the middle and the end of the step
    possible = Cost(2 * 2 * 3 * per_chamber, 0, 0, 0)
    total = rates
    for part in (slopes, covariance, noise, correction, moved, possible):
        total = total.plus(part)
    return total


def observer_block(system: System, noise: ObserverNoise, precision: str) -> Unit:
    """Function block in Structured Text that estimates a system's states by an extended Kalman filter."""
    text = system_text(system, precision, CONSTANTS)
    real, P_0 = text.real, system.plant.conditions.P_0
    zero = text.numbers([0.0])
    last, per_chamber = len(system.states) - 1, len(system.chamber_states)
    probes = per_chamber + 4  # the estimate; x, v and each state of a chamber moved; the middle of the step
    deviations = {"x": noise.x_deviation, "pressure": noise.pressure_deviation}
    inputs = [
        Variable("u", real, zero, f"{described('u')}; held since the call before"),
        Variable("force", real, zero, f"{described('force')}, where it is known"),
        *(Variable(f"{name}_read", real, zero, f"{described(name)}, reading") for name in noise.readings),
        *(Variable(f"{name}_valid", "BOOL", ("TRUE",)) for name in noise.readings),
        Variable("h", real, (text.number(SAMPLE),), "s, time since the call before"),
        Variable("restart", "BOOL", ("FALSE",), "begin at x_read and the pressures below"),
        *(Variable(f"P_{side}_start", real, text.numbers([P_0]), described(f"P_{side}")) for side in "AB"),
        Variable("force_noise", real, (text.number(noise.force),), "N s^0.5, process noise"),
        Variable(
            "pressure_noise", real, (text.number(noise.pressure),), "Pa/s^0.5, the first number to tune"
        ),
        *(
            Variable(f"{name}_deviation", real, (text.number(value),), "standard deviation of a reading")
            for name, value in deviations.items()
        ),
        *text.constants,
    ]
    outputs = [text.quantity(name) for name in system.states]
    outputs.append(Variable("failed", "BOOL", ("FALSE",), "no prediction was possible"))
    matrices = ("covariance", "slope", "advance", "product")
    own_variables = [
        Variable("state", real, last=(last,)),
        Variable("stage", real, last=(last,)),
        Variable("gain", real, last=(last,)),
        *(Variable(name, real, last=(last, last)) for name in matrices),
        Variable("rate", real, last=(probes - 1, last)),
        *(Variable(name, real) for name in ("dx", "dP", "most", "half", "total", "difference")),
        *[Variable("most_T", real)] * (per_chamber - 1),
        *(Variable(f"{name}_stage", real) for name in ("u", "force", "x", "v", "P_A", "P_B")),
        Variable("v_before", real),
        *text.variables(
            [*text.parts.valve, *text.parts.piston, *text.parts.stops],
            text.parts.chamber,
            (*system.chamber_states, "x", "v"),
            ("i", "j", "k", "probe", "side", "first"),
        ),
    ]
    known = {
        "states": system.states,
        "own_states": system.chamber_states,
        "temperature": per_chamber == 2,
        "readings": noise.readings,
        "probes": probes,
        "steps": {name: text.number(value) for name, value in STEPS.items()},
        "first": {name: text.number(value) for name, value in FIRST_VARIANCES.items()},
        "chambers": text.chambers,
        **text.statements,
        "heading": heading(system),
        "noise": noise,
        "real": real,
        "cost": _call_cost(len(system.states), per_chamber, len(noise.readings), *text.costs),
    }
    comment = TEMPLATES.get_template("observer_head.st.j2").render(known).rstrip()
    body = TEMPLATES.get_template("observer.st.j2").render(known).rstrip()
    declarations = {"VAR_INPUT": inputs, "VAR_OUTPUT": outputs, "VAR": own_variables}
    return Unit("FUNCTION_BLOCK", f"Pneumo_{system.name}_observer", comment, declarations, body)


def observer_program(system: System, noise: ObserverNoise, precision: str) -> Unit:
    """Test program in Structured Text that compares estimates of the function block with those in Python."""
    real, samples = TYPES[precision], known_estimates(system, noise)
    last, of_state = len(samples) - 1, len(system.states) - 1
    held = [0.0, *(s.u for s in samples[:-1])]  # since the call before
    arrays = [
        Variable("known_u", real, numbers(held, precision), last=(last,)),
        Variable(
            "known_readings",
            real,
            numbers((value for s in samples for value in s.readings), precision),
            last=(last, noise.pressures),
        ),
        Variable(
            "known_estimates",
            real,
            numbers((value for s in samples for value in s.estimate), precision),
            last=(last, of_state),
        ),
    ]
    known = {
        "states": system.states,
        "noise": noise,
        "h": number(SAMPLE, precision),
        "last": last,
        "tolerance": number(OBSERVER_TOLERANCE[precision], precision),
    }
    body = TEMPLATES.get_template("observer_test.st.j2").render(known).rstrip()
    block = f"Pneumo_{system.name}_observer", "observer"
    return comparing_program(system, precision, block, "estimates", arrays, body)

"""IEC 61131-3 Structured Text: a function block that steps, its test program, and both as PLCopen XML.

Only features of the second edition of the standard are used, neither methods nor user-defined types, so one
text serves every controller with function blocks.
"""

from importlib.metadata import version

from pneumo.equations.system import METHODS, System
from pneumo.errors import InputError
from pneumo.export.c_source import TEMPLATES
from pneumo.export.known_steps import known_steps
from pneumo.export.observer_noise import ObserverNoise
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
from pneumo.export.structured_text_observer import observer_block, observer_program
from pneumo.linear.linear_analysis import STABLE_RANGE, stable_steps

TOLERANCE = {"double": 1e-12, "float": 1e-4}  # of the test program, relative; as in C
COUNTERS = ("i", "j", "k", "side", "first", "place", "stages", "first_A", "first_b")
LISTS = {  # of PLCopen XML: element, and whether its variables are constant
    "VAR_INPUT": ("inputVars", False),
    "VAR_OUTPUT": ("outputVars", False),
    "VAR": ("localVars", False),
    "VAR CONSTANT": ("localVars", True),
}


def step_costs(system: System, chamber: Cost, piston: Cost, stops: Cost) -> dict[str, Cost]:
    """Operations of a step by each integration method, from those of a chamber, the piston and its stops."""
    states, inputs, costs = len(system.states), len(system.inputs), dict[str, Cost]()
    for name, method in METHODS.items():
        stages = len(method.b)
        below = stages * (stages - 1) // 2  # of the tableau's diagonal
        integration = states * (below + 2 * stages + 1) + inputs * stages
        costs[name] = chamber.times(2).plus(piston).times(stages).plus(stops).plus(Cost(integration, 0, 0, 0))
    return costs


def block(system: System, precision: str) -> Unit:
    """Function block in Structured Text that integrates a system."""
    text, c = system_text(system, precision), system.plant.conditions
    real, valve = text.real, bool(text.parts.valve)
    rest = system.state(x=0.0, v=0.0, opening=0.0, P=c.P_0, T=c.T_0)
    starts = dict(zip(system.states, map(float, rest), strict=True))
    methods, states, stages = METHODS.values(), len(system.states), max(len(m.b) for m in METHODS.values())
    inputs = [text.quantity(name) for name in system.inputs]
    inputs += [
        Variable("h", real, (text.number(1e-3),), "s, step"),
        Variable("solver", "INT", ("1",), ", ".join(f"{i} {name}" for i, name in enumerate(METHODS))),
        Variable(
            "interpolate", "BOOL", ("FALSE",), "inputs are linear from those of the last call, not held"
        ),
        Variable("restart", "BOOL", ("FALSE",), "take the state below; no step"),
        *(
            Variable(f"{name}_start", real, (text.number(starts[name]),), described(name))
            for name in system.states
        ),
        *text.constants,
    ]
    outputs = [text.quantity(name, starts[name]) for name in system.states]
    failed = "no such solver, or a volume, pressure or temperature that is not positive"
    outputs.append(Variable("failed", "BOOL", ("FALSE",), failed))
    chamber_names = [*system.chamber_states, "u" if system.valve else "m", "x", "v"]
    piston_names = [*(name for name in system.inputs if name not in ("x", "v")), "x", "v"]
    piston_names += ["P_A", "P_B"] * system.piston + ["opening"] * ("opening" in system.states)
    internal = [
        *(Variable(f"{name}_before", real) for name in system.inputs),
        Variable("state", real, last=(states - 1,)),
        Variable("stage", real, last=(states - 1,)),
        Variable("rate", real, last=(stages - 1, states - 1)),
        Variable("total", real),
        *(Variable(f"{name}_stage", real) for name in piston_names),
        *text.variables(chamber_names, COUNTERS),
    ]
    tableau = {
        "table_A": [a for m in methods for i in range(len(m.b)) for a in m.A[i, :i]],
        "table_b": [b for m in methods for b in m.b],
        "table_c": [node for m in methods for node in m.c],
    }
    constants = [
        Variable(name, real, text.numbers(values), last=(len(values) - 1,))
        for name, values in tableau.items()
    ]
    places, first_A, first_b = list[dict[str, int]](), 0, 0
    for m in methods:
        count = len(m.b)
        places.append({"stages": count, "first_A": first_A, "first_b": first_b})
        first_A, first_b = first_A + count * (count - 1) // 2, first_b + count
    known = {
        "inputs": system.inputs,
        "states": system.states,
        "own_states": system.chamber_states,
        "P_A": system.states.index("P_A"),
        "valve": system.valve,
        "opening": system.states.index("opening") if "opening" in system.states else None,
        "command": "u_valve" if valve else "u_stage",
        **text.statements,
        "methods": list(zip(METHODS, places, strict=True)),
    }
    comment = (
        TEMPLATES.get_template("head.st.j2")
        .render(
            heading=heading(system),
            costs=step_costs(system, *text.costs),
            range=STABLE_RANGE,
            stable={name: f"{h:.3g}" for name, h in stable_steps(system).items()},
            real=real,
        )
        .rstrip()
    )
    declarations = {"VAR_INPUT": inputs, "VAR_OUTPUT": outputs, "VAR": internal, "VAR CONSTANT": constants}
    body = TEMPLATES.get_template("block.st.j2").render(known).rstrip()
    return Unit("FUNCTION_BLOCK", f"Pneumo_{system.name}", comment, declarations, body)


def program(system: System, precision: str) -> Unit:
    """Test program in Structured Text that compares steps of the function block with those in Python."""
    real, stable = TYPES[precision], stable_steps(system)
    steps = known_steps(system, min(1e-4, stable["EULER"]))
    last = len(steps) - 1
    arrays = [
        Variable(
            f"known_{key}",
            real,
            numbers((value for step in steps for value in getattr(step, key)), precision),
            last=(last, len(getattr(steps[0], key)) - 1),
        )
        for key in ("start", "end", "before", "after")
    ]
    arrays += [
        Variable(
            "solvers", "INT", tuple(str(list(METHODS).index(s.method)) for s in steps), last=(len(steps) - 1,)
        ),
    ]
    known = {
        "inputs": system.inputs,
        "states": system.states,
        "h": number(steps[0].h, precision),
        "last": last,
        "tolerance": number(TOLERANCE[precision], precision),
    }
    body = TEMPLATES.get_template("test.st.j2").render(known).rstrip()
    return comparing_program(system, precision, (f"Pneumo_{system.name}", "model"), "steps", arrays, body)


def structured_text(
    system: System, stem: str, precision: str = "double", noise: ObserverNoise | None = None
) -> dict[str, str]:
    """Files of a system, by their names: function block, test program, and both as PLCopen XML.

    With `noise` the function block is an observer that assumes this noise.
    """
    name = system.name
    if "__" in name or name.endswith("_"):
        raise InputError(f"model name {name!r}: --to st: must not have two _ in a row, nor one at its end")
    if noise:
        units = observer_block(system, noise, precision), observer_program(system, noise, precision)
    else:
        units = block(system, precision), program(system, precision)
    text = TEMPLATES.get_template("unit.st.j2")
    xml = TEMPLATES.get_template("plcopen.xml.j2")
    return {
        f"{stem}.st": text.render(units[0]._asdict()),
        f"{stem}_test.st": text.render(units[1]._asdict()),
        f"{stem}.xml": xml.render(
            units=units,
            version=version("pneumo"),
            pou_types={"FUNCTION_BLOCK": "functionBlock", "PROGRAM": "program"},
            lists=LISTS,
            elementary=(*TYPES.values(), "INT", "BOOL"),
        ),
    }

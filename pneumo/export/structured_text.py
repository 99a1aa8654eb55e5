"""IEC 61131-3 Structured Text: a function block that steps, its test program, and both as PLCopen XML.

Only features of the second edition of the standard are used, neither methods nor user-defined types, so one
text serves every controller with function blocks.
"""

from importlib.metadata import version

from pneumo.equations.substep import LENGTHS, STAGE
from pneumo.equations.system import System
from pneumo.errors import InputError
from pneumo.export.c_source import TEMPLATES
from pneumo.export.known_steps import known_steps
from pneumo.export.observer_noise import ObserverNoise
from pneumo.export.printing import heading
from pneumo.export.st_parts import (
    TYPES,
    Unit,
    Variable,
    comparing_program,
    described,
    number,
    numbers,
    system_text,
)
from pneumo.export.structured_text_observer import observer_block, observer_program

TOLERANCE = {"double": 1e-12, "float": 1e-4}  # of the test program, relative; as in C
COUNTERS = ("i", "k", "side", "first")
LISTS = {  # of PLCopen XML: element, and whether its variables are constant
    "VAR_INPUT": ("inputVars", False),
    "VAR_OUTPUT": ("outputVars", False),
    "VAR": ("localVars", False),
    "VAR CONSTANT": ("localVars", True),
}


def block(system: System, precision: str) -> Unit:
    """Function block in Structured Text that integrates a system."""
    text, c = system_text(system, precision), system.plant.conditions
    real = text.real
    rest = system.state(x=0.0, v=0.0, opening=0.0, P=c.P_0, T=c.T_0)
    starts = dict(zip(system.states, map(float, rest), strict=True))
    states = len(system.states)
    inputs = [text.quantity(name) for name in system.inputs]
    inputs += [
        Variable("h", real, (text.number(1e-3),), "s, step"),
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
    failed = "h, a volume, a pressure or a temperature is not positive"
    outputs.append(Variable("failed", "BOOL", ("FALSE",), failed))
    valve, before, chamber, after, opened, pace = text.parts.substep
    outside = [*opened, *valve, *before, *after]
    assigned = {name for s in outside for name in s.names}
    openings = [name for name in system.states if name.startswith("opening")]
    piston_names = [name for name in system.inputs if name not in ("x", "v")]
    piston_names += ["x", "v", "P_A", "P_B"] * system.piston + openings
    places = ("x_middle", "v_middle", "x_last", "v_last", "x_mid", "v_mid", "x_end", "v_end")
    places += ("remaining", "length", "fastest")
    new = ("P_A_after", "P_B_after") * system.piston
    internal = [
        *(Variable(f"{name}_before", real) for name in system.inputs),
        Variable("state", real, last=(states - 1,)),
        Variable("stage", real, last=(states - 1,)),
        *(Variable(name, real) for name in (*places, *(name for name in new if name not in assigned))),
        *(Variable(f"{name}_stage", real) for name in piston_names),
        *text.variables(outside, [*chamber, *pace], (*system.chamber_states, "x", "v"), COUNTERS),
    ]
    known = {
        "inputs": system.inputs,
        "states": system.states,
        "own_states": system.chamber_states,
        "P_A": system.states.index("P_A"),
        "openings": openings,
        "chambers": text.chambers,
        **text.substep,
        "lengths": {name: text.number(value) for name, value in LENGTHS.items()},
        "stage": text.number(STAGE),
        "piston": system.piston,
    }
    comment = (
        TEMPLATES.get_template("head.st.j2")
        .render(
            heading=heading(system),
            cost=text.substep_cost,
            longest=f"{1e3 * LENGTHS['longest']:g}",
            shortest=f"{1e3 * LENGTHS['shortest']:g}",
            real=real,
        )
        .rstrip()
    )
    declarations = {"VAR_INPUT": inputs, "VAR_OUTPUT": outputs, "VAR": internal}
    body = TEMPLATES.get_template("block.st.j2").render(known).rstrip()
    return Unit("FUNCTION_BLOCK", f"Pneumo_{system.name}", comment, declarations, body)


def program(system: System, precision: str) -> Unit:
    """Test program in Structured Text that compares steps of the function block with those in Python."""
    real, steps = TYPES[precision], known_steps(system)
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

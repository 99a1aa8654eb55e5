"""IEC 61131-3 Structured Text: a function block that steps, its test program, and both as PLCopen XML.

Only features of the second edition of the standard are used, neither methods nor user-defined types, so one
text serves every controller with function blocks.
"""

import re
from importlib.metadata import version

from pneumo.equations.substep import LENGTHS, STAGE
from pneumo.equations.system import System
from pneumo.errors import InputError
from pneumo.export.known_steps import known_steps
from pneumo.export.printing import TEMPLATES, heading, printed
from pneumo.export.st_parts import (
    OF_CHAMBER,
    OF_CONSTANTS,
    OF_PISTON,
    TYPES,
    Text,
    Unit,
    Variable,
    described,
    lines,
    number,
    numbers,
)
from pneumo.physics.cylinder import Side

TOLERANCE = {"double": 1e-12, "float": 1e-4}  # of the test program, relative; as in C
LISTS = {  # of PLCopen XML: element, and whether its variables are constant
    "VAR_INPUT": ("inputVars", False),
    "VAR_OUTPUT": ("outputVars", False),
    "VAR": ("localVars", False),
    "VAR CONSTANT": ("localVars", True),
}


def block(system: System, precision: str) -> Unit:
    """Function block in Structured Text that integrates a system."""
    parts, real = printed(system), TYPES[precision]
    inside, outside = (Text(precision, OF_CONSTANTS | names) for names in (OF_CHAMBER, OF_PISTON))
    starts = dict(zip(system.states, numbers(system.at_rest, precision), strict=True))
    of_piston = {name: outside for name in ("valve", "before", "after", "opened")}
    known = {
        "inputs": system.inputs,
        "states": system.states,
        "own_states": system.chamber_states,
        "P_A": system.states.index("P_A"),
        "openings": system.openings,
        "chambers": {
            side.name: {
                inside.name(name): "-" * (sign < 0) + outside.name(outer)
                for name, (sign, outer) in system.flows(side).items()
            }
            | system.of_chambers[side.name]
            for side in Side
        },
        **{part: lines(of, of_piston.get(part, inside)) for part, of in parts.substep._asdict().items()},
        "lengths": {name: number(value, precision) for name, value in LENGTHS.items()},
        "stage": number(STAGE, precision),
        "piston": system.piston,
    }
    body = TEMPLATES.get_template("block.st.j2").render(known).rstrip()
    inputs = [
        *(Variable(name, real, (number(0.0, precision),), described(name)) for name in system.inputs),
        Variable("h", real, (number(1e-3, precision),), "s, step"),
        Variable(
            "interpolate", "BOOL", ("FALSE",), "inputs are linear from those of the last call, not held"
        ),
        Variable("restart", "BOOL", ("FALSE",), "take the state below; no step"),
        *(Variable(f"{name}_start", real, (start,), described(name)) for name, start in starts.items()),
        *(
            Variable(outside.name(c.name), real, (number(c.value, precision),), c.comment)
            for c in parts.constants
        ),
    ]
    failed = Variable(
        "failed", "BOOL", ("FALSE",), "h, a volume, a pressure or a temperature is not positive"
    )
    outputs = [*(Variable(name, real, (start,), described(name)) for name, start in starts.items()), failed]
    internal = [
        *(Variable(name, real, last=(len(system.states) - 1,)) for name in ("state", "stage")),
        Variable("started", "BOOL", ("FALSE",)),
        *(Variable(name, "INT") for name in ("i", "k", "side", "first")),
    ]
    declared = {variable.name for variable in (*inputs, *outputs, *internal)}
    assigned = dict.fromkeys(re.findall(r"^ *(\w+) :=", body, re.MULTILINE))
    internal += [Variable(name, real) for name in assigned if name not in declared]
    in_ms = {name: f"{1e3 * LENGTHS[name]:g}" for name in ("longest", "shortest")}
    comment = TEMPLATES.get_template("head.st.j2").render(heading=heading(system), **in_ms).rstrip()
    declarations = {"VAR_INPUT": inputs, "VAR_OUTPUT": outputs, "VAR": internal}
    return Unit("FUNCTION_BLOCK", f"Pneumo_{system.name}", comment, declarations, body)


def program(system: System, precision: str) -> Unit:
    """Test program in Structured Text that compares steps of the function block with those in Python."""
    real, steps, block = TYPES[precision], known_steps(system), f"Pneumo_{system.name}"
    last, of_state = len(steps) - 1, (len(system.states) - 1,)
    constants = [
        Variable(
            f"known_{key}",
            real,
            numbers((value for step in steps for value in getattr(step, key)), precision),
            last=(last, len(getattr(steps[0], key)) - 1),
        )
        for key in ("start", "end", "before", "after")
    ]
    constants.append(Variable("scale", real, numbers(system.scale, precision), last=of_state))
    variables = [
        Variable("model", block),
        Variable("passed", "BOOL", ("FALSE",), "all steps agree"),
        Variable("largest", real, comment="largest relative difference from Python"),
        Variable("failures", "INT", comment="calls that failed"),
        Variable("difference", real, last=of_state),
        *(Variable(name, "INT") for name in ("i", "k")),
    ]
    known = {
        "inputs": system.inputs,
        "states": system.states,
        "h": number(steps[0].h, precision),
        "last": last,
        "tolerance": number(TOLERANCE[precision], precision),
    }
    body = TEMPLATES.get_template("test.st.j2").render(known).rstrip()
    comment = f"Steps of {block} with known results, from Python in double precision: `passed` if all agree."
    return Unit("PROGRAM", f"{block}_test", comment, {"VAR": variables, "VAR CONSTANT": constants}, body)


def structured_text(system: System, stem: str, precision: str = "double") -> dict[str, str]:
    """Files of a system, by their names: function block, test program, and both as PLCopen XML."""
    name = system.name
    if "__" in name or name.endswith("_"):
        raise InputError(f"model name {name!r}: --to st: must not have two _ in a row, nor one at its end")
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

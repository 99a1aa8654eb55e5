"""Structured Text, parsed by blark and run on its syntax tree, against the right-hand side in Python."""

import math
import re
import xml.etree.ElementTree as ET
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from brief import in_brief
from plain_rates import OWN

from pneumo.equations.system import step, system
from pneumo.errors import InputError
from pneumo.export import exported
from pneumo.export.structured_text import block, program

pytest.importorskip("blark", reason="blark is not installed")
from structured_text import Block, parsed

pytestmark = pytest.mark.xdist_group("st")  # each text is parsed once, in seconds

N, H = 1.35, 1e-4
# Some hundred roundings of 1.1e-16 each; powers of another library differ by an ulp, which eq (1) amplifies.
ROUNDING = 1e-12


@cache
def _parsed(text):
    return parsed(text)


def loaded(model, plant, **options):
    """Test program of a model, and in it the function block."""
    texts = [content.decode() for content in exported(model, N, plant, "st", stem="m", **options).values()]
    block_unit, program_unit = _parsed(texts[0]), _parsed(texts[1])
    return Block(*program_unit, blocks=[block_unit])


def function_block(model, plant, **options):
    return loaded(model, plant, **options).values["model"]


# Each kind of statement once; the tests of C show that the systems are right in all combinations.
FORMS = [
    ("full", "double", 0, 0),
    ("full", "double", 1, 1),
    ("full", "float", 1, 1),
    (OWN, "double", 1, 1),
    ("M8", "double", 1, 0),
]


@pytest.mark.parametrize(("model", "precision", "valve", "piston"), in_brief(FORMS, [("M8", "double", 1, 0)]))
def test_the_test_program_agrees_with_python(model, precision, valve, piston, plant):
    """Inputs change during its steps."""
    st = loaded(model, plant, precision=precision, valve=bool(valve), piston=bool(piston))
    st()
    assert st["passed"] and st["failures"] == 0
    assert st["largest"] < (ROUNDING if precision == "double" else 1e-4)
    st.values["model"].values["a_a"] *= 1.2
    st()
    assert not st["passed"]


def test_steps_of_a_second_are_those_of_python(plant):
    """Held and interpolated inputs, one call a step."""
    st, chosen = function_block("M8", plant), system("M8", N, plant)
    signals = [
        [3 * math.sin(40 * k * H), 0.02 * math.sin(25 * k * H), 0.5 * math.cos(25 * k * H)]
        for k in range(301)
    ]
    for interpolate in (False, True):
        names, state = ("u", "x", "v"), [5e5, 4e5]
        first = dict(zip(names, signals[0], strict=True))
        st(**first, p_a_start=5e5, p_b_start=4e5, h=H, interpolate=interpolate, restart=True)
        for start, end in pairwise(signals):
            st(**dict(zip(names, end, strict=True)), restart=False)
            state = step(chosen, state, start if interpolate else end, end, H)
        np.testing.assert_allclose([st["P_A"], st["P_B"]], state, rtol=ROUNDING)


@pytest.mark.parametrize(
    "wrong", [{"p_a_start": -1.0}, {"p_b_start": math.nan}, {"x": -0.06}, {"x": math.nan}, {"h": -1.0}]
)
def test_a_step_that_cannot_be_made_says_so_and_leaves_the_state(wrong, plant):
    """A root of a negative number or a division by zero may stop a controller."""
    st = function_block("M8", plant)
    st(**({"u": 5.0, "v": 1.0, "p_a_start": 5e5, "p_b_start": 5e5, "h": H, "restart": True} | wrong))
    before = st["state"]
    st(restart=False)
    assert st["failed"] and np.array_equal(st["state"], before, equal_nan=True)
    st(u=0.0, x=0.0, v=0.0, p_a_start=5e5, p_b_start=5e5, h=H, restart=True)
    st(restart=False)
    assert not st["failed"]


# Keywords and functions of the standard, and what the manuals of Codesys and TwinCAT add.
RESERVED = set(
    re.findall(
        r"\w+",
        """
        ABS ACOS ACTION ADD ADR AND ANDN ANY ARRAY ASIN AT ATAN ATAN2 BEGIN BITADR BOOL BY BYTE CAL
        CALC CALCN CASE CEIL CHAR CLASS CONCAT CONFIGURATION CONSTANT CONTINUE COS CTD CTU CTUD D
        DATE DELETE DINT DIV DO DS DT DWORD ELSE ELSIF END EQ EXIT EXP EXPT EXTENDS F FALSE FINAL
        FIND FLOOR FOR FROM FUNCTION GE GOTO GT IF IMPLEMENTS INDEXOF INI INITIAL_STEP INSERT INT
        INTERFACE INTERNAL INTERVAL JMP JMPC JMPCN L LD LDATE LDN LDT LE LEFT LEN LIMIT LINT LN LOG
        LREAL LT LTIME LTOD LWORD MAX METHOD MID MIN MOD MOVE MUL MUX N NAMESPACE NE NON_RETAIN NOT
        NULL OF ON OR ORN OVERLAP OVERRIDE P PARAMS PERSISTENT POINTER PRIORITY PRIVATE PROGRAM
        PROPERTY PROTECTED PUBLIC R READ_ONLY READ_WRITE REAL REF REFERENCE REPEAT REPLACE RESOURCE
        RET RETAIN RETC RETCN RETURN RIGHT ROL ROR RS S SD SEL SHL SHR SIN SINGLE SINT SIZEOF SL
        SQRT SR ST STEP STN STRING STRUCT SUB SUPER T TAN TASK THEN THIS TIME TO TOD TOF TON TP
        TRANSITION TRUE TRUNC TYPE UDINT UINT ULINT UNION UNTIL USINT USING VAR WCHAR WHILE WITH
        WORD WSTRING XOR XORN
        """,
    )
)


@pytest.mark.parametrize("model", in_brief(["M1", "M8", "M10", "full"], ["M8"]))
@pytest.mark.parametrize(("valve", "piston"), [(True, False), (True, True), (False, False), (False, True)])
def test_names_are_what_controllers_accept(model, valve, piston, plant):
    """Letters, digits and single underscores; no keyword; no two that differ only by case."""
    unusual = plant._replace(
        valve=plant.valve._replace(leak=1e-8, exhaust=0.7, laminar=0.05),
        cylinder=plant.cylinder._replace(load=20.0, coulomb=15.0),
    )
    chosen = system(model, N, unusual, valve=valve, piston=piston)
    names = set[str]()
    for unit in (block(chosen, "double"), program(chosen, "double")):
        declared = [v.name for variables in unit.declarations.values() for v in variables]
        assert len({name.upper() for name in [*declared, unit.name]}) == len(declared) + 1
        for name in [*declared, unit.name]:
            assert re.fullmatch(r"[A-Za-z](_?[A-Za-z0-9])*", name) and len(name) <= 32, name
            assert name.upper() not in RESERVED, name
        used = set(re.findall(r"[A-Za-z_]\w*", re.sub(r"\(\*.*?\*\)|\d\.\d+E-?\d+", "", unit.body)))
        keywords = RESERVED | {"END_IF", "END_FOR", "END_CASE"}
        names |= set(declared)  # the program names inputs and outputs of the block
        assert used - keywords <= names and len(used) > 20


def test_plcopen_xml_has_the_declarations_and_statements_of_the_text(plant):
    files = {name: content.decode() for name, content in exported("M8", N, plant, "st", stem="m").items()}
    assert list(files) == ["m.st", "m_test.st", "m.xml"] and all(text.isascii() for text in files.values())
    space = {"p": "http://www.plcopen.org/xml/tc6_0200", "h": "http://www.w3.org/1999/xhtml"}
    pous = ET.fromstring(files["m.xml"]).findall(".//p:pou", space)
    for text, pou in zip((files["m.st"], files["m_test.st"]), pous, strict=True):
        assert pou.find("p:body/p:ST/h:xhtml", space).text in text
        lines = list[str]()
        for variable in pou.findall(".//p:variable", space):
            kinds = [
                e
                for e in variable.find("p:type", space).iter()
                if e.tag.split("}")[1] not in ("type", "baseType")
            ]
            last = [e.get("upper") for e in kinds if e.tag.endswith("}dimension")]
            kind = kinds[-1].get("name") or kinds[-1].tag.split("}")[1]
            values = [e.get("value") for e in variable.findall(".//p:simpleValue", space)]
            kind = f"ARRAY[{', '.join('0..' + i for i in last)}] OF {kind}" if last else kind
            initial = f" := {'[' * bool(last)}{', '.join(values)}{']' * bool(last)}" if values else ""
            lines.append(f"{variable.get('name')} : {kind}{initial};")
        declared = re.findall(r"^    (\w+ : [^;]*;)", text.partition("END_VAR\n\n")[0], re.MULTILINE)
        assert lines == declared and len(lines) > 10


@pytest.mark.parametrize("name", ["own_", "my__own"])
def test_names_that_controllers_refuse_are_refused(name, plant):
    with pytest.raises(InputError, match=name):
        exported(OWN._replace(name=name), N, plant, "st")
    assert exported(OWN._replace(name=name), N, plant, "c")


# The interpreter itself

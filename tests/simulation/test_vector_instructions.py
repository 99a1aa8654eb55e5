"""The fast kernel's machine code: vector instructions where the lanes are, whatever the compiler."""

import re
from collections import Counter

import numba
import pytest
from paper_study import lasting

from pneumo.simulation import vectorised as fast
from pneumo.simulation.full_order import record
from pneumo.simulation.grid import grid_lanes
from pneumo.simulation.replay import replay
from pneumo.simulation.signals import interpolated

E14 = lasting("E14", 0.02)
WIDE = re.compile(r"[yz]mm")  # registers of four or eight doubles


@pytest.fixture(scope="module")
def instructions() -> Counter[tuple[str, bool]]:
    """How often the compiled kernel has an instruction, and whether its registers are wide."""
    host = numba.core.codegen.get_host_cpu_features()
    if not {"+avx2", "+fma"} <= set(host.split(",")):
        pytest.skip("this processor has no AVX2 or no fused multiply-add")
    # A kernel from the cache cannot be inspected, so it is compiled here with the same options.
    options = {key: fast._replay.targetoptions[key] for key in ("nogil", "error_model", "fastmath")}
    compiled = numba.njit(**options)(fast._replay.py_func)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(fast, "_replay", compiled)
        lanes, _ = grid_lanes((1.0, 1.2), E14.plant.gas.gamma)
        replay(record(E14), lanes, interpolated())
    (text,) = compiled.inspect_asm().values()
    found = re.findall(r"^\s+(v\w+[ps]d)\s(.*)$", text, re.MULTILINE)
    return Counter((re.sub(r"\d{3}", "", name), bool(WIDE.search(operands))) for name, operands in found)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("pattern", "least"),
    [
        # The polynomials of the exponential, the logarithm and the flow have 28; sums come on top.
        ("vfn?m(add|sub)pd", 28),
        ("vdivpd", 1),  # of the logarithm
        ("vsqrtpd", 1),  # of the flow
    ],
)
def test_instructions_are_wide(instructions, pattern, least):
    found = instructions.items()
    assert sum(count for (name, is_wide), count in found if is_wide and re.fullmatch(pattern, name)) >= least

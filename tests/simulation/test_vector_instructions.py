"""The fast kernel's machine code: vector instructions where the lanes are, whatever the compiler."""

import re
from collections import Counter

import numba
import pytest
from paper_study import lasting

from benchmarks.probe import LOOPS, Operations
from pneumo.configuration.sampling import INTERPOLATED
from pneumo.simulation import vectorised as fast
from pneumo.simulation.full_order import record
from pneumo.simulation.grid import grid_lanes
from pneumo.simulation.replay import replay

E14 = lasting("E14", 0.02)
PACKED = re.compile(r"^\s+v(\w+?)\d*pd\s.*[yz]mm", re.MULTILINE)  # on registers of four or eight doubles
FUSED = {"add", "sub", "mul", "fmadd", "fmsub", "fnmadd", "fnmsub"}


@pytest.fixture(scope="module")
def loops() -> set[Operations]:
    """Operations of one pass of each innermost loop of the compiled kernel, per register of lanes."""
    host = numba.core.codegen.get_host_cpu_features()
    if not {"+avx2", "+fma"} <= set(host.split(",")):
        pytest.skip("this processor has no AVX2 or no fused multiply-add")
    # A kernel from the cache cannot be inspected, so it is compiled here with the same options.
    options = {key: fast._replay.targetoptions[key] for key in ("nogil", "error_model", "fastmath")}
    compiled = numba.njit(**options)(fast._replay.py_func)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(fast, "_replay", compiled)
        lanes, _ = grid_lanes((1.0, 1.2), E14.plant.gas.gamma)
        replay(record(E14), lanes, INTERPOLATED)
    (text,) = compiled.inspect_asm().values()
    counts = set()
    for label, block in re.findall(r"^(\.LBB\w+):\n(.*?)(?=^\.LBB|\Z)", text, re.MULTILINE | re.DOTALL):
        if re.search(rf"^\s+j\w+\s+{re.escape(label)}$", block, re.MULTILINE):
            names = Counter(PACKED.findall(block))
            counts.add(Operations(sum(names[name] for name in FUSED), names["div"], names["sqrt"]))
    return counts


@pytest.mark.slow
@pytest.mark.parametrize("name", LOOPS)
def test_operations_of_the_bound_are_those_of_the_machine_code(loops, name):
    assert LOOPS[name] in loops

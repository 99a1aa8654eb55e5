"""Change one number or operator at a time in a copy of the sources and see whether the tests notice.

``python -m tests.mutations physics/valve ...`` mutates pneumo/physics/valve.py with cosmic-ray and runs
tests/physics/test_valve.py for each mutant; prints the mutants that survive. Physics and kernels run
uncompiled.
"""

import json
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

from pneumo.storage.files import write_text
from tests.checkout import ROOT, copy_checkout

MOST_SURVIVE = 0.05  # of a module's mutants
UNCOMPILED = ("physics", "simulation")  # rooms of compiled functions; the fits of others take minutes without

CONFIGURATION = """
[cosmic-ray]
module-path = "pneumo/{module}.py"
timeout = 300
test-command = "{python} -m pytest -x -q -n0 -p no:cacheprovider tests/{room}/test_{name}.py {marked}"
distributor.name = "local"

[cosmic-ray.filters.operators-filter]
exclude-operators = [
    "core/RemoveDecorator",
    "core/ReplaceBinaryOperator_.*_(Mod|FloorDiv|Pow|RShift|LShift|BitXor|BitOr|BitAnd)",
    "core/ReplaceComparisonOperator_.*_(Is|IsNot)",
]
"""


def mutate(module: str, checkout: Path) -> dict[str, int]:
    """Mutate one module of a copy of the checkout; print the survivors and return the counts."""
    room, _, name = module.rpartition("/")
    marked = "-m uncompiled" if room == "simulation" else "-m 'not slow'"
    values = {"module": module, "python": sys.executable, "room": room, "name": name, "marked": marked}
    (checkout / "mutations.toml").write_text(CONFIGURATION.format(**values))
    environment = os.environ | {"PYTHONPATH": str(checkout)}
    if room in UNCOMPILED:
        environment["NUMBA_DISABLE_JIT"] = "1"

    def run(command: str) -> str:
        tool = [str(Path(sys.executable).with_name(command.split()[0])), *command.split()[1:]]
        return subprocess.check_output(tool, cwd=checkout, env=environment, text=True)

    run("cosmic-ray baseline mutations.toml")  # fails where the tests fail without a mutation
    run("cosmic-ray init --force mutations.toml session.sqlite")
    run("cr-filter-operators session.sqlite mutations.toml")
    run("cosmic-ray exec mutations.toml session.sqlite")
    print(run("cr-report --surviving-only --show-diff session.sqlite"), flush=True)
    outcomes = re.findall(r"test outcome: TestOutcome\.(\w+)", run("cr-report session.sqlite"))
    return {outcome.lower(): outcomes.count(outcome) for outcome in sorted(set(outcomes))}


def too_many(counts: dict[str, dict[str, int]]) -> list[str]:
    """Modules of whose mutants too many survive.

    Examples
    --------
    >>> too_many({"a": {"killed": 95, "survived": 5}, "b": {"killed": 9, "survived": 1}, "c": {"killed": 1}})
    ['b']
    """
    return [
        name
        for name, count in counts.items()
        if count.get("survived", 0) > MOST_SURVIVE * sum(count.values())
    ]


if __name__ == "__main__":
    with tempfile.TemporaryDirectory(prefix="mutations-") as folder:
        copy = copy_checkout(Path(folder, "pneumo"))
        counts = {module: mutate(module, copy) for module in sys.argv[1:]}
    write_text(json.dumps(counts, indent=1) + "\n", ROOT / "results/evidence/mutations.json")
    print(json.dumps(counts))
    if wrong := too_many(counts):
        sys.exit(f"more than {MOST_SURVIVE:.0%} survive in {', '.join(wrong)}")

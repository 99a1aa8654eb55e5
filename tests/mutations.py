"""Change one number or operator at a time in a copy of the sources and see whether the tests notice.

``python -m tests.mutations physics simulation/grid ...`` makes the mutants of a room or of one module with
cosmic-ray, and judges each by the fast tests of that room, those that name the module first. With
``--sample N`` N of each room's mutants are drawn at random. Every mutant has a process of its own, forked
from one that has imported the libraries. Kernels and physics run uncompiled.

A survivor that changes nothing a user sees is listed with its reason in `tests/mutants.yaml`. The exit code
is 1 where more than 5 % of a room's mutants survive without being listed there.
"""

import argparse
import json
import multiprocessing
import os
import random
import re
import resource
import signal
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from typing import NamedTuple

import yaml

from tests.checkout import ROOT, copy_checkout

MOST_SURVIVE = 0.05  # of a room's mutants
UNCOMPILED = ("physics", "simulation")  # rooms of compiled functions; the fits of others take minutes without
MARKED = {"simulation": "uncompiled"}  # its tests that are small enough; of the other rooms all fast ones
LIBRARIES = (
    "hypothesis",
    "numba",
    "netCDF4",
    "pandas",
    "pint",
    "pydantic",
    "pytest",
    "scipy.optimize",
    "xarray",
)
# In types, or hardly a mistake that anyone makes.
LEFT_OUT = re.compile(
    r"core/(RemoveDecorator|ReplaceBinaryOperator_BitOr_.*|ReplaceComparisonOperator_.*_(Is|IsNot)"
    r"|ReplaceBinaryOperator_.*_(Mod|FloorDiv|Pow|RShift|LShift|BitXor|BitOr|BitAnd))"
)
PROCESSOR, PATIENCE = 200, 1800  # seconds of processor, and in all, after which a mutant counts as killed


class Mutant(NamedTuple):
    """One change of a module."""

    module: str  # path below pneumo/
    line: int
    before: str  # the changed lines, stripped
    after: str
    text: str  # of the whole changed module

    @property
    def key(self) -> tuple[str, str, str]:
        """What a listed survivor has in common with it; its line may move."""
        return self.module, self.before, self.after


def mutants(modules: Sequence[Path], sample: int, seed: int) -> Iterator[Mutant]:
    """Mutants of modules of this checkout: all, or `sample` of them drawn at random."""
    from cosmic_ray.ast import ast_nodes, get_ast
    from cosmic_ray.mutating import mutate_code
    from cosmic_ray.plugins import get_operator, operator_names

    sources = {module: module.read_text(encoding="utf-8") for module in modules}
    made: list[tuple[Path, str, int]] = []
    for module, source in sources.items():
        nodes = list(ast_nodes(get_ast(source)))
        for name in sorted(operator_names()):
            if LEFT_OUT.fullmatch(name) or get_operator(name).arguments():
                continue
            places = sum(len(list(get_operator(name)().mutation_positions(node))) for node in nodes)
            made += [(module, name, place) for place in range(places)]
    if sample:
        made = random.Random(seed).sample(made, min(sample, len(made)))
    for module, name, place in made:
        before = sources[module].splitlines()
        text = mutate_code(sources[module], get_operator(name)(), place)
        after = text.splitlines()
        changed = [i for i, (old, new) in enumerate(zip(before, after, strict=False)) if old != new]
        lines = (" ".join(each[i].strip() for i in changed) for each in (before, after))
        yield Mutant(str(module.relative_to(ROOT / "pneumo")), changed[0] + 1, *lines, text)


def tests_of(module: str) -> tuple[list[str], list[str]]:
    """Test files of a module's room: those that name the module, and the others."""
    room, name = module.split("/")[0], Path(module).stem
    files = sorted((ROOT / "tests" / room).rglob("test_*.py"))
    near = [file for file in files if name in file.stem or name in file.read_text(encoding="utf-8")]
    near.sort(key=lambda file: file.stem != f"test_{name}")
    return tuple(
        [str(file.relative_to(ROOT)) for file in part] for part in (near, [f for f in files if f not in near])
    )


def _passes(checkout: Path, room: str, groups: Sequence[Sequence[str]], log: Path) -> bool:
    """Whether the tests pass in a copy of the checkout; this process is no good for anything else then."""
    import pytest

    os.chdir(checkout)
    sys.path[:0] = [str(checkout)]
    for name in [name for name in sys.modules if name.split(".")[0] in ("pneumo", "tests", "checkout")]:
        del sys.modules[name]
    options = ["-x", "-q", "-n0", "-p", "no:cacheprovider", "-m", MARKED.get(room, "not slow and not wheel")]
    with log.open("a") as out, redirect_stdout(out), redirect_stderr(out):
        return all(pytest.main([*options, *files]) in (0, 5) for files in groups if files)  # 5: no tests


def _start(checkout: Path, module: str, text: str | None, log: Path) -> int:
    """Start a process that judges a module's text; return its number."""
    room = module.split("/")[0]
    file = checkout / "pneumo" / module
    if text is not None:
        file.write_text(text, encoding="utf-8")
    if child := os.fork():
        return child
    code = 1
    try:
        resource.setrlimit(resource.RLIMIT_CPU, (PROCESSOR, PROCESSOR))
        signal.alarm(PATIENCE)
        code = 0 if _passes(checkout, room, tests_of(module), log) else 1
    finally:
        os._exit(code)


def judge(target: str, sample: int, seed: int, jobs: int, kept: set[tuple[str, str, str]]) -> dict[str, int]:
    """Judge the mutants of a room or module; print the survivors and return the counts."""
    path = ROOT / "pneumo" / target
    modules = sorted(path.rglob("*.py")) if path.is_dir() else [path.with_suffix(".py")]
    if target.split("/")[0] in UNCOMPILED:
        os.environ["NUMBA_DISABLE_JIT"] = "1"
    os.environ["PYTHONDONTWRITEBYTECODE"] = "1"
    sys.dont_write_bytecode = True  # two mutants of one size and second would share it
    for name in LIBRARIES:
        __import__(name)
    counts: Counter[str] = Counter(made=0, killed=0, listed=0, survived=0)
    with tempfile.TemporaryDirectory(prefix="mutations-") as folder:
        free = [copy_checkout(Path(folder, str(job), "pneumo")) for job in range(jobs)]
        log = Path(folder, "log")
        running: dict[int, tuple[Path, Mutant]] = {}
        child = _start(free[0], str(modules[-1].relative_to(ROOT / "pneumo")), None, log)
        if os.waitpid(child, 0)[1]:
            sys.exit(f"{target}: its tests fail without a mutation\n{log.read_text()[-2000:]}")

        def await_one() -> None:
            child, status = os.wait()
            checkout, mutant = running.pop(child)
            file = Path("pneumo", mutant.module)
            (checkout / file).write_text((ROOT / file).read_text(encoding="utf-8"), encoding="utf-8")
            free.append(checkout)
            outcome = "killed" if status else "listed" if mutant.key in kept else "survived"
            counts.update(["made", outcome])
            if outcome == "survived":
                lines = f"- {mutant.before}\n+ {mutant.after}"
                print(f"pneumo/{mutant.module}:{mutant.line}\n{lines}", flush=True)

        for mutant in mutants(modules, sample, seed):
            while not free:
                await_one()
            checkout = free.pop()
            running[_start(checkout, mutant.module, mutant.text, log)] = checkout, mutant
        while running:
            await_one()
    print(f"{target}: {dict(counts)}", flush=True)
    return dict(counts)


def too_many(counts: dict[str, dict[str, int]]) -> list[str]:
    """Rooms or modules of whose mutants too many survive.

    Examples
    --------
    >>> too_many({"a": {"made": 100, "survived": 5}, "b": {"made": 10, "survived": 1}, "c": {"made": 1}})
    ['b']
    """
    return [name for name, found in counts.items() if found.get("survived", 0) > MOST_SURVIVE * found["made"]]


def listed() -> set[tuple[str, str, str]]:
    """Mutants that are known to survive, for a reason."""
    content = yaml.safe_load((ROOT / "tests/mutants.yaml").read_text(encoding="utf-8"))
    return {(entry["module"], entry["before"], entry["after"]) for entry in content["survivors"]}


def main() -> None:
    """Judge each room or module in a process of its own and write the counts."""
    parser = argparse.ArgumentParser()
    parser.add_argument("targets", nargs="+")
    parser.add_argument("--sample", type=int, default=0, help="mutants of each target [all]")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=2)
    given = parser.parse_args()
    counts: dict[str, dict[str, int]] = {}
    for target in given.targets:
        with multiprocessing.get_context("fork").Pool(1) as pool:
            counts[target] = pool.apply(judge, (target, given.sample, given.seed, given.jobs, listed()))
    file = ROOT / "results/evidence/mutations.json"
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(json.dumps(counts, indent=1) + "\n", encoding="utf-8")
    if wrong := too_many(counts):
        sys.exit(f"more than {MOST_SURVIVE:.0%} survive in {', '.join(wrong)}")


if __name__ == "__main__":
    main()

"""Change one number or operator at a time in a copy of the sources and see whether the tests notice.

``python -m tests.mutations physics simulation/grid ...`` makes the mutants of a room or of one module with
cosmic-ray, and judges each by the fast tests of that room; a module that none of them names is judged by the
tests that name it, too. Tests that run the changed line come first, then those that name the module. With
``--sample N`` N of each room's mutants are drawn at random. Every mutant has a process of its own, forked
from one that has imported the libraries. Physics runs uncompiled; kernels that a mutant changes are compiled
anew, the others come from a cache.

A survivor that changes nothing a user sees is listed with its reason in `tests/mutants/`. The exit code
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
from bisect import bisect
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import redirect_stderr, redirect_stdout
from functools import partial
from itertools import accumulate, islice
from pathlib import Path
from typing import Any, NamedTuple

import yaml

from tests.checkout import ROOT, copy_checkout

MOST_SURVIVE = 0.05  # of a room's mutants
UNCOMPILED = ("physics",)  # its tests take seconds without a compiler
FIRST_SECONDS = 5.0  # that the tests take which come first
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
SLOWER, BUSY = (
    3,
    9,
)  # times the processor time without a mutation, and that time, after which a mutant is killed


First = dict[str, dict[str, list[str]]]  # fast tests that run a line, by module and line


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
        random.Random(seed).shuffle(made)
    drawn = (mutant for place in made if (mutant := _mutant(sources, *place)))
    return islice(drawn, sample or None)


def _mutant(sources: Mapping[Path, str], module: Path, name: str, place: int) -> Mutant | None:
    """Return a mutant; None where no test has to notice: no Python, or a zip without its check of lengths."""
    from cosmic_ray.mutating import mutate_code
    from cosmic_ray.plugins import get_operator

    before = sources[module].splitlines()
    text = mutate_code(sources[module], get_operator(name)(), place) or ""
    if text.replace("strict=False", "strict=True") == sources[module].replace("strict=False", "strict=True"):
        return None
    try:
        compile(text, module, "exec")
    except SyntaxError:
        return None
    after = text.splitlines()
    changed = [i for i, (old, new) in enumerate(zip(before, after, strict=False)) if old != new]
    old, new = (" ".join(each[i].strip() for i in changed) for each in (before, after))
    return Mutant(str(module.relative_to(ROOT / "pneumo")), changed[0] + 1, old, new, text)


def tests_of(module: str) -> tuple[list[str], list[str]]:
    """Test files for a module: those that name it, and the others of its room."""
    room, name = module.split("/")[0], Path(module).stem
    package = ".".join(("pneumo", *Path(module).parent.parts))
    naming = re.compile(rf"{package}\.{name}\b|from {package} import .*\b{name}\b")
    files = sorted((ROOT / "tests" / room).rglob("test_*.py"))
    near = [file for file in files if naming.search(file.read_text(encoding="utf-8"))]
    if not near:
        every = sorted((ROOT / "tests").rglob("test_*.py"))
        near = [file for file in every if naming.search(file.read_text(encoding="utf-8"))]
    near.sort(key=lambda file: file.stem != f"test_{name}")
    near, others = (
        [str(file.relative_to(ROOT)) for file in part] for part in (near, [f for f in files if f not in near])
    )
    return near, others


class Reached:
    """Plugin of pytest that records which tests run each line of a folder, and the seconds that they take."""

    def __init__(self, folder: Path) -> None:
        import coverage

        self.coverage = coverage.Coverage(data_file=None, config_file=False, source=[str(folder)])
        self.seconds: Counter[str] = Counter()

    def pytest_runtest_setup(self, item: Any) -> None:
        self.coverage.switch_context(item.nodeid)

    def pytest_runtest_logreport(self, report: Any) -> None:
        self.seconds[report.nodeid] += report.duration

    def first(self, root: Path) -> dict[str, dict[int, list[str]]]:
        """By path below `root` and line: the tests that run it, fastest first, of `FIRST_SECONDS` in all."""
        data, first = self.coverage.get_data(), dict[str, dict[int, list[str]]]()
        for file in data.measured_files():
            lines = first[str(Path(file).relative_to(root))] = {}
            for line, tests in data.contexts_by_lineno(file).items():
                fast = sorted(set(tests) & set(self.seconds), key=self.seconds.__getitem__)
                until = list(accumulate(self.seconds[test] for test in fast))
                lines[line] = fast[: bisect(until, FIRST_SECONDS)]
        return first


def _passes(checkout: Path, groups: Sequence[Sequence[str]], log: Path, *plugins: object) -> bool:
    """Whether the tests pass in a copy of the checkout; this process is no good for anything else then."""
    import pytest

    os.chdir(checkout)
    sys.path[:0] = [str(checkout)]
    for name in [name for name in sys.modules if name.split(".")[0] in ("pneumo", "tests", "checkout")]:
        del sys.modules[name]
    options = ["-x", "-q", "-n0", "-p", "no:cacheprovider", "-m", "not slow and not wheel"]
    with log.open("a") as out, redirect_stdout(out), redirect_stderr(out):
        return all(pytest.main([*options, *files], plugins) in (0, 5) for files in groups if files)  # 5: none


def _forked(seconds: int, judge: Callable[[], bool]) -> int:
    """Start a process that exits with 0 if `judge` is true within its time; return its number."""
    if child := os.fork():
        return child
    code = 1
    try:
        resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds))
        signal.alarm(BUSY * seconds)
        code = 0 if judge() else 1
    finally:
        os._exit(code)


def _unchanged(
    checkout: Path, modules: Sequence[str], log: Path
) -> tuple[dict[str, dict[str, list[str]]], int]:
    """Tests to run first by module and line, and seconds of processor of all tests; exit where one fails."""
    folder, found = checkout / "pneumo" / modules[0].split("/")[0], log.with_name("first.json")
    files = [file for each in zip(*map(tests_of, modules), strict=True) for part in each for file in part]

    def judged() -> bool:
        reached = Reached(folder)
        with reached.coverage.collect():
            good = _passes(checkout, [list(dict.fromkeys(files))], log, reached)
        found.write_text(json.dumps(reached.first(folder.parent)))
        return good

    _, status, used = os.wait4(_forked(10**5, judged), 0)
    if status:
        sys.exit(f"{modules[0]}: tests fail without a mutation\n{log.read_text()[-2000:]}")
    return json.loads(found.read_text()), round(used.ru_utime + used.ru_stime)


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
        os.environ["NUMBA_CACHE_DIR"] = folder + "/kernels"
        free = [copy_checkout(Path(folder, str(job), "pneumo")) for job in range(jobs)]
        log = Path(folder, "log")
        running: dict[int, tuple[Path, Mutant]] = {}
        names = [str(module.relative_to(ROOT / "pneumo")) for module in modules]
        first, seconds = _unchanged(free[0], names, log)

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
            (checkout / "pneumo" / mutant.module).write_text(mutant.text, encoding="utf-8")
            lines = first.get(mutant.module, {})
            line = max((line for line in lines if int(line) <= mutant.line), key=int, default="")
            groups = lines.get(line, []), *tests_of(mutant.module)
            child = _forked(SLOWER * seconds, partial(_passes, checkout, groups, log))
            running[child] = checkout, mutant
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


def survivors() -> list[dict[str, str]]:
    """Listed mutants: module, line before and after, and the reason."""
    rooms = (yaml.safe_load(file.read_text(encoding="utf-8")) for file in (ROOT / "tests/mutants").iterdir())
    return [{"module": module, **each} for room in rooms for module, lines in room.items() for each in lines]


def listed() -> set[tuple[str, str, str]]:
    """Mutants that are known to survive, for a reason."""
    return {(each["module"], each["before"], each["after"]) for each in survivors()}


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

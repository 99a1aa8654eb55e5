"""Search for failures: `make soak` runs this for SOAK_MINUTES (30) with pytest's arguments.

Property tests try 20 times their usual examples, new ones in every round, and modules and the tests in each
come in random order. A failing example is printed as the line that pins it. Ends with a round that fails.
"""

import ast
import os
import random
import re
import subprocess
import sys
import time

import pytest
from hypothesis import settings

TIMES = 20  # the usual number of examples
FAILING = re.compile(
    r"^(?:Failing test case|Falsifying example): (\w+\(\n.*?\n\))$", re.MULTILINE | re.DOTALL
)
SEED, END = (float(os.environ.get(name, "0")) for name in ("SOAK_SEED", "SOAK_END"))  # END: s since 1970


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(items):
    tests = {id(item.obj): item.obj for item in items if hasattr(item.obj, "hypothesis")}
    for test in tests.values():  # parameters share their test
        own = test._hypothesis_internal_use_settings
        more = settings(own, max_examples=TIMES * own.max_examples, derandomize=False, print_blob=True)
        test._hypothesis_internal_use_settings = more
    order = random.Random(SEED)
    modules = {item.module: order.random() for item in items}
    items.sort(key=lambda item: (modules[item.module], order.random()))


def pytest_runtest_setup(item):
    if time.time() > END:
        pytest.skip("the time of this soak is over")


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item, call):
    report = yield
    error = call.excinfo and call.excinfo.value
    for one in getattr(error, "exceptions", [error]):  # a group where there are several
        for found in FAILING.findall("\n".join(getattr(one, "__notes__", []))):
            report.sections.append(("to pin it", pinned(found, item.obj.hypothesis._given_kwargs)))
    return report


def pinned(example: str, given) -> str:
    """Line that pins an example that Hypothesis tells as a call; fixtures and parameters are left out."""
    if "=data(...)" in example:
        return "what is drawn from st.data() has no text: the line with @reproduce_failure above pins it"
    keywords = ast.parse(example, mode="eval").body.keywords
    return f"@example({', '.join(ast.unparse(word) for word in keywords if word.arg in given)})"


def main() -> int:
    """Run rounds with new seeds until time is over or one fails; return its exit code."""
    end = time.time() + 60 * float(os.environ.get("SOAK_MINUTES", "30"))
    code = 0
    while not code and time.time() < end:
        seed = random.SystemRandom().randrange(2**32)
        print(f"== soak: seed {seed}, {(end - time.time()) / 60:.0f} min left", flush=True)
        options = ["-p", "tests.soak", "--hypothesis-profile=random", f"--hypothesis-seed={seed}"]
        environment = os.environ | {"SOAK_SEED": str(seed), "SOAK_END": str(end)}
        command = [sys.executable, "-m", "pytest", *options, *sys.argv[1:]]
        code = subprocess.run(command, env=environment).returncode
    return code


if __name__ == "__main__":
    raise SystemExit(main())

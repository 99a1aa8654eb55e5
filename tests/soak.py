"""Plugin of `make soak`: property tests try 20 times their examples; after SOAK_END the rest is skipped."""

import os
import time

import pytest
from hypothesis import settings

TIMES = 20  # the usual number of examples
END = float(os.environ.get("SOAK_END", "inf"))  # s since 1970


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(items):
    tests = {id(item.obj): item.obj for item in items if hasattr(item.obj, "hypothesis")}
    for test in tests.values():  # parameters share their test
        usual = test._hypothesis_internal_use_settings
        more = settings(usual, max_examples=TIMES * usual.max_examples, derandomize=False, print_blob=True)
        test._hypothesis_internal_use_settings = more


def pytest_runtest_setup(item):
    if time.time() > END:
        pytest.skip("the time of this soak is over")

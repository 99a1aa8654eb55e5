"""Estimates, intervals and named causes of synthetic records are those that were accepted."""

import json

import numpy as np
import pytest
from contract.fit_cases import CASES, TABLE

ACCEPTED = {row.pop("case"): row for row in map(json.loads, TABLE.read_text(encoding="utf-8").splitlines())}
BRIEF = {"fit undisturbed 5", "fit unit", "closed held"}
IN_CI = {
    "fit undisturbed 3",
    "fit lag5",
    "fit null",
    "fit sags",
    "fit stroke",
    "fit swap",
    "fit skew",
    "fit mean",
    "fit play",
    "fit side",
    "fit M6 M8 M10",
    "closed leaking",
    "closed noise",
    "closed open B",
}
MARKS = {**dict.fromkeys(BRIEF, ()), **dict.fromkeys(IN_CI, pytest.mark.slow)}  # the others are nightly
MOVED = 0.1  # of half an interval, by which an estimate may move
WIDER = 0.1  # relative change of an interval's width
EXACT = 1e-4  # relative change of an estimate without an interval


def assert_like(found: list[float | None], accepted: list[float | None], name: str) -> None:
    """Assert that an estimate and the ends of its interval hardly differ from those accepted."""
    now, before = (np.array(numbers, dtype=float) for numbers in (found, accepted))
    assert (np.isnan(now) == np.isnan(before)).all(), (name, found, accepted)
    half = np.nanmax(np.abs(before[1:] - before[0])) if np.isfinite(before[1:]).any() else np.nan
    allowed = np.nan_to_num(MOVED * half, nan=100 * EXACT * abs(before[0]))
    assert abs(now[0] - before[0]) <= max(allowed, EXACT * abs(before[0])), (name, found, accepted)
    for end in (1, 2):
        if np.isfinite(before[end]):
            assert abs(now[end] - before[end]) <= (MOVED + WIDER) * half, (name, found, accepted)


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=MARKS.get(name, (pytest.mark.slow, pytest.mark.nightly))) for name in CASES],
)
def test_what_a_fit_finds_is_what_was_accepted(name):
    found, accepted = CASES[name](), ACCEPTED[name]
    assert found.get("refused") == accepted.get("refused")
    for key in ("causes", "warned"):
        assert found.get(key) == accepted.get(key), key
    assert found.get("models", {}).keys() == accepted.get("models", {}).keys()
    for model, parameters in accepted.get("models", {}).items():
        assert found["models"][model].keys() == parameters.keys()
        for parameter, numbers in parameters.items():
            assert_like(found["models"][model][parameter], numbers, f"{model}: {parameter}")


def test_intervals_of_the_accepted_fits_hold_the_truth():
    """Of the undisturbed records, whose models are those of the truth; 95 per cent intervals."""
    held: list[bool] = []
    for name, row in ACCEPTED.items():
        if not name.startswith("fit undisturbed"):
            continue
        for parameter, truth in row["truth"].items():
            _, low, high = row["models"]["full"][parameter]
            held.append((low is None or low <= truth) and (high is None or high >= truth))
    assert len(held) >= 20 and np.mean(held) >= 0.8

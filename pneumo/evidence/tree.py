"""A small decision tree as plain data: grown by scikit-learn, then walked and judged without it.

A node is ``{"group", "threshold", "below", "above"}``, where ``below`` is taken up to and with the
threshold; a leaf has ``model``, ``n`` and what is known of it. Thresholds have two digits, so that what is
printed is what decides.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

LEAVES, LEAST = 5, 20  # leaves at most, and runs in each at least
DIGITS = 2  # of a threshold
LINEAR = ("closed", "seen_stops", "seen_way")  # may be 0; the others are positive


class Step(NamedTuple):
    """One answer on the way to a leaf."""

    group: str
    below: bool
    threshold: float


def leaves(node: Mapping[str, Any], way: tuple[Step, ...] = ()) -> Iterator[tuple[tuple[Step, ...], Any]]:
    """Yield every leaf with the way to it, lowest side first."""
    if "group" not in node:
        yield way, node
        return
    for side in ("below", "above"):
        step = Step(node["group"], side == "below", node["threshold"])
        yield from leaves(node[side], (*way, step))


def walk(node: Mapping[str, Any], groups: Mapping[str, float]) -> tuple[tuple[Step, ...], Any]:
    """Find the leaf of a case, and the way to it.

    Parameters
    ----------
    node : mapping
        The tree.
    groups : mapping of str to float
        At least the groups that the tree asks for.
    """
    way: tuple[Step, ...] = ()
    while "group" in node:
        below = groups[node["group"]] <= node["threshold"]
        way = (*way, Step(node["group"], below, node["threshold"]))
        node = node["below" if below else "above"]
    return way, node


def tightest(way: Sequence[Step]) -> list[Step]:
    """The way without thresholds that a later one on the same side makes needless."""
    return list({(step.group, step.below): step for step in way}.values())


def places(node: Mapping[str, Any], groups: Mapping[str, np.ndarray]) -> np.ndarray:
    """Number of the leaf, in the order of `leaves`, of each of many cases."""
    found = np.full(len(next(iter(groups.values()))), -1)
    for number, (way, _) in enumerate(leaves(node)):
        inside = np.ones(len(found), dtype=bool)
        for step in way:
            inside &= (groups[step.group] <= step.threshold) == step.below
        found[inside] = number
    return found


def in_logs(name: str, values: np.ndarray) -> np.ndarray:
    """Values as the tree is grown on them: ratios by their logarithm."""
    return values if name in LINEAR else np.log10(values)


def grown(
    groups: Mapping[str, np.ndarray],
    answers: Sequence[str] | np.ndarray,
    leaf: Callable[[np.ndarray], Mapping[str, Any]],
) -> dict[str, Any]:
    """Grow a tree.

    Parameters
    ----------
    groups : mapping of str to numpy.ndarray
        Each of shape (cases,).
    answers : sequence of str
        Right answer of each case.
    leaf : callable
        Makes a leaf of the numbers of the cases that fall into it.

    Returns
    -------
    dict
        At most `LEAVES` leaves; the cases of a leaf are those that the rounded thresholds send there.
    """
    from sklearn.tree import DecisionTreeClassifier  # here, since answers need no scikit-learn

    names = list(groups)
    columns = np.stack([in_logs(name, np.asarray(groups[name], dtype=float)) for name in names], axis=1)
    fitted = DecisionTreeClassifier(max_leaf_nodes=LEAVES, min_samples_leaf=LEAST, random_state=0)
    t: Any = fitted.fit(columns, answers).tree_

    def node(i: int, cases: np.ndarray) -> dict[str, Any]:
        if t.children_left[i] < 0:
            return dict(leaf(cases))
        name, value = names[t.feature[i]], float(t.threshold[i])
        threshold = value if name in LINEAR else float(f"{10**value:.{DIGITS - 1}e}")
        below = groups[name][cases] <= threshold
        if below.all() or not below.any():  # rounding has put all on one side
            return node(t.children_left[i] if below.all() else t.children_right[i], cases)
        return {
            "group": name,
            "threshold": threshold,
            "below": node(t.children_left[i], cases[below]),
            "above": node(t.children_right[i], cases[~below]),
        }

    return node(0, np.arange(len(columns)))

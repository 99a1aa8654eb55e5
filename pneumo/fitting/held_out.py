"""Errors on the part held out against those on the part fitted: whether something changed, where and when.

The part held out may be followed worse than the part fitted, since parameters have intervals and what is
configured is known within its accuracy only. What exceeds that is a change of the rig or a lack of the model.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from pneumo.configuration.priors import Accuracy
from pneumo.fitting.configured_quantities import changes_of, configured_shifts
from pneumo.fitting.estimate import first_pressures
from pneumo.fitting.fit_problem import LIMITS, Problem, replayed_pressures
from pneumo.fitting.fit_result import Estimate, FitWarning
from pneumo.fitting.fit_warnings import moved_out
from pneumo.fitting.least_squares import Solution, covariances, inverse_curvature, solution_at
from pneumo.fitting.settings import ALLOWED, CHANGED
from pneumo.fitting.stage_signals import StageSignals
from pneumo.quantities.table import STARTS

WINDOW = 0.1  # s, over which an error is averaged to see when it begins
FEWEST = 5  # samples of a window
LEAST = 1e-4  # of P_s, as an error that nobody minds; records of simulations have no noise


class Parts(NamedTuple):
    """Both parts of a record at the parameters of a fit, each with its own first states."""

    problem: Problem  # the part fitted
    rest: Problem  # the part held out
    here: Solution  # of `problem`
    there: Solution  # of `rest`

    @property
    def shared(self) -> list[int]:
        """Places in `problem` of the parameters of both parts, in the order of `rest`."""
        return [self.problem.names.index(name) for name in self.rest.names if name not in STARTS]

    @property
    def own(self) -> np.ndarray:
        """Whether a parameter of `rest` is a first pressure or temperature."""
        return np.array([name in STARTS for name in self.rest.names])


def held_out_warnings(
    problem: Problem, record: StageSignals, estimate: Estimate, known: Accuracy
) -> list[str]:
    """Warning of a full order whose error on the part held out is far above that on the part fitted.

    It names chambers and times, and concerns the parameters that a fit of the whole `record` would move out
    of their intervals, or else all of the rig.
    """
    limits = CHANGED * np.maximum(estimate.rms, LEAST * problem.plant.conditions.P_s)
    if np.all(estimate.held_out <= limits):
        return []
    parts = both_parts(problem, record, estimate)
    limits = np.hypot(limits, ALLOWED * expected_error(parts, known))
    left, split = record.residual(replayed_on(problem, record, estimate)), problem.signals.P.shape[1] - 1
    errors: list[str] = []
    chambers = zip("AB", left, estimate.held_out, estimate.rms, limits, strict=True)
    for name, error, held_out, rms, limit in chambers:
        if not held_out <= limit:
            sizes = f"{held_out / 1e3:.3g} kPa rms ({rms / 1e3:.3g} on the part fitted)"
            errors.append(f"P_{name} is off by {sizes}, {_when(error, split, limit, record.period)}")
    text = (
        f"on the part held out {' and '.join(errors)}: the rig changed then, or the model lacks what acts"
        " there; look at the record there, or fit without that part"
    )
    return [FitWarning(text, *contradicted(parts, estimate))] if errors else []


def both_parts(problem: Problem, record: StageSignals, estimate: Estimate) -> Parts:
    """Residuals and derivatives of both parts of a record."""
    split = problem.signals.P.shape[1] - 1
    rest = replace(problem, signals=record.part(split, record.P.shape[1] - 1))
    shared = {name: value for name, value in estimate.values.items() if name not in STARTS}
    alone = replace(rest, fixed=shared, also=(), priors={})
    here = solution_at(problem, problem.inner(estimate.values))
    there = solution_at(rest, rest.inner(alone.values(first_pressures(alone))))
    return Parts(problem, rest, here, there)


def expected_error(parts: Parts, known: Accuracy, of_rest: Accuracy | None = None) -> np.ndarray:
    """Standard deviation of the error on the part held out, Pa, by chamber, beside noise and model.

    It is caused by the parameters' noise, and by configured quantities that are off within their accuracy,
    on the part held out within `of_rest` if it differs.
    """
    changes = changes_of(parts.problem, parts.here, known)
    moved, _ = configured_shifts(parts.problem, parts.here, changes, known)
    slopes, shared = parts.there.jacobian[..., ~parts.own], parts.shared
    shifts = np.tensordot(moved[: len(changes)][:, shared], slopes, axes=(1, 2))
    configured = _without_starts(parts, changes_of(parts.rest, parts.there, of_rest or known) - shifts)
    variance = np.sum(np.mean(configured**2, axis=2), axis=0) / LIMITS**2
    seen = _without_starts(parts, np.moveaxis(slopes, -1, 0))
    of_noise = [
        np.einsum("ics,ij,jcs->c", seen, matrix[np.ix_(shared, shared)], seen) / seen.shape[2]
        for matrix in covariances(parts.here)
    ]
    return parts.problem.plant.conditions.P_s * np.sqrt(variance + np.max(of_noise, axis=0))


def _without_starts(parts: Parts, errors: np.ndarray) -> np.ndarray:
    """Errors of the part held out, by (case, chamber, sample), with its first states fitted to each."""
    own, _ = np.linalg.qr(parts.there.jacobian[..., parts.own].reshape(-1, parts.own.sum()))
    flat = errors.reshape(len(errors), -1)
    return (flat - (flat @ own) @ own.T).reshape(errors.shape)


def contradicted(parts: Parts, estimate: Estimate) -> tuple[str, ...]:
    """Parameters that one step of a fit of the whole record would move out of their intervals."""
    problem, here, there = parts.problem, parts.here, parts.there
    count, starts = len(problem.names), int(parts.own.sum())
    before, after = (np.zeros((*part.residual.shape, count + starts)) for part in (here, there))
    before[..., :count] = here.jacobian
    after[..., parts.shared] = there.jacobian[..., ~parts.own]
    after[..., count:] = there.jacobian[..., parts.own]
    whole = Solution(
        theta=np.zeros(count + starts),
        residual=np.concatenate([here.residual, there.residual], axis=1),
        squares=here.squares + there.squares,
        prior=np.concatenate([here.prior, np.zeros(starts)]),
        derivatives=lambda: np.concatenate([before, after], axis=1),
    )
    # The part fitted is at its minimum, so the slope is that of the part held out.
    step = inverse_curvature(whole) @ np.tensordot(after, there.residual, axes=([0, 1], [0, 1]))
    return moved_out(problem, estimate, problem.named(here.theta + step[:count]))


def replayed_on(problem: Problem, record: StageSignals, estimate: Estimate) -> np.ndarray:
    """Pressures of the whole record, Pa, in one replay across the end of the part fitted.

    A prediction begins with pressures fitted to all of the part held out, so it errs before a change too. A
    record that is held out as a whole has no other.
    """
    split, result = problem.signals.P.shape[1] - 1, estimate.pressure.copy()
    last = next(last for _, last in record.pieces if split <= last)
    whole = replace(problem, signals=record.part(0, last))
    if whole.names == problem.names:
        result[:, : last + 1] = replayed_pressures(whole, whole.inner(estimate.values)[None])[0]
    return result


def _when(error: np.ndarray, split: int, limit: float, period: float) -> str:
    """Time from which, or in which, an error, Pa, exceeds its limit and all errors on the part fitted."""
    length = max(FEWEST, round(WINDOW / period))

    def sizes(part: np.ndarray) -> np.ndarray:
        """Root mean square of each window."""
        whole = len(part) // length * length
        return np.sqrt(np.mean(part[:whole].reshape(-1, length) ** 2, axis=1))

    after = sizes(error[split:])
    above = np.flatnonzero(~(after <= max(limit, sizes(error[:split]).max(initial=0.0))))
    first, last = (above[0], above[-1]) if len(above) else (0, len(after) - 1)
    begin, end = (period * (split + length * place) for place in (first, last + 1))
    if last == len(after) - 1:
        return f"from t = {begin:.3g} s on"
    return f"from t = {begin:.3g} to {end:.3g} s"

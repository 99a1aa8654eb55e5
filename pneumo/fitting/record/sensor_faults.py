"""Noise of a sensor, and faults that its samples show: an end of its range, values that no longer change."""

from typing import NamedTuple

import numpy as np

FEW = 5  # equal samples that chance gives at the largest value, or one after another
LONGEST_BY_CHANCE = 1e-6  # probability of a run of equal samples that is not chance
STOPPED = 50  # least number of equal samples of a channel that has stopped
THIRD_DIFFERENCE = 0.6745 * 20**0.5  # median size of third differences of white noise with variance 1
QUANTISED = 0.5  # distinct values over samples, below which a signal was quantised


class Noise(NamedTuple):
    """Noise of a channel from sample to sample, and the steps in which it was quantised."""

    deviation: float
    step: float

    @property
    def shows(self) -> bool:
        """Whether noise, and not quantisation, makes neighbouring samples differ."""
        return self.deviation > 0.75 * self.step


def noise_of(P: np.ndarray, residual: np.ndarray) -> float:
    """Standard deviation of the noise of one pressure, Pa, from its residual.

    It is computed as of white noise, from the median of third differences, which neither slow errors nor
    outliers change. It is at least that of rounding to the steps in which P was quantised.
    """
    white = float(np.median(np.abs(np.diff(residual, n=3)))) / THIRD_DIFFERENCE
    return max(white, quantum(P) / 12**0.5)


def quantum(P: np.ndarray) -> float:
    """Step in which a signal was quantised; 0 where none shows."""
    levels = np.unique(P)
    if len(levels) > QUANTISED * len(P) or len(levels) < 2:
        return 0.0
    return float(np.median(np.diff(levels)))


def equal_runs(values: np.ndarray) -> np.ndarray:
    """First and last sample of each run of equal values, shape (run, 2)."""
    starts = np.concatenate([[0], np.flatnonzero(np.diff(values)) + 1, [len(values)]])
    return np.stack([starts[:-1], starts[1:] - 1], axis=-1)


def noise_between_samples(values: np.ndarray) -> Noise:
    """Noise where a channel changes; none if its third differences show a smooth signal."""
    runs = equal_runs(values)
    lengths = runs[:, 1] - runs[:, 0] + 1
    changing = values[np.repeat(lengths < FEW, lengths)]
    if len(changing) < 2 * STOPPED:
        return Noise(0.0, 0.0)
    second, third = (float(np.median(np.abs(np.diff(changing, n=n)))) for n in (2, 3))
    return Noise(third / THIRD_DIFFERENCE if third > second else 0.0, quantum(values))


def at_end_of_range(values: np.ndarray, rests: tuple[float, ...] = ()) -> np.ndarray:
    """Whether a sample is at an end of the sensor's range: too many are exactly the largest or smallest.

    In noise, fewer samples than in the band below are at the largest value, unless the range ends there.
    Without noise, a signal that meets an end has a kink; one that settles, as near values in `rests`, has
    none.
    """
    noise, result = noise_between_samples(values), np.zeros(len(values), dtype=bool)
    band = max(noise.deviation, 1.5 * noise.step)
    for sign in (1, -1):
        signal = sign * values
        top = signal.max()
        at = signal == top
        count = int(at.sum())
        if count <= FEW or at.all():
            continue
        if noise.shows:
            ends = count > np.sum((signal < top) & (signal >= top - band))
        else:
            ends = not np.isclose(sign * top, rests, rtol=0.02).any() and _kinks(signal, at, noise.step)
        if ends:
            result |= at
    return result


def _kinks(signal: np.ndarray, at: np.ndarray, step: float) -> bool:
    """Whether a signal without noise mostly meets its largest value without slowing down."""
    runs = equal_runs(at)
    first = np.array([begin for begin, end in runs if at[begin] and begin > 2 and end - begin >= FEW], int)
    if not len(first):
        return False
    before = (signal[first - 1] - signal[first - 3]) / 2
    least = max(2 * step, 1e-4 * float(np.ptp(signal)))
    return bool(np.mean(before > least) > 0.5)


def stopped(values: np.ndarray) -> tuple[int, int] | None:
    """First and last of the samples during which a noisy channel does not change; None if it never stops.

    Equal neighbours are rare in noise, so that a run of them longer than chance allows is a fault.
    """
    runs = equal_runs(values)
    lengths = runs[:, 1] - runs[:, 0] + 1
    first, last = runs[np.argmax(lengths)]
    rest = np.delete(values, slice(first, last + 1))
    if last - first + 1 < STOPPED or len(rest) < 2 * STOPPED or not noise_between_samples(rest).shows:
        return None
    alike = max(float(np.mean(np.diff(rest) == 0)), 1 / len(rest))
    longest = max(STOPPED, np.log(LONGEST_BY_CHANCE) / np.log(alike))
    return (int(first), int(last)) if last - first + 1 > longest else None

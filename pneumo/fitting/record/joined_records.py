"""Several records of one rig as one measurement, each fitted from its own start."""

from collections.abc import Sequence

import numpy as np

from pneumo.errors import InputError
from pneumo.fitting.record.measurement import Measurement
from pneumo.quantities.table import MOST_RECORDS

SAME = 1e-3  # relative difference of two periods that counts as none


def joined(records: Sequence[Measurement], part: float, most: int) -> tuple[Measurement, float]:
    """Several records as one measurement, and the fraction of all its samples that is to be fitted.

    The fitted parts of all records come first, then the rest of each, so that one cut separates them; the
    last record is whole in between. A fitted part is the first `part` of a record; all fitted parts together
    have at most `most` samples. A single record is returned as it is.

    `InputError` if there are too many, if they differ in period or in what was measured, or if chambers were
    closed.
    """
    first, *others = records
    if not others:
        return first, part
    if len(records) > MOST_RECORDS:
        raise InputError(f"{len(records)} records: must be at most {MOST_RECORDS}")
    for other in others:
        if abs(other.period / first.period - 1) > SAME:
            periods = f"{1e3 * other.period:.4g} ms, of {first.name} {1e3 * first.period:.4g} ms"
            raise InputError(f"{other.name}: period {periods}: must be the same to fit them together")
        for column, field in (("m_A", "m"), ("P_s", "P_s")):
            if (getattr(other, field) is None) != (getattr(first, field) is None):
                raise InputError(f"{other.name}: column {column}: must be in all records or in none")
    if closed := [record.name for record in records if record.closed]:
        raise InputError(f"{closed[0]}: is a record of closed chambers; fit it alone")
    limit = most // len(records)
    cuts = [min(round(part * (len(m.u) - 1)), limit) for m in records]
    pieces = [m.part(0, cut) for m, cut in zip(records[:-1], cuts, strict=False)]
    pieces += [records[-1], *(m.part(cut) for m, cut in zip(records[:-1], cuts, strict=False))]
    begins = tuple(np.cumsum([0, *(len(piece.u) for piece in pieces)]).tolist())
    split = begins[len(records) - 1] + cuts[-1]

    temperatures = [m.T for m in records if np.isfinite(m.T)]
    names = ", ".join(m.name for m in records)
    order = f"{names}: fitted together, each from its own start; the part held out begins in the last of them"
    present = [field for field in ("u", "x", "P", "m", "P_s") if getattr(first, field) is not None]
    used = [np.ones(m.P.shape, bool) if m.used is None else m.used for m in pieces]
    return first._replace(
        **{field: np.concatenate([getattr(piece, field) for piece in pieces], axis=-1) for field in present},
        name=names,
        used=np.concatenate(used, axis=-1),
        T=float(np.mean(temperatures)) if temperatures else np.nan,
        notes=(*(f"{m.name}: {note}" for m in records for note in m.notes), order),
        begins=begins[:-1],
    ), split / (begins[-1] - 1)

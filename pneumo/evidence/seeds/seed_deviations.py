"""Standard deviation of each number of the paper over seed sets: the scale of the verdict's tolerances."""

from collections.abc import Sequence

import numpy as np

from pneumo.papers.paper_2006.computations import finding_for
from pneumo.papers.paper_2006.results import StudyResults
from pneumo.verdict.claims import Claims
from pneumo.verdict.sources import MissingEvidence


def seed_deviations(claims: Claims, sources: Sequence[StudyResults]) -> dict[str, float]:
    """Standard deviation over seed sets of the number of each item whose tolerance class uses it, by item.

    `sources` has the results of one seed set each; an item that lacks a number in any of them is left out.
    """
    deviations: dict[str, float] = {}
    for name, claim in claims.items.items():
        if not claim.models or claims.classes[claim.tolerance].seeds is None:
            continue
        try:
            of_sources = [finding_for(claim, source) for source in sources]
        except MissingEvidence:
            continue
        numbers = [(finding.varies, finding.margin, finding.value) for finding in of_sources]
        values = [next((v for v in known if v is not None), None) for known in numbers]
        if None not in values:
            deviations[name] = float(np.std(np.array(values, dtype=float), ddof=1))
    return deviations


def seed_deviations_text(deviations: dict[str, float]) -> str:
    """Text of ``seed_deviations.csv``, to three digits."""
    return "".join(["id,deviation\n", *(f"{name},{value:.3g}\n" for name, value in deviations.items())])

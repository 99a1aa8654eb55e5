"""How recorded signals reach the replays of a study."""

from pneumo.configuration.experiment import Experiment
from pneumo.configuration.sampling import EXACT_SAMPLING, Sampling

STUDY_SAMPLINGS = PUBLISHED, EXACT = "published", "exact"  # names of folders of results


def study_sampling(name: str, experiment: Experiment) -> Sampling:
    """`Sampling` of an experiment's signals in the replays of results/`name`, "published" or "exact".

    Raises
    ------
    KeyError
        If `name` is not in `STUDY_SAMPLINGS`.
    """
    return {EXACT: EXACT_SAMPLING, PUBLISHED: experiment.sampling}[name]

"""Files of evidence that are kept with the source."""

from pneumo.storage.checksums import unlike_sums
from pneumo.storage.kept_evidence import KEPT


def test_kept_files_are_those_of_their_list():
    listed, unlike = unlike_sums(KEPT)
    assert unlike == [] and listed == len([*KEPT.glob("*.nc"), *KEPT.glob("*.json")])

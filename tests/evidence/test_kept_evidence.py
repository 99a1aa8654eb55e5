"""Evidence that is kept with the source is the listed one."""

from pneumo.storage.kept_evidence import KEPT, unlike_list


def test_kept_files_are_those_that_are_listed():
    assert unlike_list(KEPT) == []

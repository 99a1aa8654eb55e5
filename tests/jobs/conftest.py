import pytest

from pneumo.jobs.run_lock import RUN, RUN_LOCK


@pytest.fixture
def run_folder(tmp_path, monkeypatch):
    """The current folder: runs have been in it, and none of them started this process."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv(RUN, raising=False)
    RUN_LOCK.parent.mkdir()
    RUN_LOCK.touch()
    return tmp_path

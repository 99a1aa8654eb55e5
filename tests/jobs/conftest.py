import pytest

from workflow.jobs.run_lock import STATE


@pytest.fixture
def run_folder(tmp_path, monkeypatch):
    """The current folder, as Snakemake begins there."""
    monkeypatch.chdir(tmp_path)
    STATE.mkdir()
    return tmp_path

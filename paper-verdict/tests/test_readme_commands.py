"""README's commands, run as they are printed in an empty folder, and what the last ones say."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

README = (Path(__file__).parents[1] / "README.md").read_text(encoding="utf-8")
COMMAND = f'paper-verdict() {{ "{sys.executable}" -m paper_verdict "$@"; }}'


@pytest.mark.skipif(os.name == "nt", reason="README's commands are those of a POSIX shell")
def test_commands_do_what_readme_says(tmp_path):
    blocks = re.findall(r"```sh\n(.*?)```", README, re.S)
    script = "\n".join(["set -e", COMMAND, *(block for block in blocks if "pip install" not in block)])
    source = os.pathsep.join([str(Path(__file__).parents[1] / "src"), os.environ.get("PYTHONPATH", "")])
    environment = os.environ | {"PYTHONPATH": source}
    done = subprocess.run(
        ["bash", "-c", script], cwd=tmp_path, env=environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.endswith(re.search(r"```text\n(.*?)```", README, re.S)[1])
    assert "0.893" in (tmp_path / "epidemic/verdict.html").read_text(encoding="utf-8")


def test_links_lead_to_files():
    for link in re.findall(r"\]\(([^)h#][^)]*)\)", README):
        assert (Path(__file__).parents[1] / link).exists(), link

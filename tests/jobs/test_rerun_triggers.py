"""What makes Snakemake run a rule again: edits of what it uses."""

import re

import grimp
from checkout import ROOT
from workflow_scripts import SCRIPTS

from workflow.jobs.rerun_triggers import ASSESSMENT, SIMULATION

RULE = re.compile(r"code=sha256_of\(([^)]*)\).*?scripts/(\w+\.py)", re.DOTALL)
IMPORTED = re.compile(r"^from ((?:pneumo|paper)\.[\w.]+) import", re.MULTILINE)
WITHOUT_NUMBERS = ("pneumo/errors", "pneumo/regular_file", "workflow/jobs")


def test_every_rule_names_the_folders_of_all_that_its_script_imports():
    graph = grimp.build_graph("pneumo", "paper", cache_dir=None)
    text = "".join(file.read_text() for file in sorted((ROOT / "workflow/rules").glob("*.smk")))
    rules = RULE.findall(text)
    assert {script for _, script in rules} == {file.name for file in SCRIPTS.glob("*.py")} - {"schemes.py"}
    for named, script in rules:
        folders = re.findall(r'"([^"]+)"', named)
        folders += ASSESSMENT if "ASSESSMENT" in named else SIMULATION if "SIMULATION" in named else ()
        imported = IMPORTED.findall((SCRIPTS / script).read_text())
        behind = {*imported}.union(*map(graph.find_upstream_modules, imported))
        covered = tuple(f"{folder.removesuffix('.py')}/" for folder in (*folders, *WITHOUT_NUMBERS))
        paths = {module.replace(".", "/") + "/" for module in behind - {"paper.study"}}
        assert not {path for path in paths if not path.startswith(covered)}, script

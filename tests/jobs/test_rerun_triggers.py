"""What makes Snakemake run a rule again: edits of what it uses."""

import re
from pathlib import Path

import grimp
import pytest
from checkout import ROOT
from workflow_scripts import SCRIPTS

from workflow.jobs.rerun_triggers import IMPORTED, VERDICT, sources

RULE = re.compile(r"^rule (\w+):(?:(?!^rule ).)*?code=sha256_of\(([^)]*)\).*?scripts/(\w+\.py)", re.M | re.S)
RULES = RULE.findall("".join(file.read_text() for file in sorted((ROOT / "workflow/rules").glob("*.smk"))))
SIMULATED = "settling datum replay ranking_cells fleet_block"
JUDGED = "verdict figures report manuscript"


def named(watched: str) -> list[Path]:
    return [Path(name) for name in re.findall(r'"(.+?)"', watched)]


def test_every_rule_watches_its_script_and_all_that_it_imports(monkeypatch):
    monkeypatch.chdir(ROOT)
    graph = grimp.build_graph("pneumo", "paper", "paper_verdict", cache_dir=None)
    assert {script for *_, script in RULES} == {file.name for file in SCRIPTS.glob("*.py")} - {"schemes.py"}
    for _, watched, script in RULES:
        file = Path("workflow/scripts", script)
        assert file in named(watched)
        imported = [module for module, _ in IMPORTED.findall(file.read_text())]
        behind = {*imported}.union(*map(graph.find_upstream_modules, imported)) - {"paper.study"}
        inside = (path.relative_to(VERDICT) if VERDICT in path.parents else path for path in sources(file))
        seen = {".".join(path.with_suffix("").parts).removesuffix(".__init__") for path in inside}
        assert behind <= seen, script


@pytest.mark.parametrize(
    ("edited", "again", "kept"),
    [
        ("pneumo/physics/models.py", f"{SIMULATED} {JUDGED} statistics", ""),
        ("pneumo/core/replay.c", f"{SIMULATED} {JUDGED} measured_records", "simulated_example"),
        ("pneumo/configuration/schema.py", "ranking_cells fleet_block", "datum replay statistics report"),
        ("pneumo/catalogue/conductances.csv", "ranking_cells fleet_block replay", "datum figures"),
        ("paper/study/averages.py", "statistics verdict figures", "settling datum replay fleet_index"),
        ("pneumo/export/c_source.py", "", f"{SIMULATED} {JUDGED} verdict_2007 measured_records fleet_index"),
        ("pneumo/fitting/estimate.py", "ranking_cells", f"settling datum replay {JUDGED} verdict_2007"),
        ("pneumo/cli/options.py", "", f"{SIMULATED} {JUDGED} measured_records fleet_index"),
        ("pneumo/publish/figures.mplstyle", "figures measurements_figure", f"{SIMULATED} statistics verdict"),
        ("pneumo/publish/pages/templates/page.css", "verdict report fleet_index", f"{SIMULATED} figures"),
        (
            "paper-verdict/src/paper_verdict/judging.py",
            "verdict verdict_2007",
            f"{SIMULATED} statistics figures report",
        ),
        ("paper/study/paper_2006/computations.py", "verdict", f"{SIMULATED} figures report verdict_2007"),
        ("paper/study/figures/measurements_figure.py", "measurements_figure", f"{SIMULATED} {JUDGED}"),
    ],
)
def test_an_edit_runs_again_what_uses_it_only(edited, again, kept, monkeypatch):
    monkeypatch.chdir(ROOT)
    using = {rule for rule, watched, _ in RULES if Path(edited) in sources(*named(watched))}
    assert {*again.split()} <= using and not {*kept.split()} & using

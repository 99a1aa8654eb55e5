"""Bundle a finished study as a Workflow Run RO-Crate: what ran, on what, and what came out."""

from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path

import yaml
from rocrate.model.contextentity import ContextEntity
from rocrate.rocrate import ROCrate

PROFILES = {
    "https://w3id.org/ro/wfrun/process/0.5": "Process Run Crate",
    "https://w3id.org/ro/wfrun/workflow/0.5": "Workflow Run Crate",
    "https://w3id.org/workflowhub/workflow-ro-crate/1.0": "Workflow RO-Crate",
}
INPUTS = ["config/paper.yaml"]


def crate_of_run(root: Path) -> ROCrate:
    """Describe the run whose results are in a checkout; `FileNotFoundError` if one of them is missing."""
    about = yaml.safe_load((root / "codecheck.yml").read_text(encoding="utf-8"))
    crate = ROCrate(version="1.1")
    crate.name = f"Reproduction of: {about['paper']['title']}"
    crate.description = "The study of the paper, run again: configuration, workflow and results"
    crate.license = crate.add(_entity(crate, "https://spdx.org/licenses/MIT", "CreativeWork", "MIT license"))
    crate.root_dataset["conformsTo"] = [
        crate.add(_entity(crate, profile, "CreativeWork", name, version=profile.rpartition("/")[2]))
        for profile, name in PROFILES.items()
    ]
    author = crate.add(_entity(crate, "#developers", "Organization", "pneumo developers"))
    crate.root_dataset["author"] = author
    language = {"lang": "snakemake", "lang_version": version("snakemake")}
    workflow = crate.add_workflow(root / "Snakefile", "Snakefile", main=True, **language)
    workflow["name"] = "Study of the paper"
    inputs = [crate.add_file(root / name, name, properties={"name": name}) for name in INPUTS]
    made = [root / entry["file"] for entry in about["manifest"]]
    outputs = [
        crate.add_file(
            file, entry["file"], properties={"name": entry["file"], "description": entry["comment"]}
        )
        for file, entry in zip(made, about["manifest"], strict=True)
    ]
    times = [datetime.fromtimestamp(file.stat().st_mtime, UTC) for file in made]
    run = _entity(crate, "#run", "CreateAction", f"Run of pneumo {version('pneumo')}: snakemake -j2")
    run["startTime"], run["endTime"] = (
        time.isoformat(timespec="seconds") for time in (min(times), max(times))
    )
    run["instrument"], run["object"], run["result"], run["agent"] = workflow, inputs, outputs, author
    crate.add(run)
    crate.root_dataset["mentions"] = [run]
    return crate


def _entity(crate: ROCrate, name: str, kind: str, title: str, **more: str) -> ContextEntity:
    return ContextEntity(crate, name, properties={"@type": kind, "name": title} | more)


if __name__ == "__main__":
    crate_of_run(Path()).write_zip("results/crate.zip")
    print("results/crate.zip")

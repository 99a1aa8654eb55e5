"""Bundle a finished study as a Workflow Run RO-Crate: what ran, on what, and what came out."""

from datetime import UTC, datetime
from importlib.metadata import version
from io import StringIO
from pathlib import Path

import yaml
from rocrate.model.contextentity import ContextEntity
from rocrate.rocrate import ROCrate

from pneumo.storage.files import damaged
from pneumo.storage.seal import changed, manifest, sealed_files, sha256_lines

PROFILES = {
    "https://w3id.org/ro/wfrun/process/0.5": "Process Run Crate",
    "https://w3id.org/ro/wfrun/workflow/0.5": "Workflow Run Crate",
    "https://w3id.org/workflowhub/workflow-ro-crate/1.0": "Workflow RO-Crate",
}
HASHES = "manifest-sha256.txt"
INPUTS = ["config/paper.yaml"]
RECORD = "numbers as printed and as reproduced, in HEPData's form"


def crate_of_run(root: Path) -> ROCrate:
    """Describe the run whose results are in a checkout.

    Its `HASHES` name the SHA-256 of every result, page and figure, also of those that stay in the checkout.

    Raises
    ------
    FileNotFoundError
        If one of its results is missing.
    DamagedError
        If a result, page or figure is not as it was made.
    """
    results = root / "results"
    for error in (*damaged(results), *changed(results)):
        raise error
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
    tables = sorted((results / "records").glob("*/*.yaml"))
    for table in tables:
        name = str(table.relative_to(root))
        outputs.append(crate.add_file(table, name, properties={"name": name, "description": RECORD}))
    listed = {file for file in (*sealed_files(results), *manifest(results)) if file.exists()}
    hashes = StringIO(sha256_lines({*listed, *made, *tables}, root))
    crate.add_file(hashes, HASHES, properties={"name": HASHES, "description": "SHA-256 of all results"})
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

"""Collect the rankings of all cylinders of a fleet and write its page."""

import hashlib
from pathlib import Path

from pneumo.storage.files import attributes, read, write, write_text
from workflow.jobs.fleet import INDEXED, fleet_index
from workflow.jobs.fleet_page import fleet_page
from workflow.jobs.wrapper import run_job


def main(blocks: list[Path], name: str, index: Path, page: Path) -> None:
    parts = {block.stem: read(block, *INDEXED) for block in blocks}
    together = fleet_index(parts)
    hashes = "".join(part.attrs["config_sha256"] for part in parts.values())
    config_sha256 = hashlib.sha256(hashes.encode()).hexdigest()
    summary = "Recommended model and ranking of every cylinder; block names the file with its cells"
    write(together, index, attributes(f"Fleet {name}", summary, config_sha256))
    write_text(fleet_page(name, read(index)), page)


run_job(main, globals())

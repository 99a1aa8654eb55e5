"""Join the blocks of seed sets in one small file."""

from pathlib import Path

from pneumo.evidence.seeds.seed_sets import joined_seed_sets
from pneumo.jobs.wrapper import run_job
from pneumo.storage.files import attributes, read, write


def main(blocks: list[Path], errors: Path) -> None:
    parts = [read(block) for block in blocks]
    about = attributes(
        "Ensemble: errors with every set of seeds",
        "Error of every cell of the grid to five digits, both signal samplings; set 0 has the study's seeds",
        *(parts[0].attrs[name] for name in ("config_sha256", "code_sha256")),  # of what computed them
    )
    write(joined_seed_sets(parts), errors, about, digits=5)


run_job(main, globals())

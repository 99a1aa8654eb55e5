"""Run and rank every cylinder of a block."""

from pathlib import Path
from typing import Any

from pneumo.configuration.parameters import Sources, study
from pneumo.configuration.priors import uncertainties
from pneumo.storage.files import attributes, write
from pneumo.storage.layout import same_at_every_n
from workflow.jobs.fleet import run_block
from workflow.jobs.wrapper import run_job


def main(content: dict[str, Any], cells: Path, threads: int) -> None:
    configuration = Sources(content).validated()
    configured, limits = study(configuration), uncertainties(configuration)
    block = run_block(configured, threads, lambda name: print(f"{name}: done", flush=True), limits)
    about = attributes(
        f"Reduced models on {block.sizes['cylinder']} cylinders of {configured.name}",
        "Error of every model at every n against full-order runs over several seeds, and rankings",
        configured.config_sha256,
        comment=same_at_every_n(),
        transport="exact",
    )
    write(block, cells, about)


run_job(main, globals())

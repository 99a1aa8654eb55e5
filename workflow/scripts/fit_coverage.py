"""Do the intervals of `pneumo fit` hold the truth, and which model predicts best: all blocks in one."""

import xarray as xr

from pneumo.evidence.fit_coverage import summary
from pneumo.jobs.wrapper import logged
from pneumo.storage.files import read, write, write_text


def main(blocks: list[str], output: str, table: str, code: str) -> None:
    parts: list[xr.Dataset] = [read(block) for block in blocks]
    found: xr.Dataset = xr.concat(parts, "case", combine_attrs="drop_conflicts")
    about = {name: parts[0].attrs[name] for name in ("title", "summary", "config_sha256")}
    write(found, output, about | {"code_sha256": code})
    write_text(summary(found), table)


if job := globals().get("snakemake"):
    with logged(job):
        main(list(job.input), job.output.cells, job.output.table, job.params.code)

"""Do the intervals of `pneumo fit` hold the truth, and which model predicts best: all blocks in one."""

from pathlib import Path

import xarray as xr

from pneumo.evidence.fit_coverage.interval_coverage import full_order_truth, intervals_that_hold
from pneumo.jobs.wrapper import run_job
from pneumo.publish.text.markdown_tables import coverage_tables
from pneumo.storage.files import attributes, read, write, write_text


def main(blocks: list[Path], cells: Path, table: Path, code: str) -> None:
    parts: list[xr.Dataset] = [read(block) for block in blocks]
    cases: xr.Dataset = xr.concat(parts, "case", data_vars="all", combine_attrs="drop_conflicts")
    title, summary, config_sha256 = (parts[0].attrs[name] for name in ("title", "summary", "config_sha256"))
    write(cases, cells, attributes(title, summary, config_sha256, code))
    write_text(coverage_tables(intervals_that_hold(cases), full_order_truth(cases)), table)


run_job(main, globals())

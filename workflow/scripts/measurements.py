"""Thermal laws fitted to measured records of closed chambers, and judged on the rest."""

from pathlib import Path

import xarray as xr

from paper.study.closed_records import is_still, judged, read_closed_record
from pneumo.storage.files import attributes, write
from workflow.jobs.wrapper import run_job


def main(records: list[Path], cells: Path) -> None:
    parts: dict[str, xr.Dataset] = {}
    for path in records:
        record = read_closed_record(path)
        if is_still(record):
            print(f"{record.name}: pressures hardly change, nothing to fit", flush=True)
        else:
            parts[record.name] = judged(record)
    about = attributes(
        "Thermal laws on measured records of closed chambers",
        "Each law fitted to the first 60 % of a record and judged on the rest, without and with leakage",
        "none: records are in data/",
        license="MIT; the records it was made from: Apache-2.0, osrf/mbari_wec_gz",
    )
    write(xr.concat(list(parts.values()), xr.Variable("record", list(parts))), cells, about, digits=4)


run_job(main, globals())

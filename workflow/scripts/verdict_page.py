"""Write the verdict as a page."""

import json
from pathlib import Path

from pneumo.job import logged
from pneumo.publish.verdict_page import render
from pneumo.store import write_text


def main(verdict: str, output: str) -> None:
    write_text(render(json.loads(Path(verdict).read_text(encoding="utf-8"))), output)


if job := globals().get("snakemake"):
    with logged(job):
        main(job.input.verdict, job.output[0])

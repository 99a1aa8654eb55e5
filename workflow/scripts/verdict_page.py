"""Write the verdict as a page."""

import json

from pneumo.jobs.wrapper import logged
from pneumo.publish.pages.verdict_page import render
from pneumo.storage.files import read_json, write_text


def main(verdict: str, output: str) -> None:
    write_text(render(json.loads(read_json(verdict))), output)


if job := globals().get("snakemake"):
    with logged(job):
        main(job.input.verdict, job.output[0])

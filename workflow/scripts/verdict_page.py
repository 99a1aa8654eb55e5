"""Write a verdict as a page."""

import json
from pathlib import Path

from pneumo.jobs.wrapper import run_job
from pneumo.publish.pages.verdict_page import verdict_page
from pneumo.storage.files import read_json, write_text


def main(verdict: Path, about: list[Path], page: Path) -> None:
    write_text(verdict_page(json.loads(read_json(verdict)), about[0].parent), page)


run_job(main, globals())

"""Write the manuscript's numbers and typeset it."""

import json
from pathlib import Path

from paper.study.text.manuscript import compile_pdf, manuscript_numbers
from pneumo.storage.files import write_text
from workflow.jobs.wrapper import run_job


def main(parameters: Path, verdict: Path, frozen: Path, source: Path, numbers: Path, pdf: Path) -> None:
    content = manuscript_numbers(parameters, verdict) | json.loads(frozen.read_text(encoding="utf-8"))
    write_text(json.dumps(content, indent=1, ensure_ascii=False), numbers)
    compile_pdf(source, Path.cwd(), pdf)


run_job(main, globals())

"""Write the manuscript's numbers and typeset it."""

import json
from pathlib import Path

from pneumo.jobs.wrapper import run_job
from pneumo.publish.text.manuscript import compile_pdf, manuscript_numbers
from pneumo.storage.files import write_text


def main(source: Path, numbers: Path, pdf: Path) -> None:
    write_text(json.dumps(manuscript_numbers(pdf.parent), indent=1, ensure_ascii=False), numbers)
    compile_pdf(source, Path.cwd(), pdf)


run_job(main, globals())

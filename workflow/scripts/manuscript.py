"""Write the manuscript's numbers and typeset it."""

import json
from pathlib import Path

from pneumo.jobs.wrapper import logged
from pneumo.publish.text.manuscript import compile_pdf, numbers
from pneumo.storage.files import write_text


def main(results: Path, source: Path, root: Path, written: str, pdf: str) -> None:
    write_text(json.dumps(numbers(results), indent=1, ensure_ascii=False), written)
    compile_pdf(source, root, Path(pdf))


if job := globals().get("snakemake"):
    with logged(job):
        made = job.output
        main(Path(made.pdf).parent, Path(job.input.source), Path.cwd(), made.numbers, made.pdf)

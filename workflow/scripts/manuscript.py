"""Write the manuscript's numbers and typeset it."""

import json
from collections.abc import Mapping
from pathlib import Path

from pneumo.jobs.wrapper import run_job
from pneumo.publish.text.manuscript import compile_pdf, manuscript_numbers
from pneumo.storage.files import write_text
from pneumo.storage.kept_evidence import made


def main(
    results: list[Path],
    evidence: list[Path],
    code_now: Mapping[str, str],
    source: Path,
    numbers: Path,
    pdf: Path,
) -> None:
    content = manuscript_numbers([*results, *evidence])
    content["evidence"] = [made(Path(file), code) for file, code in code_now.items()]
    write_text(json.dumps(content, indent=1, ensure_ascii=False), numbers)
    compile_pdf(source, Path.cwd(), pdf)


run_job(main, globals())

"""Sum the effects of the toggled assumptions up: a table and a tornado plot."""

from pathlib import Path

from pneumo.evidence.toggle_effects import effects
from pneumo.jobs.wrapper import logged
from pneumo.publish.figures.toggles_figure import tornado
from pneumo.publish.style import save
from pneumo.publish.text.markdown_tables import assumptions
from pneumo.storage.files import read, write_text
from pneumo.verdict.claims import read_claims


def main(toggled: str, paper: Path, table: str, figure: Path) -> None:
    found = effects(read(toggled, "reproduced")["reproduced"], read_claims(paper))
    write_text(assumptions(found), table)
    save(tornado(found), figure)


if job := globals().get("snakemake"):
    with logged(job):
        files, made = job.input, job.output
        main(files.assumptions, Path(files.claims).parent, made.table, Path(made.figure[0]).with_suffix(""))

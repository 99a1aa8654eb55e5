"""Show what other assumptions and physics do to the ranking: a table and a figure."""

from pathlib import Path

from pneumo.jobs.wrapper import logged
from pneumo.publish.figures.variants_figure import dots, table
from pneumo.publish.style import save
from pneumo.storage.files import read, write_text


def main(found: str, markdown: str, figure: Path) -> None:
    variants = read(found, "ratio", "share", "counted")
    write_text(table(variants), markdown)
    save(dots(variants), figure)


if job := globals().get("snakemake"):
    with logged(job):
        main(job.input[0], job.output.table, Path(job.output.figure[0]).with_suffix(""))

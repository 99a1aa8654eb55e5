"""Show what other assumptions and physics do to the ranking: a table."""

from pathlib import Path

from pneumo.jobs.wrapper import run_job
from pneumo.publish.text.markdown_tables import variants_table
from pneumo.storage.files import read, write_text


def main(cells: Path, table: Path) -> None:
    write_text(variants_table(read(cells, "ratio", "share", "counted")), table)


run_job(main, globals())

"""Write Table 7, reproduced beside published, as Markdown."""

from pathlib import Path

from pneumo.jobs.wrapper import run_job
from pneumo.papers.paper_2006.printed_tables import table7
from pneumo.publish.text.markdown_tables import table_7
from pneumo.storage.files import read, write_text


def main(statistics: Path, table: Path) -> None:
    write_text(table_7(read(statistics), table7()), table)


run_job(main, globals())

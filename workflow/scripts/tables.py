"""Write Table 7, reproduced beside published, as Markdown."""

from pneumo.jobs.wrapper import logged
from pneumo.publish.text.markdown_tables import table_7
from pneumo.storage.files import read, write_text
from pneumo.verdict.published import table7


def main(statistics: str, output: str) -> None:
    write_text(table_7(read(statistics), table7()), output)


if job := globals().get("snakemake"):
    with logged(job):
        main(job.input[0], job.output[0])

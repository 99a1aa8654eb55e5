"""Write Table 7, reproduced beside published, as Markdown."""

from pneumo.assess.published import table7
from pneumo.job import logged
from pneumo.publish.tables import table_7
from pneumo.store import read, write_text


def main(statistics: str, output: str) -> None:
    write_text(table_7(read(statistics), table7()), output)


if job := globals().get("snakemake"):
    with logged(job):
        main(job.input[0], job.output[0])

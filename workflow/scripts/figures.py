"""Draw Figures 7 to 11, the time traces and the error over n; write Table 7."""

from pathlib import Path

from paper.study.figures.saved_figures import save_figures
from paper.study.paper_2006.printed_tables import table7
from paper.study.text.markdown_tables import table_7
from pneumo.jobs.wrapper import run_job
from pneumo.storage.files import read, write_text


def main(table: Path) -> None:
    results = table.parent
    save_figures(results, results / "figures")
    write_text(table_7(read(results / "published/statistics.nc"), table7()), table)


run_job(main, globals())

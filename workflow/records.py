"""Write printed and reproduced numbers of both papers as HEPData tables into results/records."""

import json
from pathlib import Path

from pneumo.papers import PAPERS
from pneumo.papers.known_papers import KNOWN
from pneumo.publish.pages.verdict_page import Page
from pneumo.publish.records import write_records
from pneumo.storage.files import read_json
from pneumo.verdict.claims import read_claims
from pneumo.verdict.entries import read_entries

FOLDER = Path("results/records")


def main(results: Path, folder: Path) -> None:
    """Write a folder for each paper from its verdict."""
    for name, paper in KNOWN.items():
        page = Page.read(PAPERS / name / "page.yaml", "page", read_entries(PAPERS / name, "page.yaml"))
        titles = {f"T{number}": layout.caption for number, layout in page.tables.items()} | dict(page.titles)
        about = f"{page.authors}, {page.title}, {page.journal}, doi:{page.doi}: as printed, and as reproduced"
        verdict = json.loads(read_json(results / paper.results / "verdict.json"))
        (folder / name).mkdir(parents=True, exist_ok=True)
        write_records(read_claims(PAPERS / name), verdict, titles, about, folder / name)
        print(folder / name)


if __name__ == "__main__":
    main(Path("results"), FOLDER)

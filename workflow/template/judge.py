"""Judge the paper: print the counts, write out/verdict.json and out/verdict.html.

``python judge.py`` exits with 1 where a status differs from paper/statuses.csv, ``python judge.py --record``
accepts the new ones.
"""

import json
import sys
from pathlib import Path

from computations import COMPUTATIONS, PROOFS

from pneumo.publish.pages.verdict_page import verdict_page
from pneumo.publish.text.verdict_text import verdict_lines
from pneumo.verdict.judging import Paper, statuses_text, verdict

FOLDER, OUT = Path("paper"), Path("out")
STATUSES = FOLDER / "statuses.csv"

PAPER = Paper(
    folder=FOLDER,
    computations=COMPUTATIONS,
    proofs=PROOFS,
    sources=lambda _results, _folder: {"air": {"gamma": 1.4}},  # what the computations read: your results
    about=lambda _sources: {"study": "own computation", "failures": {}, "settling_failures": {}},
    highlights=lambda _sources, _items: {},
    module="pneumo.verdict.judging",
    reads=(),  # patterns of the files of results that sources read
    command="python judge.py",
)


def main() -> int:
    """Exit code: 1 where a status is not the recorded one."""
    judged = verdict(Path("results"), PAPER)
    for line in verdict_lines(judged):
        print(line)
    OUT.mkdir(exist_ok=True)
    text = json.dumps(judged, ensure_ascii=False, indent=1)
    (OUT / "verdict.json").write_text(f"{text}\n", encoding="utf-8")
    (OUT / "verdict.html").write_text(verdict_page(judged, FOLDER), encoding="utf-8")
    now = statuses_text(judged["items"])
    if "--record" in sys.argv[1:]:
        STATUSES.write_text(now, encoding="utf-8")
        return 0
    before = STATUSES.read_text(encoding="utf-8") if STATUSES.exists() else ""
    changed = [line for line in now.splitlines() if line not in before.splitlines()]
    for line in changed:
        print(f"not as recorded: {line}; `python judge.py --record` accepts it", file=sys.stderr)
    return 1 if changed else 0


if __name__ == "__main__":
    sys.exit(main())

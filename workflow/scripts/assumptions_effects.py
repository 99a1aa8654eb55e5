"""Sum the effects of the toggled assumptions up: a table and a tornado plot."""

from pathlib import Path

from pneumo.evidence.sensitivity.toggle_effects import toggle_effects
from pneumo.jobs.wrapper import run_job
from pneumo.publish.figures.alternatives_figures import tornado
from pneumo.publish.style import save
from pneumo.publish.text.markdown_tables import assumptions_table
from pneumo.storage.files import read, write_text
from pneumo.verdict.claims import read_claims


def main(toggled: Path, claims: Path, table: Path, figure: list[Path]) -> None:
    by_assumption = toggle_effects(read(toggled, "reproduced")["reproduced"], read_claims(claims.parent))
    write_text(assumptions_table(by_assumption), table)
    save(tornado(by_assumption), figure[0].with_suffix(""))


run_job(main, globals())

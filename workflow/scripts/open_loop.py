"""Score every pair of open-loop setups as paper/decisions/0062 says."""

from pathlib import Path

from pneumo.evidence.identification.open_loop import choose_open_loop
from pneumo.evidence.seeds.seed_sets import read_seed_sets
from pneumo.jobs.wrapper import run_job
from pneumo.storage.files import attributes, read, read_study, write


def main(parameters: Path, cells: Path, errors: Path, ledger: Path, code: str) -> None:
    study, sets = read_study(parameters), read_seed_sets(errors)
    choice = choose_open_loop(study, read(cells), sets, lambda text: print(text, flush=True))
    title = "Setup of the open loops, chosen by the likelihood of Tables 7, 8, 9 and Figs 9, 11"
    summary = "Score of every pair of setups of cylinders D and E, and the best ones: paper/decisions/0062"
    write(choice, ledger, attributes(title, summary, study.config_sha256, code))


run_job(main, globals())

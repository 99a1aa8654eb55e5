"""Identify what the paper leaves open: M, k_f, stop and the ends of the settling runs."""

from pathlib import Path

from pneumo.evidence.identification.identify import SEARCH_SEED, identify, save_identification
from pneumo.jobs.wrapper import run_job
from pneumo.storage.files import read_study


def main(parameters: Path, estimates: Path, threads: int) -> None:
    study = read_study(parameters)
    identification = identify(study, ["D", "E"], SEARCH_SEED, threads, lambda text: print(text, flush=True))
    save_identification(identification, study, SEARCH_SEED, estimates)


run_job(main, globals())

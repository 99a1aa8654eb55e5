"""Run the whole grid with a block of seed sets."""

from pathlib import Path

import xarray as xr

from pneumo.evidence.seeds.seed_sets import both_chambers, seed_sets, with_seeds
from pneumo.jobs.wrapper import run_job
from pneumo.storage.files import attributes, read_study, write


def main(parameters: Path, block: Path, sets: list[int], of: int, threads: int, code: str) -> None:
    study = read_study(parameters).with_halvings()
    seeds = seed_sets(study, of)
    parts: list[xr.Dataset] = []
    for number in sets:
        parts.append(both_chambers(with_seeds(study, seeds[number], threads)))
        print(f"seeds {number + 1} of {of}: {seeds[number]}, done", flush=True)
    dataset = xr.concat(parts, xr.Variable("seeds", sets))
    for cylinder in seeds[0]:
        values = [seeds[number][cylinder] for number in sets]
        dataset[f"seed_{cylinder}"] = ("seeds", values, {"long_name": f"seed of cylinder {cylinder}"})
    title = f"Ensemble, sets of seeds {sets[0]} to {sets[-1]}"
    summary = "Error of every grid cell to six digits, both signal samplings; set 0 has the study's seeds"
    write(dataset, block, attributes(title, summary, study.config_sha256, code), digits=6)


run_job(main, globals())

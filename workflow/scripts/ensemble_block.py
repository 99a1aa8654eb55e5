"""Run the whole grid with a block of seed sets."""

import xarray as xr

from pneumo.configuration.exchange import from_json
from pneumo.evidence.seed_sets import seed_sets, with_seeds
from pneumo.jobs.wrapper import logged
from pneumo.storage.files import read_json, write


def main(parameters: str, output: str, sets: list[int], of: int, threads: int, code: str) -> None:
    study = from_json(read_json(parameters))
    seeds = seed_sets(study, of)
    parts: list[xr.Dataset] = []
    for number in sets:
        parts.append(with_seeds(study, seeds[number], threads))
        print(f"seeds {number + 1} of {of}: {seeds[number]}, done", flush=True)
    dataset = xr.concat(parts, xr.Variable("seeds", sets))
    for cylinder in seeds[0]:
        values = [seeds[number][cylinder] for number in sets]
        dataset[f"seed_{cylinder}"] = ("seeds", values, {"long_name": f"seed of cylinder {cylinder}"})
    attributes = {
        "title": f"Ensemble, sets of seeds {sets[0]} to {sets[-1]}",
        "summary": "Error of every cell of the grid, both transports; set 0 has the study's own",
        "lag_s": study.lag,
        "config_sha256": study.config_sha256,
        "code_sha256": code,
    }
    write(dataset, output, attributes)


if job := globals().get("snakemake"):
    with logged(job):
        p = job.params
        main(job.input[0], job.output[0], list(p.sets), p.of, job.threads, p.code)

"""Replay every model at every n on every recorded experiment, with both transports."""

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from pneumo.configuration.exchange import from_json
from pneumo.configuration.experiment import Experiment, Study
from pneumo.jobs.wrapper import logged
from pneumo.simulation.grid import grid_lanes
from pneumo.simulation.replay import replay
from pneumo.simulation.signals import PUBLISHED, study_transport
from pneumo.storage.files import attributes_of, read, read_json, write
from pneumo.storage.layout import recording_from, replay_dataset


def replay_one(study: Study, experiment: Experiment, datum: str, outputs: list[str], code: str) -> None:
    recording = recording_from(read(datum), experiment)
    lanes, index = grid_lanes(study.n, experiment.plant.gas.gamma)
    for output in outputs:
        transport = Path(output).parts[-3]
        reading = study_transport(transport, study.lag, experiment.h)
        cells = replay(recording, lanes, reading, experiment.pressure_stride)
        attributes = {
            "title": f"Reduced models replayed on {experiment.name}, {transport} transport",
            "summary": "Error of every model at every n against the full-order run, and the pressures",
            "comment": "M1, M3 and M4 have no n: they hold the same cell at every n",
            "transport": transport,
            "lag_s": study.lag if transport == PUBLISHED else 0.0,
            "experiment_parameters": attributes_of(experiment),
            "config_sha256": study.config_sha256,
            "code_sha256": code,
        }
        write(replay_dataset(experiment, study.n, index, cells), output, attributes)


def main(parameters: str, datum: list[str], outputs: list[str], threads: int, code: str) -> None:
    study = from_json(read_json(parameters))
    # Longest first, so that the threads end together. The kernels hold no lock while they run.
    longest_first = sorted(datum, key=lambda file: -study.experiments[Path(file).stem].steps)

    def one(file: str) -> None:
        own = [output for output in outputs if Path(output).stem == Path(file).stem]
        replay_one(study, study.experiments[Path(file).stem], file, own, code)
        print(f"{Path(file).stem}: {len(own)} replays of the whole grid, done", flush=True)

    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(one, longest_first))


if job := globals().get("snakemake"):
    with logged(job):
        files, code = job.input, job.params.code
        main(files.parameters, list(files.datum), list(job.output), job.threads, code)

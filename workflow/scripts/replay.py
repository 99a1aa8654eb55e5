"""Replay every model at every n on every recorded experiment, with both transports."""

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from pneumo.configuration.experiment import Study
from pneumo.jobs.wrapper import run_job
from pneumo.simulation.grid import grid_lanes
from pneumo.simulation.replay import replay
from pneumo.simulation.signals import PUBLISHED, study_transport
from pneumo.storage.files import attributes, read, read_study, write
from pneumo.storage.grid_layout import replay_dataset, same_at_every_n
from pneumo.storage.layout import recording_from


def replay_one(study: Study, datum: Path, outputs: list[Path], code: str) -> None:
    experiment = study.experiments[datum.stem]
    recording = recording_from(read(datum), experiment)
    lanes, index = grid_lanes(study.n, experiment.plant.gas.gamma)
    for output in outputs:
        transport = output.parts[-3]
        reading = study_transport(transport, experiment)
        cells = replay(recording, lanes, reading, experiment.pressure_stride)
        about = attributes(
            f"Reduced models replayed on {experiment.name}, {transport} transport",
            "Error of every model at every n against the full-order run, and the pressures",
            study.config_sha256,
            code,
            experiment,
            comment=same_at_every_n(),
            transport=transport,
            samples=" ".join(map(str, experiment.sampling))
            if transport == PUBLISHED
            else "none: every stage",
        )
        write(replay_dataset(experiment, study.n, index, cells), output, about)


def main(parameters: Path, datum: list[Path], cells: list[Path], threads: int, code: str) -> None:
    study = read_study(parameters)
    # Longest first, so that the threads end together. The kernels hold no lock while they run.
    longest_first = sorted(datum, key=lambda file: -study.experiments[file.stem].steps)

    def replay_file(file: Path) -> None:
        outputs = [output for output in cells if output.stem == file.stem]
        replay_one(study, file, outputs, code)
        print(f"{file.stem}: {len(outputs)} replays of the whole grid, done", flush=True)

    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(replay_file, longest_first))


run_job(main, globals())

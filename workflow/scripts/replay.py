"""Replay every model at every n on one recorded experiment, with both transports."""

from pathlib import Path

from pneumo.job import logged
from pneumo.physics.exchange import from_json
from pneumo.simulate.cells import grid_lanes, replay_dataset
from pneumo.simulate.lanes import replay
from pneumo.simulate.replay import PUBLISHED
from pneumo.simulate.results import recording_from
from pneumo.store import attributes_of, read, write


def main(parameters: str, datum: str, outputs: list[str], code: str) -> None:
    study = from_json(Path(parameters).read_text())
    experiment = study.experiments[Path(datum).stem]
    recording = recording_from(read(datum))
    lanes, index = grid_lanes(study.n, experiment.plant.gas.gamma)
    for output in outputs:
        transport = Path(output).parts[-3]
        cells = replay(
            recording,
            lanes,
            experiment.drive,
            experiment.plant,
            experiment.h,
            transport=transport,
            lag=study.lag if transport == PUBLISHED else 0.0,
            stride=experiment.pressure_stride,
        )
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


if job := globals().get("snakemake"):
    with logged(job):
        files, code = job.input, job.params.code
        main(files.parameters, files.datum, list(job.output), code)

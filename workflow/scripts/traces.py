"""Errors of the models at every step of every run, by interval, and the samples that the report shows."""

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from pneumo.jobs.wrapper import run_job
from pneumo.storage.files import read, read_study
from pneumo.storage.layout import recording_from
from pneumo.storage.trace_layout import write_traces


def main(
    parameters: Path, datum: list[Path], statistics: list[Path], traces: list[Path], threads: int, code: str
) -> None:
    """Write a file for each experiment and sampling; the folder of `statistics` names the sampling."""
    study = read_study(parameters)
    best_n = {file.parent.name: read(file, "best_n")["best_n"] for file in statistics}

    def trace_file(file: Path) -> None:
        outputs = {output.parts[-3]: output for output in traces if output.stem == file.stem}
        recording = recording_from(read(file), study.experiments[file.stem])
        write_traces(study, file.stem, recording, best_n, outputs, code)
        print(f"{file.stem}: traces, done", flush=True)

    with ThreadPoolExecutor(threads) as pool:  # longest first, so that the threads end together
        list(pool.map(trace_file, sorted(datum, key=lambda file: -study.experiments[file.stem].steps)))


run_job(main, globals())

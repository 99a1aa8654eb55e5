"""Replay every model at every n on every full-order run, with both signal samplings; gather traces."""

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from paper.study.stored_runs import read_study, recording_from
from paper.study.trace_layout import write_replays
from pneumo.storage.files import read
from workflow.jobs.wrapper import run_job


def main(parameters: Path, datum: list[Path], cells: list[Path], threads: int) -> None:
    study = read_study(parameters)
    # Longest first, so that the threads end together. The core holds no lock while they run.
    longest_first = sorted(datum, key=lambda file: -study.experiments[file.stem].steps)

    def replay_file(file: Path) -> None:
        outputs = {output.parts[-3]: output for output in cells if output.stem == file.stem}
        write_replays(study, file.stem, recording_from(read(file), study.experiments[file.stem]), outputs)
        print(f"{file.stem}: {len(outputs)} replays of the whole grid, done", flush=True)

    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(replay_file, longest_first))


run_job(main, globals())

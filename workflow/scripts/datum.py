"""Run the full-order system of every experiment."""

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from pneumo.jobs.wrapper import run_job
from pneumo.simulation.full_order import record
from pneumo.storage.files import attributes, read_study, write
from pneumo.storage.layout import datum_dataset, failure_text

UNCOMPRESSED = ("x", "v", "P")  # compressing takes half as long as the run, for files a fifth smaller


def main(parameters: Path, runs: list[Path], threads: int, code: str) -> None:
    study = read_study(parameters)
    # Longest first, so that the threads end together.
    runs = sorted(runs, key=lambda run: -study.experiments[run.stem].steps)
    experiments = [study.experiments[run.stem] for run in runs]
    title = "Full-order run of {}"
    summary = "Every step of the sixth-order model, eqs (3) to (8), against which models are judged"
    # The kernel holds no lock: the next runs are computed while one is written.
    with ThreadPoolExecutor(threads) as ahead:
        for run, e, recording in zip(runs, experiments, ahead.map(record, experiments), strict=True):
            dataset = datum_dataset(e, recording)
            about = attributes(title.format(e.name), summary, study.config_sha256, code, e)
            write(dataset, run, about, uncompressed=UNCOMPRESSED)
            print(f"{e.name}: full-order run, {e.duration:g} s, done", flush=True)
            if dataset["status"]:
                print(f"{e.name}: {failure_text(dataset)}", flush=True)


run_job(main, globals())

"""Write the checked study in SI units; run the full-order system of every experiment."""

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from paper.study.stored_runs import datum_dataset, failure_text, to_json
from pneumo.configuration.experiment import Study
from pneumo.simulation.full_order import record
from pneumo.storage.files import attributes, write, write_text
from workflow.jobs.wrapper import run_job


def main(study: Study, parameters: Path, runs: list[Path], threads: int) -> None:
    write_text(to_json(study), parameters)
    # Longest first, so that the threads end together.
    experiments = sorted((study.experiments[run.stem] for run in runs), key=lambda e: -e.steps)
    summary = "Every step of the sixth-order model, eqs (3) to (8), against which models are judged"
    # The core holds no lock: the next runs are computed while one is written.
    with ThreadPoolExecutor(threads) as ahead:
        for e, recording in zip(experiments, ahead.map(record, experiments), strict=True):
            dataset = datum_dataset(e, recording)
            about = attributes(f"Full-order run of {e.name}", summary, study.config_sha256, e)
            # Compressing would take as long as the run, for files a fifth smaller.
            write(dataset, runs[0].with_name(f"{e.name}.nc"), about, compressed=False)
            print(f"{e.name}: full-order run, {e.duration:g} s, done", flush=True)
            if dataset["status"]:
                print(f"{e.name}: {failure_text(dataset)}", flush=True)


run_job(main, globals())

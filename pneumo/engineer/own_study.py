"""`pneumo study`: the ten models on a cylinder of one's own, from configuration to ranking and files."""

from collections.abc import Callable, Sequence
from pathlib import Path

import xarray as xr

from pneumo.configuration.experiment import Study
from pneumo.engineer.repeated_runs import repeated, seeds_of
from pneumo.errors import InputError, ResultError
from pneumo.hashing import code_hash
from pneumo.publish.pages.study_page import MARK, render
from pneumo.statistics.ranking import Ranking, ranked
from pneumo.storage.files import read, write, write_text

PAGE, CELLS = "study.html", "study.nc"
TITLE = "Reduced models on repeated runs"


def chosen(study: Study, cylinders: Sequence[str] = (), experiments: Sequence[str] = ()) -> Study:
    """Return a study of the named cylinders and experiments only; of all where none is named.

    Raises
    ------
    InputError
        If there is no such cylinder or experiment, or nothing is left.
    """
    names = {
        "cylinder": {e.cylinder for e in study.experiments.values()},
        "experiment": set(study.experiments),
    }
    for kind, wanted in (("cylinder", cylinders), ("experiment", experiments)):
        for name in wanted:
            if name not in names[kind]:
                there = ", ".join(sorted(names[kind])[:20])
                raise InputError(f"{kind} = {name[:50]!r}: no such {kind} in this study; there are {there}")
    left = {
        name: e
        for name, e in study.experiments.items()
        if (not cylinders or e.cylinder in cylinders) and (not experiments or name in experiments)
    }
    if not left:
        raise InputError("no experiment is of the cylinders and experiments named")
    return study._replace(experiments=left)


def check_folder(folder: Path) -> None:
    """Make sure that a study may write into a folder.

    Raises
    ------
    InputError
        If it is a file, cannot be written, or holds a page or cells that no study wrote.
    """
    if folder.exists() and not folder.is_dir():
        raise InputError(f"{folder}: is a file; name a folder with -o")
    page, cells = folder / PAGE, folder / CELLS
    foreign = None
    if page.exists() and not (page.is_file() and MARK.encode() in page.read_bytes()[:1000]):
        foreign = page
    if cells.exists():
        try:
            foreign = foreign or (None if read(cells).attrs.get("title") == TITLE else cells)
        except ResultError:
            foreign = cells
    if foreign:
        raise InputError(
            f"{foreign}: not written by `pneumo study`, so left alone; name another folder with -o"
        )


def simulated_time(study: Study) -> float:
    """Time that all runs of a study simulate together, s."""
    return sum(e.steps * e.h * len(seeds_of(e, study.seeds)) for e in study.experiments.values())


def run_study(study: Study, threads: int, tell: Callable[[float], None] = lambda seconds: None) -> xr.Dataset:
    """Run every experiment of a study with its seeds.

    Parameters
    ----------
    study : Study
    threads : int
        The result does not depend on it.
    tell : callable
        Called after each run with the time that it simulated, s.

    Returns
    -------
    xarray.Dataset
        See `pneumo.engineer.repeated_runs.repeated`.
    """
    return repeated(list(study.experiments.values()), study.n, study.seeds, threads, tell)


def rankings(cells: xr.Dataset) -> list[Ranking]:
    """Rank the models on each cylinder of a study, in the order of the configuration."""
    return [ranked(cells, name) for name in dict.fromkeys(cells["cylinder"].values.tolist())]


def joined(parts: Sequence[xr.Dataset]) -> xr.Dataset:
    """Put the cells of several cylinders together; the one run of a signal that is not random is repeated."""
    runs = max(part.sizes["run"] for part in parts)
    parts = [part.isel(run=[0] * runs) if part.sizes["run"] == 1 else part for part in parts]
    return xr.concat(parts, "experiment", join="exact", compat="equals", combine_attrs="drop_conflicts")


def save_cells(study: Study, cells: xr.Dataset, file: Path) -> None:
    """Write the cells of a study."""
    attributes = {
        "title": TITLE,
        "summary": "Error of every model at every n against full-order runs, over several seeds",
        "comment": "M1, M3 and M4 have no n: they hold the same cell at every n",
        "transport": "exact",
        "study": study.name,
        "config_sha256": study.config_sha256,
        "code_sha256": code_hash("pneumo.engineer.repeated_runs"),
    }
    write(cells, file, attributes)


def save_study(study: Study, cells: xr.Dataset, found: Sequence[Ranking], folder: Path) -> tuple[Path, Path]:
    """Write page and cells of a study.

    Returns
    -------
    page, cells : pathlib.Path
    """
    save_cells(study, cells, folder / CELLS)
    write_text(render(study, cells, found), folder / PAGE)
    return folder / PAGE, folder / CELLS

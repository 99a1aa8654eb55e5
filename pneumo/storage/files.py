"""Results on disk: NetCDF and JSON files, written atomically.

A rewrite of the same result gives the same bytes, so there are versions but no times or host names inside.
"""

import json
import math
import os
import subprocess
import threading
from collections.abc import Generator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from functools import cache
from glob import escape
from importlib.metadata import version
from pathlib import Path
from secrets import token_hex
from typing import Any

import xarray as xr
from netCDF4 import Dataset

from pneumo.configuration.experiment import Experiment, plain
from pneumo.errors import SYSTEM, InputError, ResultError, printable
from pneumo.physics.symbols import SYMBOLS
from pneumo.regular_file import LARGEST_RESULT, lock, named, regular_file

DOI = "https://doi.org/10.1243/09596518JSCE203"
COMMON = {
    "Conventions": "CF-1.11, ACDD-1.3",
    "institution": "pneumo developers",
    "source": "pneumo: numerical simulation",
    "references": DOI,
    "license": "MIT",
    "keywords": "servo-pneumatics, reduced-order models, thermodynamics",
    "creator_name": "pneumo developers",
}
LIBRARIES = ("numpy", "scipy", "xarray", "netCDF4")  # behind a result, with their versions in each file
ABOUT = {  # attributes of variables, by name; these coordinates have no unit
    "chamber": {"long_name": "chamber of the cylinder, A or B"},
    "quantity": {"long_name": "pressure or temperature of a chamber"},
    "experiment": {"long_name": "name of the experiment"},
    "cylinder": {"long_name": "name of the cylinder"},
    "loop": {"long_name": "open or closed loop"},
    "model": {"long_name": "name of the reduced model"},
    "level": {"long_name": "experiments that are averaged, by their wall conductance"},
} | {name: {"long_name": symbol.long_name, "units": symbol.unit} for name, symbol in SYMBOLS.items()}
CHECKOUT = Path(__file__).parents[2]
LOCK = threading.Lock()  # HDF5 serves one thread at a time
PART = ".part"  # ends the names of files that are being written
LARGEST_IN_MEMORY = 8_000_000_000  # bytes of the variables that are read from a file
NEW_FILE = os.O_CREAT | os.O_EXCL | os.O_WRONLY | getattr(os, "O_NOFOLLOW", 0)
EXPERIMENT_LABELS = ("cylinder", "loop", "k_0")  # scalar coordinates of every per-experiment file

GRID = ("mean_error", "variance", "mse", "status", "failure_time")  # of every cell of an experiment


@contextmanager
def atomic(path: Path) -> Generator[Path]:
    """Yield a temporary path; rename it to `path` on success, delete it on failure.

    Its name is random, so that nobody can have put a link there before. Temporary files that a killed process
    left are deleted: callers keep other processes from the same file, by `output_folder` or locks of runs.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    for remains in path.parent.glob(f".{escape(path.name)}.*{PART}"):
        remains.unlink(missing_ok=True)
    part = path.with_name(f".{path.name}.{token_hex(8)}{PART}")
    os.close(os.open(part, NEW_FILE, 0o666))
    try:
        with named(path):
            yield part
        part.replace(path)
    except BaseException:
        part.unlink(missing_ok=True)
        raise


@contextmanager
def output_folder(folder: Path) -> Generator[None]:
    """Make a folder for output and lock it while the `with` block runs; remove it afterwards if it is empty.

    `InputError` if it cannot be written, or is locked already. On Windows it is neither locked nor removed.
    """
    check_output(folder)
    folder.mkdir(parents=True, exist_ok=True)
    with ExitStack() as stack:
        if os.name != "nt":  # where a folder cannot be opened
            descriptor = os.open(folder, os.O_RDONLY)
            stack.callback(os.close, descriptor)
            try:
                lock(descriptor, wait=False)
            except BlockingIOError:
                problem = "another pneumo writes there; wait, or name another folder with -o"
                raise InputError(f"{folder}: {problem}") from None
            stack.callback(_remove_if_empty, folder)
        yield


def _remove_if_empty(folder: Path) -> None:
    with suppress(OSError):
        folder.rmdir()


def check_output(folder: Path) -> None:
    """Raise `InputError` unless a folder exists or can be made, and is writable."""
    parent = next(each for each in (folder, *folder.absolute().parents) if each.exists())
    if not parent.is_dir():
        raise InputError(f"{parent}: is a file; name a folder with -o")
    if not os.access(parent, os.W_OK | os.X_OK):
        raise InputError(f"{folder}: cannot be written; name another folder with -o")


def attributes(
    title: str, summary: str, config_sha256: str, experiment: Experiment | None = None, **others: object
) -> dict[str, Any]:
    """Global attributes of a results file: title, summary, and the configuration's SHA-256.

    The parameters of `experiment`, if the file is about a single one, are added as JSON.
    """
    about = {"title": title, "summary": summary, **others}
    if experiment is not None:
        about["experiment_parameters"] = json.dumps(plain(experiment))
    return {**about, "config_sha256": config_sha256}


@cache
def made_with() -> dict[str, str]:
    """Global attributes that name pneumo's version, the checked out commit and the versions of libraries."""
    commit = "not a checkout"
    if (CHECKOUT / ".git").exists():
        command = ["git", "-C", str(CHECKOUT), "rev-parse", "HEAD"]
        with suppress(OSError, subprocess.CalledProcessError):
            commit = subprocess.run(command, capture_output=True, check=True, text=True).stdout.strip()
    libraries = ", ".join(f"{name} {version(name)}" for name in LIBRARIES)
    made = f"pneumo {version('pneumo')}"
    return {
        "product_version": made,
        "commit": commit,
        "libraries": libraries,
        "history": f"made by {made} (commit: {commit})",
    }


def write(
    dataset: xr.Dataset,
    path: Path | str,
    attributes: Mapping[str, Any],
    digits: int | None = None,
    compressed: bool = True,
) -> None:
    """Write a dataset atomically as NetCDF-4, `compressed` or not; make its folder if necessary.

    Variables named in `ABOUT` get its units and long names.
    `attributes` are added to the global attributes that all files have. With `digits`, floating-point
    variables are rounded with a relative error below 10**-digits and stored in 4 bytes.
    """
    dataset = dataset.assign_attrs(COMMON | made_with() | dict(attributes))  # a copy
    for name, variable in dataset.variables.items():
        variable.attrs = ABOUT.get(str(name), {}) | variable.attrs
    encoding: dict[str, dict[str, Any]] = {str(name): {"_FillValue": None} for name in dataset.coords}
    for name, variable in dataset.data_vars.items():
        numeric = compressed and variable.dtype.kind in "fiu" and variable.ndim
        encoding[str(name)] = {"zlib": True, "complevel": 1, "shuffle": True} if numeric else {}
        if digits is not None and variable.dtype.kind == "f":
            bits = int(digits * math.log2(10))  # of the fraction
            rounded = {"significant_digits": bits, "quantize_mode": "BitRound", "complevel": 9}
            encoding[str(name)] |= {"dtype": "float32", **rounded}
        if variable.dtype.kind != "f":
            encoding[str(name)]["_FillValue"] = None
    with atomic(Path(path)) as part:
        try:
            with LOCK:
                dataset.to_netcdf(part, engine="netcdf4", encoding=encoding)
        except RuntimeError as error:  # of HDF5, which does not say why
            raise ResultError(f"{path}: cannot be written ({error}); is the disk full?") from None


def write_text(text: str, path: Path | str) -> None:
    """Write a text file atomically."""
    with atomic(Path(path)) as part:
        part.write_text(text, encoding="utf-8")


def absent(path: Path | str) -> ResultError:
    """Error of a results file that is missing."""
    return ResultError(f"{path}: no such file; `snakemake -j2` makes the results")


def check_sizes(path: Path, largest: int, variables: Sequence[str] = ()) -> None:
    """Raise ValueError if variables of a NetCDF file would take more than `largest` bytes in memory together.

    Counted are the `variables` that the file has, by default all, and always the coordinates: xarray loads
    these when it opens the file.
    """
    with Dataset(path.absolute()) as file:
        names = {*variables, *file.dimensions} & file.variables.keys() if variables else file.variables
        of = {name: file.variables[name] for name in names}
        # Of text at least a pointer for each.
        sizes = {name: math.prod(v.shape) * getattr(v.dtype, "itemsize", 8) for name, v in of.items()}
    if sum(sizes.values()) > largest:
        name = max(sizes, key=lambda name: sizes[name])
        needed = f"{printable(name, 40)} would take {sizes[name]} bytes of memory"
        raise ValueError(f"{needed}: at most {largest} for all")


def read(path: Path | str, *variables: str) -> xr.Dataset:
    """Read a results file, or some of its variables, into memory.

    Raises
    ------
    ResultError
        If the file is missing, damaged, truncated or not from pneumo, a variable is missing in it, or its
        experiment is not the one of its name.
    """
    path = Path(path)
    try:
        with regular_file(path, LARGEST_RESULT), LOCK:
            check_sizes(path, LARGEST_IN_MEMORY, variables)
        # Absolute: a relative name might look like a network address.
        with LOCK, xr.open_dataset(path.absolute(), engine="netcdf4") as dataset:
            if dataset.attrs.get("source") != COMMON["source"]:
                raise ResultError(f"{path}: was not written by pneumo")
            experiment = dataset.coords.get("experiment")
            if experiment is not None and experiment.ndim == 0 and experiment.item() != path.stem:
                raise ResultError(f"{path}: holds experiment {experiment.item()}, not the one of its name")
            for name in variables:
                if name not in dataset:
                    names = ", ".join(map(str, dataset))
                    raise ResultError(f"{path}: has no variable {name!r}; it has {names}")
            return dataset[list(variables)].load() if variables else dataset.load()
    except FileNotFoundError:
        raise absent(path) from None
    except ResultError:
        raise
    except (OSError, RuntimeError, LookupError, ValueError, TypeError, AttributeError) as error:
        if isinstance(error, OSError) and error.errno in SYSTEM:  # the file may be good
            raise ResultError(f"{path}: cannot be read ({error.strerror})") from None
        text = " ".join(str(error).split())
        raise ResultError(f"{path}: not a readable NetCDF-4 file ({text}); delete it and rerun") from None


def open_grid(folder: Path | str) -> xr.Dataset:
    """Open the errors of all models, values of n and experiments in a folder such as ``results/exact``.

    Returns
    -------
    xarray.Dataset
        mean_error, Pa, variance, Pa^2, mse, Pa^2, status and failure_time, s, over (experiment, model, n,
        chamber), without the pressures. Cylinder, loop and k_0 are coordinates along experiment.

    Raises
    ------
    ResultError
        If the folder holds no replays, or one of them cannot be read.
    """
    files = sorted(Path(folder, "replay").glob("*.nc"))
    if not files:
        raise ResultError(f"{folder}: holds no replay/*.nc; `snakemake -j2` makes them")
    parts = [read(file, *GRID).drop_vars("t", errors="ignore") for file in files]
    labels = list(EXPERIMENT_LABELS)
    return xr.concat(parts, "experiment", coords=labels, compat="equals", combine_attrs="drop_conflicts")

"""Fits for notebooks and scripts: objects with text, tables, figures and checks.

Progress goes to the logger `pneumo`: `logging.basicConfig(level="INFO")` shows it.
"""

import logging
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from tempfile import TemporaryDirectory
from textwrap import shorten
from typing import Any, Literal

import numpy as np
import pandas as pd
import xarray as xr
from markupsafe import escape
from matplotlib.figure import Figure

from pneumo.arguments import listed, number
from pneumo.configuration.experiment import Plant
from pneumo.configuration.parameters import configured_dynamics, load, sonic_conductance, with_one_b
from pneumo.configuration.parameters import study as in_SI
from pneumo.configuration.priors import accuracy, default_notes
from pneumo.configuration.sampling import HELD, INTERPOLATED
from pneumo.configuration.schema import Configuration
from pneumo.equations.named_model import model_row
from pneumo.errors import InputError, printable
from pneumo.fitting.closed.closed_fit import fit_closed
from pneumo.fitting.fit_result import FitResult
from pneumo.fitting.fitted_yaml import fitted_configuration
from pneumo.fitting.measurement_fit import fit_measurement, fitted_too, validation
from pneumo.fitting.mistaken_columns import check_columns
from pneumo.fitting.position_checks import position_shown
from pneumo.fitting.record.columns import Columns
from pneumo.fitting.record.joined_records import joined
from pneumo.fitting.record.measurement import Measurement, read_measurement
from pneumo.fitting.settings import FEWEST_SAMPLES, MOST_STEPS, PART
from pneumo.fitting.stage_signals import steps_between_samples
from pneumo.physics.models import MODELS
from pneumo.publish.figures.fit_figures import residual_figure
from pneumo.publish.pages.fit_page import fit_page
from pneumo.publish.text.terminal_tables import shown_quantity
from pneumo.quantities.table import FULL_ORDER, QUANTITIES
from pneumo.selection.plants import configured_plant
from pneumo.storage.files import check_output, write_text

Record = Path | str | pd.DataFrame | xr.Dataset
LOGGER = logging.getLogger("pneumo")
LONGEST = 48  # characters of a warning in the text of a fit


@dataclass(frozen=True, repr=False)
class RecordFit:
    """Models fitted to a record, from `pneumo.fit`."""

    result: FitResult
    measurement: Measurement
    plant: Plant  # as configured
    configuration: Configuration
    cylinder: str
    command: Literal["held", "linear"]
    x_from: Literal["mid", "end"] = "mid"

    @property
    def warnings(self) -> list[str]:
        """Reasons not to believe the fit, a sentence each."""
        return list(self.result.warnings)

    @property
    def notes(self) -> list[str]:
        """Remarks on the record, a sentence each."""
        return list(self.result.notes)

    @cached_property
    def estimates(self) -> pd.DataFrame:
        """Estimates by (model, parameter), SI units: value, ends of the 95 per cent interval, unit."""
        rows = [
            {"model": model, "parameter": name, **interval._asdict(), "unit": QUANTITIES[name].unit}
            for model in self.result.models
            for name, interval in self.result.estimates(model).items()
        ]
        return pd.DataFrame(rows).set_index(["model", "parameter"])

    @property
    def errors(self) -> pd.DataFrame:
        """Root mean square errors, Pa, by model and chamber, on the part fitted and on that held out."""
        parts: Any = {name: self.result.data[name].to_pandas() for name in ("rms_fitted", "rms_held_out")}
        return pd.concat(parts, axis="columns").loc[self.result.models]

    @property
    def residuals(self) -> xr.DataArray:
        """Measured minus replayed pressures, Pa, by (model, chamber, t)."""
        return (self.result.data["P"] - self.result.data["pressure"]).rename("residual")

    def to_xarray(self) -> xr.Dataset:
        """Measured and replayed pressures, estimates and errors, as the saved NetCDF file has them."""
        return self.result.data

    def to_pandas(self) -> pd.DataFrame:
        """Estimates, as the attribute `estimates`."""
        return self.estimates

    def plot(self) -> Figure:
        """Figure of measured and replayed pressures of the best model, with residuals."""
        return residual_figure(self.result)

    @property
    def _record(self) -> str:
        """Names of the files of the records, with commas."""
        return ", ".join(Path(name).name for name in self.measurement.name.split(", "))

    def __repr__(self) -> str:
        """Text of at most ten lines: errors on the part held out, the rig's parameters, warnings."""
        result = self.result
        errors = [f"{model} {result.error(model) / 1e3:.3g}" for model in result.models[:4]]
        lines = [f"fit of {self.measurement.name}: RMS error held out (kPa): {', '.join(errors)}"]
        for name, interval in list(result.estimates(result.model_of_rig).items())[:6]:
            heading, unit, factor = shown_quantity(result, name)
            shown = interval.scaled(factor)
            value = f"{shown.value:.4g} {unit}".rstrip()
            lines.append(f"  {heading} = {value} ({shown.ends_text('.3g')})")
        lines += [f"  warning: {shorten(text, LONGEST, placeholder=' ...')}" for text in self.warnings[:2]]
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        """Table of the estimates with warnings, for notebooks."""
        warnings = "".join(f"<p><strong>Warning:</strong> {escape(text)}</p>" for text in self.warnings)
        return warnings + self.estimates.to_html(float_format="{:.4g}".format)

    @property
    def correlation(self) -> pd.DataFrame:
        """Correlation of the parameters of the full order, or else of the best model."""
        models = self.result.models
        model = FULL_ORDER if FULL_ORDER in models else models[0]
        return self.result.correlation(model)

    def export(
        self, file: Path | str, model: str = FULL_ORDER, to: str = "c", name: str | None = None
    ) -> list[Path]:
        """Write a fitted model as source code or FMU, as `pneumo export` does from ``fitted.yaml``.

        `name` is the option ``--name``: names in the code begin with it.
        """
        from pneumo.notebook.export_model import export_model  # with SymPy, which takes half a second

        with TemporaryDirectory() as folder:
            text = Path(folder, "fitted.yaml")
            text.write_text(self._fitted(), encoding="utf-8")
            fitted = load(text)
        has_n = model in MODELS and MODELS[model].has_n
        n = self.result.estimates(model)["n"].value if has_n else None
        return export_model(fitted, self.cylinder, model, n, to, file, name)

    def _fitted(self) -> str:
        """Text of ``fitted.yaml``."""
        rest = self.configuration, self.cylinder, self.plant, self.result, self._record
        return fitted_configuration(*rest, self.measurement)

    def validate(self, other: Record | Measurement, columns: Columns | None = None) -> pd.DataFrame:
        """Root mean square errors, Pa, of the fitted models on another record, by model and chamber.

        Nothing but first pressures and temperatures is fitted there.
        """
        if self.result.closed:
            raise InputError(
                "validate: laws of closed chambers are not judged on another record; leave it out"
            )
        about = self.configuration, self.cylinder
        is_read = isinstance(other, Measurement)
        measurement = other if is_read else read_record(other, *about, columns=columns, x_from=self.x_from)
        errors = validation(self.result, measurement, self.plant, command=_SAMPLING[self.command])
        return pd.DataFrame.from_dict(errors, orient="index", columns=["A", "B"]).rename_axis("model")

    def save(self, folder: Path | str) -> None:
        """Write fit.html, fit.nc and fitted.yaml into a folder."""
        check_output(Path(folder))
        self.result.save(in_SI(self.configuration).config_sha256, Path(folder, "fit.nc"))
        write_text(fit_page(self.result, self._record), Path(folder, "fit.html"))
        write_text(self._fitted(), Path(folder, "fitted.yaml"))


_SAMPLING = {"held": HELD, "linear": INTERPOLATED}
ORIGINS = ("mid", "end")
PARTS = (0.2, 0.9)  # of a record, that may be fitted


def _check(option: str, value: str, allowed: Iterable[str]) -> None:
    """Raise `InputError` if a word is none of those allowed."""
    if value not in allowed:
        raise InputError(f"{option} = {printable(str(value), 30)!r}: must be one of {', '.join(allowed)}")


def _configuration(configuration: Configuration | Path | str) -> Configuration:
    return configuration if isinstance(configuration, Configuration) else load(configuration)


def read_record(
    record: Record,
    configuration: Configuration | Path | str,
    cylinder: str | None = None,
    *,
    columns: Columns | None = None,
    x_from: Literal["mid", "end"] = "mid",
    closed: bool = False,
) -> Measurement:
    """Record of a cylinder in SI units, uniform in time, checked as by `fit`, but for swapped columns.

    Parameters
    ----------
    record
        File, or a table whose columns are named as those of a file (`P_A_kPa`).
    configuration
        Configuration or its file.
    cylinder
        Its name in the configuration; may be left out if there is only one.
    columns
        Column and unit of each quantity, as ``{"x": {"column": "s2", "unit": "mm"}}``; by default by headers.
    x_from
        Whether x is zero in mid-stroke or at chamber A's end.
    closed
        Whether both chambers were closed: needs no command or flows. Assumed too where these are all zero.

    Raises
    ------
    InputError
        If the record cannot be read, or one of its values is impossible.
    """
    _check("x_from", x_from, ORIGINS)
    plant = configured_plant(in_SI(_configuration(configuration)), cylinder, 1.0)
    return read_measurement(record, plant, columns, from_end=x_from == "end", closed=closed)


def fit(
    record: Record | Sequence[Record],
    configuration: Configuration | Path | str,
    cylinder: str | None = None,
    *,
    models: Sequence[str] | None = None,
    columns: Columns | None = None,
    x_from: Literal["mid", "end"] = "mid",
    command: Literal["held", "linear"] = "held",
    part: float = PART,
    also: Sequence[str] = (),
    trust: bool = False,
    closed: bool = False,
    closed_from: float = 0.0,
    progress: Callable[[str], None] = LOGGER.info,
) -> RecordFit:
    """Fit models to a record of a cylinder at work, or thermal laws to closed chambers.

    The command `pneumo fit` does the same.

    Parameters
    ----------
    record, configuration, cylinder, columns, x_from
        As in `pneumo.read_record`; several records, in a list, are fitted together.
    models
        Names of models, by default all; the full order is fitted in any case, if the record has commands.
    command
        Whether the command was held between samples, or changed linearly.
    part
        Fraction of the record that is fitted, 0.2 to 0.9; the rest is held out.
    also
        Names of quantities fitted too, without prior knowledge; the table is in {doc}`fit-reference`.
    trust
        Skip the check for swapped or wrong columns.
    closed
        Whether both chambers were closed, as they are where u, or m_A and m_B, are zero in every sample.
    closed_from
        Time from which they are closed, s.
    progress
        Is called with a line after each model.

    Raises
    ------
    InputError
        If the record cannot be used, or an argument is none of those allowed.
    """
    _check("command", command, _SAMPLING)
    number("part", part, *PARTS)
    chosen = MODELS if models is None else listed("models", models)
    reduced = [model_row(name, FULL_ORDER).name for name in chosen if name != FULL_ORDER]
    also = listed("also", also)
    configuration = _configuration(configuration)
    configured = in_SI(configuration)
    named = cylinder or next(iter(configured.experiments.values())).cylinder  # the only one
    k_0 = next((e.plant.k_0 for e in configured.experiments.values() if e.cylinder == named), 1.0)
    plant = with_one_b(configured_plant(configured, cylinder, k_0), configuration.cylinders[named])
    records = [
        read_record(file, configuration, cylinder, columns=columns, x_from=x_from, closed=closed)
        for file in ([record] if isinstance(record, Path | str | pd.DataFrame | xr.Dataset) else record)
    ]
    if not records:
        raise InputError("record: an empty list: must have at least one record")
    most = MOST_STEPS // max(steps_between_samples(m, plant) for m in records)
    measurement, part = joined(records, part, most)
    for note in measurement.notes:
        progress(f"note: {note}")
    rule = _SAMPLING[command]
    if measurement.closed:
        for name in [name for name, given in (("models", models), ("also", also)) if given]:
            raise InputError(f"{name}: the fit of closed chambers has no such choice; leave it out")
        rest = measurement.part(int(np.searchsorted(measurement.t, closed_from)))
        if len(rest.u) < FEWEST_SAMPLES:
            left = f"leaves {len(rest.u)} samples of {measurement.t[-1]:g} s"
            raise InputError(f"--closed-from {closed_from:g} s: {left}: must be at least {FEWEST_SAMPLES}")
        result = fit_closed(rest, plant, part=part, check=not trust, progress=progress)
    else:
        if closed_from:
            problem = "is no record of closed chambers; leave it out, or --closed both"
            raise InputError(f"--closed-from {closed_from:g} s: {measurement.name} {problem}")
        if not trust:
            for file in records:
                check_columns(file, plant, command=rule)
        unmeasured = ["P_atm"] if "P_A" in measurement.zeros else []
        unmeasured += [] if np.isfinite(measurement.T) else ["T_amb", "T_in"]
        result = fit_measurement(
            measurement,
            plant,
            reduced,
            command=rule,
            part=part,
            also=fitted_too(
                also, measurement, configured_dynamics(configuration, named), configuration.supply.sag
            ),
            known=accuracy(configuration, position_shown(measurement, plant), named, unmeasured),
            progress=progress,
        )
        result = replace(result, notes=(*result.notes, *default_notes(configuration, unmeasured)))
    if configuration.cylinders[named].valve:
        C_per_k_xu = sonic_conductance(plant.valve, plant.gas) / plant.valve.k_xu
        result = replace(result, C_per_k_xu=C_per_k_xu)
    return RecordFit(result, measurement, plant, configuration, named, command, x_from)

"""Result of a fit: estimates of several models, notes and warnings, and their file."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal, NamedTuple, Self

import numpy as np
import pandas as pd
import xarray as xr

from pneumo.fitting.record.measurement import Measurement
from pneumo.fitting.settings import AS_GOOD
from pneumo.physics.models import Wall
from pneumo.quantities.table import FULL_ORDER, QUANTITIES, SHIFTING
from pneumo.statistics.intervals import Interval
from pneumo.storage.files import attributes, write

AS_STATED = "as stated"
COMMANDS_END = "the record's commands end at"  # reason of a light
# Of a parameter: determined, known from the configuration alone, to be checked, not determined.
Light = Literal["green", "as stated", "yellow", "red"]


class FitWarning(str):
    """Text of a warning, with the parameters that it concerns; without any, it concerns all of the rig."""

    __slots__ = ("parameters",)
    parameters: tuple[str, ...]

    def __new__(cls, text: str, *parameters: str) -> Self:
        """Make a sentence that concerns `parameters`."""
        warning = super().__new__(cls, text)
        warning.parameters = parameters
        return warning


class Estimate(NamedTuple):
    """One model, fitted; arrays of two are of chambers A and B."""

    # SI units, as the model is replayed; fixed ones too.
    values: dict[str, float]
    low: dict[str, float]  # ends of their 95 per cent intervals; NaN where open
    high: dict[str, float]
    rms: np.ndarray  # Pa, root mean square of measured minus replayed pressure on the part fitted
    held_out: np.ndarray  # Pa, the same on the part held out
    pressure: np.ndarray  # Pa, replayed, by (chamber, sample): each part from its own start
    # By parameter: shifts, SI units, by each configured quantity of `SHIFTING`, off by its accuracy.
    moved: Mapping[str, np.ndarray] = MappingProxyType({})
    # By parameter, on the scale of its search: half-width by which unexplained residuals may have moved it.
    remainder: Mapping[str, float] = MappingProxyType({})
    # By parameter, on that scale: half of the interval from noise and configuration alone.
    expected: Mapping[str, float] = MappingProxyType({})
    correlation: Mapping[str, Mapping[str, float]] = MappingProxyType({})  # of two parameters
    # The same, on that scale, where the errors of the sensor of x stay as they are.
    covariance: Mapping[str, Mapping[str, float]] = MappingProxyType({})
    # Pa, standard deviation of the residual by what is configured, within its accuracy.
    of_configuration: float = 0.0
    at_bound: tuple[str, ...] = ()  # parameters on a bound of the search
    held: tuple[str, ...] = ()  # parameters that the record leaves open: as configured, the others fitted so
    sag: float = 0.0  # fraction by which the supply may sag, for which intervals allow
    wall: Wall = "lambda A_q"  # law of the wall
    k_0_by_law: Mapping[Wall, float] = MappingProxyType({})  # W/K, of each law that fits about as well

    def moved_out(self, times: Mapping[str, float]) -> tuple[str, ...]:
        """Parameters outside their intervals if quantities are off by `times` their accuracy."""
        result: list[str] = []
        for name in (name for name in self.low if name in self.moved):
            shift = sum(self.moved[name][SHIFTING.index(quantity)] * off for quantity, off in times.items())
            if self.values[name] - shift < self.low[name] or self.values[name] - shift > self.high[name]:
                result.append(name)
        return tuple(result)


def rms_of_chambers(errors: np.ndarray) -> float:
    """Root mean square of the RMS errors of both chambers; a NaN one is left out."""
    return float(np.sqrt(np.nanmean(errors**2)))


def equally_good(estimates: Mapping[str, Estimate]) -> list[str]:
    """Models whose error on the part held out is at most `AS_GOOD` times the lowest."""
    errors = {name: rms_of_chambers(estimate.held_out) for name, estimate in estimates.items()}
    return [name for name in errors if errors[name] <= AS_GOOD * min(errors.values())]


@dataclass(frozen=True, kw_only=True)
class FitResult:
    """Models fitted to a cylinder behind a servo-valve, or thermal laws to closed chambers."""

    data: xr.Dataset  # from `fit_data`, the model with the lowest error on the part held out first
    notes: tuple[str, ...]  # remarks on the record, a sentence each
    warnings: tuple[str, ...]  # reasons not to believe the fit, a sentence each
    held_out_from: float  # s, time of the last sample that was fitted
    # Lights of the full order's parameters with the reason of those not green; empty without the full order.
    # Red: the interval has an open end or is very wide. Yellow: it is wide, or a warning of the rig concerns
    # the parameter. As stated: the interval is hardly narrower than that which the configuration states.
    judgements: Mapping[str, tuple[Light, str]] = field(default_factory=dict)
    u_max: float = np.nan  # V, limit of the command
    wall: Wall = "lambda A_q"  # law of the full order's wall
    C_per_k_xu: float | None = None  # dm^3/(s bar) per m^2/V, where the valve was configured by C
    closed: bool = False  # thermal laws of closed chambers, in place of models

    @property
    def models(self) -> list[str]:
        """Names of the models, or of the thermal laws, best first."""
        return [str(name) for name in self.data["model"].values]

    @property
    def fitted_commands(self) -> np.ndarray:
        """Commands of the part that was fitted, V; zero where flows were measured."""
        return self.data.get("u", 0 * self.data["t"]).sel(t=slice(None, self.held_out_from)).values

    @property
    def reached(self) -> float:
        """Largest command of the part that was fitted, V, within the limit."""
        return float(np.fmin(np.abs(self.fitted_commands).max(), self.u_max))

    @property
    def best_model(self) -> str:
        """Name of the best reduced model without a parameter on its bound: the one to replay or export.

        If every reduced model has a parameter on its bound, the best of them.
        """
        reduced = [name for name in self.models if name != FULL_ORDER]
        inside = [name for name in reduced if not self.on_bound(name)]
        return (inside or reduced or self.models)[0]

    def on_bound(self, model: str) -> bool:
        """Whether a parameter of a model is on a bound of the search."""
        return bool(self.data["at_bound"].sel(model=model).any())

    def error(self, model: str) -> float:
        """Root mean square error of a model on the part held out, Pa, over both chambers."""
        return rms_of_chambers(self.data["rms_held_out"].sel(model=model).values)

    @property
    def model_of_rig(self) -> str:
        """Name of the model whose parameters a configuration gets.

        The full order if it has intervals, else `best_model`: parameters of a reduced model also compensate
        for what that model lacks. Of closed chambers the best law that gives a k_0, if one does.
        """
        if self.closed:
            return next((law for law in self.models if "k_0" in self.estimates(law)), self.best_model)
        if FULL_ORDER not in self.models:
            return self.best_model
        ends = self.data[["low", "high"]].sel(model=FULL_ORDER).to_array()
        return FULL_ORDER if np.isfinite(ends).any() else self.best_model

    def estimates(self, model: str) -> dict[str, Interval]:
        """Estimates of a model with their intervals, by parameter, in SI units."""
        row = self.data.sel(model=model)
        columns = (row[name].values.tolist() for name in ("estimate", "low", "high"))
        intervals = dict(zip(self.data["parameter"].values.tolist(), map(Interval, *columns), strict=True))
        return {name: interval for name, interval in intervals.items() if np.isfinite(interval.value)}

    def held(self, model: str) -> set[str]:
        """Parameters of a model that the record leaves open: as configured, with the others fitted so."""
        marked = self.data["held"].sel(model=model)
        return {*self.data["parameter"].values[marked.values == 1].tolist()}

    def correlation(self, model: str, of: str = "correlation") -> pd.DataFrame:
        """Correlation of a model's parameters, or their "covariance", by their names."""
        table = self.data[of].sel(model=model).values
        fitted = np.isfinite(table).any(axis=0)
        names = self.data["parameter"].values[fitted]
        return pd.DataFrame(table[np.ix_(fitted, fitted)], index=names, columns=names)

    def summary(self) -> dict[str, Any]:
        """Estimates, errors, notes and warnings as plain numbers and texts, SI units; None where open."""

        def plain(value: float) -> float | None:
            return float(value) if np.isfinite(value) else None

        models = {
            model: {
                **{
                    name: self.data[name].sel(model=model).values.tolist()
                    for name in ("rms_fitted", "rms_held_out")
                },
                "parameters": {
                    name: {key: plain(end) for key, end in interval._asdict().items()}
                    | {"unit": QUANTITIES[name].unit}
                    for name, interval in self.estimates(model).items()
                },
            }
            for model in self.models
        }
        texts = {"notes": list(self.notes), "warnings": list(self.warnings)}
        colours = {name: light for name, (light, _) in self.judgements.items()}
        lights = {"lights": colours} if colours else {}
        return {"held_out_from": self.held_out_from, "models": models} | lights | texts

    def save(self, config_sha256: str, path: Path) -> None:
        """Write the result as NetCDF; its attributes `notes` and `warnings` have a line for each text."""
        summary = "Parameters with 95 per cent intervals, errors fitted and held out, pressures"
        fitted = "Thermal laws fitted to closed chambers" if self.closed else "Models fitted to a measurement"
        common = attributes(fitted, summary, config_sha256)
        C = {} if self.C_per_k_xu is None else {"C_per_k_xu": self.C_per_k_xu}
        texts = {"notes": "\n".join(self.notes), "warnings": "\n".join(self.warnings)}
        about = {"held_out_from": self.held_out_from, "wall": self.wall}
        write(self.data, path, about | texts | C | common)


def fit_data(
    measurement: Measurement, estimates: Mapping[str, Estimate], parameters: Sequence[str]
) -> xr.Dataset:
    """Dataset of several fitted models, in the order of `estimates`, and of the measured signals.

    Estimates and intervals are by (model, parameter), shifts by (model, parameter, quantity), errors by
    (model, chamber), replayed pressures by (model, chamber, t).
    """
    m = measurement
    every = list(estimates.values())
    chambers = ("chamber", "t")
    by_parameter = ("model", "parameter")

    def of_parameters(field: str, absent: Any = np.nan) -> np.ndarray:
        return np.array([[getattr(e, field).get(p, absent) for p in parameters] for e in every])

    def marks(field: str) -> np.ndarray:
        return np.array([[np.int8(p in getattr(e, field)) for p in parameters] for e in every])

    def errors(field: str, part: str) -> tuple[Any, ...]:
        about = {"long_name": f"root mean square error on the part {part}", "units": "Pa"}
        return ("model", "chamber"), np.array([getattr(e, field) for e in every]), about

    end = "end of the 95 per cent interval, in parameter_unit; NaN where open"
    data = xr.Dataset(
        {
            "rms_fitted": errors("rms", "fitted"),
            "rms_held_out": errors("held_out", "held out"),
            "estimate": (by_parameter, of_parameters("values"), {"long_name": "estimate, in parameter_unit"}),
            "low": (by_parameter, of_parameters("low"), {"long_name": f"lower {end}"}),
            "high": (by_parameter, of_parameters("high"), {"long_name": f"upper {end}"}),
            "at_bound": (by_parameter, marks("at_bound"), {"long_name": "1: on a bound of the search"}),
            "held": (by_parameter, marks("held"), {"long_name": "1: as configured, the others fitted so"}),
            "pressure": (("model", *chambers), np.array([e.pressure for e in every])),
            "P": (chambers, m.P, {"long_name": "measured absolute pressure"}),
            "x": ("t", m.x),
        },
        coords={
            "model": list(estimates),
            "parameter": list(parameters),
            "parameter_unit": ("parameter", [QUANTITIES[name].unit for name in parameters]),
            "chamber": ["A", "B"],
            "t": m.t,
        },
    )
    if m.m is None:
        data["u"] = "t", m.u
    else:
        flow = {"long_name": "measured mass flow into the chamber", "units": "kg s-1"}
        data["m"] = chambers, m.m, flow
    if any(e.moved for e in every):
        shifts = of_parameters("moved", np.full(len(SHIFTING), np.nan))
        about = {"long_name": "shift if a configured quantity is off by its accuracy, in parameter_unit"}
        data = data.assign_coords(quantity=list(SHIFTING))
        data["moved_by"] = (*by_parameter, "quantity"), shifts, about
    for name, about in (
        ("correlation", "of two parameters"),
        ("covariance", "of two parameters, or their logarithms, if the sensor of x stays the same"),
    ):
        if any(getattr(e, name) for e in every):
            tables = [pd.DataFrame(getattr(e, name)).reindex(parameters, columns=parameters) for e in every]
            data = data.assign_coords(other=list(parameters))
            data[name] = (*by_parameter, "other"), np.array(tables), {"long_name": about}
    return data

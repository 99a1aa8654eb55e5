"""Thermal laws judged on kept records of closed chambers, without and with leakage past the piston."""

from pathlib import Path

import numpy as np
import xarray as xr

from pneumo.fitting.closed.closed_problem import LAWS, ClosedRecord, Law, closed_problem, fitted_names
from pneumo.fitting.fit_result import Estimate

R_NITROGEN, GAMMA = 296.80, 1.4  # J/(kg K); at 0.3 to 1.6 MPa nitrogen is perfect within 1 %
T_WALL = 293.15  # K. ASSUME: not in the records; k scales with its inverse, predictions do not depend on it
P_0 = 1e6  # Pa; conductances are stated at P_0, T_WALL and mid-stroke
PART = 0.6  # of a record that is fitted
THINNED = 5  # every how many samples one is fitted: 0.1 s, while a stroke takes seconds
SHOWN = 60.0  # s, of errors in the figure
STILL = 0.05  # relative change of pressure below which a record has nothing to fit
# By their names in the file.
PARAMETERS = {"V_d_A": "V_d_A", "V_d_B": "V_d_B", "n": "n", "k_A": "k_0_A", "k_B": "k_0_B", "leak": "leak"}
TYPICAL = {"V_d_A": 2e-2, "V_d_B": 4e-2, "k_0_A": 10.0, "k_0_B": 10.0, "leak": 1e-9}  # m^3, W/K, kg/(s Pa)


def read_closed_record(path: Path) -> ClosedRecord:
    """Record from a NetCDF file with t, x, P_A, P_B and the attributes bore_m, rod_m, stroke_m."""
    with xr.open_dataset(path.absolute(), decode_times=False) as data:
        bore, rod, stroke = (float(data.attrs[f"{name}_m"]) for name in ("bore", "rod", "stroke"))
        t, x, P_A, P_B = (data[name].values.astype(float) for name in ("t", "x", "P_A", "P_B"))
    area = np.pi / 4 * bore**2
    return ClosedRecord(
        name=path.stem,
        t=t,
        x=x,
        P=np.array([P_A, P_B]),
        areas=(area, area - np.pi / 4 * rod**2),
        bore=bore,
        stroke=stroke,
        R=R_NITROGEN,
        gamma=GAMMA,
        T_wall=T_WALL,
        PT_0=P_0 * T_WALL,
    )


def is_still(record: ClosedRecord) -> bool:
    """Whether pressures hardly change, as in open chambers."""
    return bool(np.max(np.ptp(record.P, axis=1) / record.P.mean(axis=1)) < STILL)


def fit_law(record: ClosedRecord, law: Law, leaks: bool) -> Estimate:
    """Estimate of a law, fitted to the first `PART` of a record; without intervals."""
    names, fitted = fitted_names(law, leaks), int(PART * len(record.t))
    problem = closed_problem(record, law, names, TYPICAL, fitted, THINNED)
    theta = problem.solve().theta
    pressure, values = problem.replay(theta, len(record.t)), problem.values(theta)
    return Estimate({name: values[name] for name in names}, {}, {}, *problem.errors(pressure), pressure)


def judged(record: ClosedRecord) -> xr.Dataset:
    """Every law fitted to a record, without and with leakage past the piston.

    `fitted_rms` and `held_out_rms`, Pa, by (law, leakage, chamber); `value`, SI units, by (law, leakage,
    parameter), NaN where a law has no such parameter; `error`, Pa, predicted minus measured without leakage
    in the first `SHOWN` seconds of the part held out, by (law, chamber, t).
    """
    fits = [[fit_law(record, law, leaks) for leaks in (False, True)] for law in LAWS.values()]
    first, by = int(PART * len(record.t)), ("law", "leakage", "chamber")
    window = slice(first, first + int(np.searchsorted(record.t, SHOWN)), THINNED)
    errors = [(row[0].pressure - record.P)[:, window] for row in fits]
    values = [[[fit.values.get(name, np.nan) for name in PARAMETERS.values()] for fit in row] for row in fits]
    return xr.Dataset(
        {
            "fitted_rms": (by, [[fit.rms for fit in row] for row in fits], {"units": "Pa"}),
            "held_out_rms": (by, [[fit.held_out for fit in row] for row in fits], {"units": "Pa"}),
            "value": ((*by[:2], "parameter"), values),
            "error": (("law", "chamber", "t"), errors, {"units": "Pa"}),
        },
        {
            "law": list(LAWS),
            "leakage": ["none", "past the piston"],
            "chamber": ["A", "B"],
            "parameter": list(PARAMETERS),
            "t": ("t", THINNED * np.diff(record.t).mean() * np.arange(len(errors[0][0])), {"units": "s"}),
        },
    )

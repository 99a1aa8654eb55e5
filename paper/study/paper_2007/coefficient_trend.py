"""Heat transfer coefficients over V / A_q: measured, predicted, quoted by the paper, studied in 2006."""

from math import pi

import numpy as np
import xarray as xr

from paper.study.paper_2006 import printed_tables as of_2006
from paper.study.paper_2007.printed_tables import COLUMNS, PAPER_FOLDER
from paper.study.paper_2007.results import Results
from paper.study.paper_2007.simulated_example import P_0, T_0
from pneumo.catalogue import coefficient_times_length
from pneumo.physics.cylinder import wetted_area
from pneumo.verdict.published import read_cells

LENGTHS = np.geomspace(3e-3, 30e-3, 50)  # m


def trend(results: Results) -> xr.Dataset:
    """Heat transfer coefficients, W/(m^2 K), with their lengths V / A_q, m.

    Measured `lambda_0` by `column`, from `low` to `high` as the digits of its inputs allow; the catalogue's
    prediction by `length`; `quoted` by the paper; `studied` in 2006: lowest and highest k_0 over the area in
    mid-stroke, by (`cylinder`, `end`).
    """
    measured = {
        name: [results.printed[c, name].value for c in COLUMNS] for name in ("lambda_0", "V_f_over_A_q")
    }
    ranges = np.array([results.allowed(column)["lambda_0"] for column in COLUMNS])
    product, factor = coefficient_times_length()
    quoted = quoted_coefficient()
    sizes = {(c["row"], c["column"]): float(c["printed"]) for c in of_2006.read_table(2)}
    k_0 = [float(c["k_0"]) for c in of_2006.read_table(4)]
    studied = [[min(k_0) / sizes[c, "A_q0"], max(k_0) / sizes[c, "A_q0"]] for c in "DE"]
    lengths = [_length(1e-3 * sizes[c, "bore"], 1e-3 * sizes[c, "stroke"] / 2) for c in "DE"]
    low, high = product / factor, product * factor
    by_column = {"lambda_0": measured["lambda_0"], "low": ranges[:, 0], "high": ranges[:, 1]}
    arrays = {name: ("column", values) for name, values in by_column.items()}
    for name, prediction in (("predicted", product), ("predicted_low", low), ("predicted_high", high)):
        arrays[name] = "length", prediction / LENGTHS
    arrays |= {"quoted": ((), quoted["lambda_0"]), "studied": (("cylinder", "end"), studied)}
    units, metres = {"units": "W m-2 K-1"}, {"units": "m"}
    coords = {"column": list(COLUMNS), "length": ("length", LENGTHS, metres)}
    coords |= {"cylinder": ["D", "E"], "end": ["low", "high"]}
    coords |= {"V_f_over_A_q": ("column", measured["V_f_over_A_q"], metres)}
    coords |= {"length_studied": ("cylinder", lengths, metres), "length_quoted": quoted["length"]}
    return xr.Dataset({name: (*array, units) for name, array in arrays.items()}, coords)


def quoted_coefficient() -> dict[str, float]:
    """Coefficient that the paper quotes for another cylinder, and the one predicted from its size.

    ``lambda_0``, W/(m^2 K), is the quoted one, converted to P_0 and T_0: it grows with the root of P T.
    ``predicted`` and ``highest``, W/(m^2 K), come from `pneumo.catalogue`, from the product of lambda_0 and
    ``length``: V / A_q, m, with the piston at the end.
    """
    det = {c["column"]: float(c["printed"]) * float(c["scale"]) for c in read_cells("quoted", PAPER_FOLDER)}
    length = _length(det["bore"], det["stroke"])
    at_rest = det["lambda_av"] * (P_0 * T_0 / (det["P"] * det["T"])) ** 0.5
    product, factor = coefficient_times_length()
    by_experiment = {"length": length, "lambda_0": at_rest, "predicted": product / length}
    return {
        name: float(f"{v:.6g}")
        for name, v in (by_experiment | {"highest": product * factor / length}).items()
    }


def _length(bore: float, depth: float) -> float:
    """V / A_q of a chamber without dead volume, m."""
    V = pi / 4 * bore**2 * depth
    return V / wetted_area(V, bore)

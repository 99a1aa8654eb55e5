"""The paper's notation (Appendix 1): symbol, unit, LaTeX and long name of everything stored or drawn."""

from typing import NamedTuple


class Symbol(NamedTuple):
    """How a quantity is written: unit, symbol and name."""

    unit: str  # SI unit as UDUNITS reads it
    latex: str  # without dollar signs
    long_name: str  # plain words, for files and axes


SYMBOLS = {
    "t": Symbol("s", "t", "time from the start of the run"),
    "u": Symbol("V", "u", "command to the servo-valve before its limiter"),
    "x": Symbol("m", "x", "piston position from the centre"),
    "v": Symbol("m s-1", r"\dot{x}", "piston velocity"),
    "P": Symbol("Pa", "P", "absolute pressure of the air in the chamber"),
    "T": Symbol("K", "T", "temperature of the air in the chamber"),
    "T_amb": Symbol("K", "T_{amb}", "temperature of the wall and the surroundings"),
    "n": Symbol("1", "n", "polytropic index"),
    "k_0": Symbol("W K-1", "k_0", "thermal conductance of a chamber's wall at equilibrium"),
    "settling_time": Symbol("s", "t_s", "settling time after the force is released, 1 per cent criterion"),
    "pressure": Symbol("Pa", r"P_{M}", "pressure predicted by the reduced model"),
    "mean_error": Symbol("Pa", r"\mu", "mean of full-order minus reduced pressure"),
    "variance": Symbol("Pa2", r"\sigma^2", "population variance of full-order minus reduced pressure"),
    "std": Symbol("Pa", r"\sigma", "standard deviation of full-order minus reduced pressure"),
    "mse": Symbol("Pa2", r"\mathrm{MSE}", "mean square of full-order minus reduced pressure"),
    "failure_time": Symbol("s", "t", "time of the failure, NaN where there was none"),
    "best_n": Symbol("1", "n", "polytropic index of the lowest mean square error"),
    "p10": Symbol("Pa2", "P_{10}", "10 per cent percentile of the mean square error over experiments"),
    "p90": Symbol("Pa2", "P_{90}", "90 per cent percentile of the mean square error over experiments"),
}

"""The package's reduced models at arguments named as in `paper_equations`."""

from pneumo.physics.models import MODELS, lane, model_dP_dt, temperature


def evaluate(name, a, **changes):
    """Temperature and pressure rate of a model."""
    a = a | changes
    row = lane(MODELS[name], a["n"], a["gamma"])
    T = temperature(a["P"], a["P_0"], a["T_0"], row.a)
    return T, rate(name, a, T)


def rate(name, a, T):
    """Pressure rate of a model at any temperature T."""
    row = lane(MODELS[name], a["n"], a["gamma"])
    before = (a[key] for key in ("V", "dV_dt", "m_in", "m_out"))
    after = (a[key] for key in ("k_0", "P_0", "T_0", "T_in", "T_amb", "R", "gamma"))
    return model_dP_dt(a["P"], T, *before, a["A_q"] / a["A_q0"], *after, row)


def scale_of(name, a):
    """Sum of the sizes of a model's terms, Pa/s, before they cancel: the scale of its rounding error."""
    row = lane(MODELS[name], a["n"], a["gamma"])
    T = temperature(a["P"], a["P_0"], a["T_0"], row.a)
    area_ratio, PT_ratio = a["A_q"] / a["A_q0"], a["P"] * T / (a["P_0"] * a["T_0"])
    heat = row.explicit_heat * a["k_0"] * area_ratio**row.e_A * PT_ratio**row.e_PT * (a["T_amb"] + T)
    inlet = a["T_in"] if row.mixing else T
    flows = a["R"] * (row.n_in * a["m_in"] * inlet + row.n_out * a["m_out"] * T)
    return (row.n_V * a["P"] * abs(a["dV_dt"]) + flows + (a["gamma"] - 1) * heat) / a["V"]

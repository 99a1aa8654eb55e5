"""The package's reduced models at arguments named as in `paper_equations`."""

from hypothesis import strategies as st

from pneumo import testing as some
from pneumo.physics.models import MODELS, lane, model_dP_dt, temperature

RATES = st.floats(1e-9, 1e-2)  # of change of a volume, m3/s


def arguments():
    """Everything a reduced model reads, by name: the arguments of `paper_equations.M1` ... `M10`."""
    P, T, area = some.pressures(), some.temperatures(), st.floats(1e-4, 1.0)
    rate = st.just(0.0) | RATES | RATES.map(lambda value: -value)
    states = {"P": P, "V": st.floats(1e-6, 1e-2), "dV_dt": rate}
    states |= dict.fromkeys(("m_in", "m_out"), st.just(0.0) | st.floats(1e-9, 0.05))
    constants = {"T_amb": T, "T_in": T, "P_0": P, "T_0": T, "n": some.polytropic_indices()}
    constants |= {"gamma": some.gammas(), "R": some.gas_constants(), "k_0": some.conductances()}
    return st.fixed_dictionaries(states | constants | {"A_q": area, "A_q0": area})


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
    heat = row.wall_scale * a["k_0"] * area_ratio**row.e_A * PT_ratio**row.e_PT * (a["T_amb"] + T)
    inlet = a["T_in"] if row.mixing else T
    flows = a["R"] * (row.n_in * a["m_in"] * inlet + row.n_out * a["m_out"] * T)
    return (row.n_V * a["P"] * abs(a["dV_dt"]) + flows + (a["gamma"] - 1) * heat) / a["V"]

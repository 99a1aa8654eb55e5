"""Plants of `pneumo init`'s cylinder whose valve has a curve, or paths that differ."""

from pneumo.configuration.parameters import Sources, plant_of
from pneumo.configuration.plain_yaml import read_yaml
from pneumo.selection.cylinder_template import TEMPLATE

BASE = read_yaml(TEMPLATE)
STRAIGHT = {"u_V": [-10, 0, 10], "C_dm3_per_sbar": [1.5, 0, 1.5]}
CURVE = {"u_V": [0, 1, 2, 4, 6, 8, 10], "C_dm3_per_sbar": [0, 0.105, 0.3, 0.84, 1.26, 1.44, 1.5]}
OVERLAP = {"u_V": [-10, 0, 10], "C_dm3_per_sbar": [0, 0.3, 1.5], "exhaust_C_dm3_per_sbar": [1.5, 0.2, 0]}
CROSSING = {"u_V": [-10, 10], "C_dm3_per_sbar": [0, 1.5], "exhaust_C_dm3_per_sbar": [1.5, 0]}
FOUR = {"C_dm3_per_sbar": 1.1, "b": 0.25, "exhaust_ratio": 1.5, "exhaust_b": 0.5}


def plant(valve_B=None, **valve):
    """Plant of the template with another valve: a curve in place of C, or more keys beside it."""
    section = ({} if "curve" in valve else {"C_dm3_per_sbar": 1.5}) | {"b": 0.3} | valve
    mine = BASE["cylinders"]["mine"] | {"valve": section} | ({"valve_B": valve_B} if valve_B else {})
    return plant_of(Sources(BASE | {"cylinders": {"mine": mine}}).validated(), "open")


def throttled():
    """Plant of the template with throttles at both ports, a through rod and a return spring."""
    keys = {"throttle_A_dm3_per_sbar": 0.3, "throttle_B_dm3_per_sbar": 0.2, "rod_A_mm": 10.0}
    keys |= {"spring_N_per_m": 500.0, "spring_preload_N": 20.0}
    mine = BASE["cylinders"]["mine"] | keys
    return plant_of(Sources(BASE | {"cylinders": {"mine": mine}}).validated(), "open")

"""Dimensionless groups known before a run: ratios of times, masses of air, distances and forces."""

import numpy as np

from pneumo.configuration.experiment import Experiment, Plant
from pneumo.physics.cylinder import Side, chamber_of, volume
from pneumo.physics.valve import choked_flow
from pneumo.simulation.excitation import reference_series
from pneumo.simulation.settling import thermal_time_constant

KNOWN_GROUPS = {
    "thermal": "thermal time constant over mean time between reversals of the excitation",
    "exchange": "air through the valve in a thermal time constant over the air in a chamber",
    "breath": "air through the valve between reversals over the air in a chamber",
    "way": "way between reversals over stroke, at the speed that the command allows",
    "command": "rms of the command expected, over its limit",
    "friction": "friction at that speed over the force of the pressure at rest on the bore's area",
    "inertia": "force to reverse that speed in half the time between reversals, likewise",
    "stiffness": "angular frequency of the mass on the air times that time",
    "dead": "dead volume over the volume of half the stroke",
    "supply": "supply pressure over atmospheric pressure",
    "closed": "1 in closed, 0 in open loop",
}


def full_speed(plant: Plant) -> float:
    """Piston speed at which sonic inflow at full command keeps the pressure at rest, m/s."""
    gas, conditions = plant.gas, plant.conditions
    A_t = plant.valve.k_xu * plant.valve.u_max
    inflow = choked_flow(A_t, conditions.P_s, conditions.T_in, gas)
    return inflow * gas.R * conditions.T_in / (conditions.P_0 * plant.cylinder.A_A)


def reversal_time(reference: np.ndarray, h: float) -> float:
    """Mean time between changes of the sign of a signal about its mean, s; its length if there are none."""
    signs = np.sign(reference - reference.mean())
    signs = signs[signs != 0]
    return len(reference) * h / (1 + int(np.count_nonzero(np.diff(signs))))


def known_groups(experiment: Experiment) -> dict[str, float]:
    """`KNOWN_GROUPS` of an experiment; k_0 = 0 gives infinite `thermal` and `exchange`."""
    plant, drive, h = experiment.plant, experiment.drive, experiment.h
    gas, conditions, cylinder = plant.gas, plant.conditions, plant.cylinder
    reference = reference_series(drive, experiment.excitation, experiment.steps)
    u_max, between = plant.valve.u_max, reversal_time(reference, h)
    if drive.closed_loop:
        # ASSUME: the error is a jump of the reference: the difference of two draws.
        error = 2**0.5 * float(np.std(reference))
        command = min(1.0, drive.k_p * error / u_max)
    else:
        error = cylinder.stroke
        command = float(np.sqrt(np.mean(np.minimum(np.abs(reference), u_max) ** 2))) / u_max
    speed = command * full_speed(plant)
    flow = choked_flow(command * plant.valve.k_xu * u_max, conditions.P_s, conditions.T_in, gas)
    V = volume(0.0, chamber_of(cylinder, Side.A), cylinder)
    air = conditions.P_0 * V / (gas.R * conditions.T_0)
    time_constant = thermal_time_constant(plant)
    force = conditions.P_0 * cylinder.A_A
    spring = gas.gamma * conditions.P_0 * (cylinder.A_A**2 + cylinder.A_B**2) / V  # N/m
    return {
        "thermal": time_constant / between,
        "exchange": flow * time_constant / air,
        "breath": flow * between / air,
        "way": min(speed * between, error) / cylinder.stroke,
        "command": command,
        "friction": (cylinder.k_f * speed + cylinder.coulomb) / force,
        "inertia": cylinder.M * speed / (between / 2) / force,
        "stiffness": (spring / cylinder.M) ** 0.5 * between,
        "dead": cylinder.V_d_A / (cylinder.A_A * cylinder.stroke / 2),
        "supply": conditions.P_s / conditions.P_atm,
        "closed": float(drive.closed_loop),
    }

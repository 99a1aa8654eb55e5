"""Plants: a cylinder with its valve, supply and wall, from plain numbers or from a configuration."""

from pathlib import Path

from pneumo.arguments import check_positive, number, path
from pneumo.catalogue import default_conductance, measured_bores, measured_cylinders
from pneumo.configuration.experiment import Plant, Study
from pneumo.configuration.parameters import configured_dynamics, load, study
from pneumo.configuration.schema import Configuration
from pneumo.errors import InputError
from pneumo.physics.cylinder import Cylinder
from pneumo.physics.equilibrium import equilibrium_pressure
from pneumo.physics.valve import AIR, Conditions, Gas, Valve, sonic_coefficient
from pneumo.physics.valve_dynamics import ValveDynamics

OTHER_GAS = 0.005  # relative difference from the choked flow of air above which a note gives it
WEAK = 0.01  # fraction of the valve's full opening below which a signal hardly moves a piston


def plant(
    cylinder: Cylinder,
    *,
    k_xu: float,
    u_max: float,
    P_s: float,
    k_0: float,
    P_atm: float = 101325.0,
    T_amb: float = 293.15,
    T_in: float | None = None,
    P_0: float | None = None,
    gas: Gas = AIR,
) -> Plant:
    """Build a plant from a cylinder and numbers of its valve, supply and wall.

    Parameters
    ----------
    cylinder : Cylinder
        Geometry and moving parts.
    k_xu : float
        Area of an open restriction of the valve per volt, m^2/V: eq (2).
    u_max : float
        Limit of the command, V.
    P_s, P_atm : float
        Absolute supply and atmospheric pressure, Pa.
    k_0 : float
        Thermal conductance of each chamber's wall, W/K: eq (12).
    T_amb, T_in : float
        Temperature of the walls and of incoming air (None: the same), K.
    P_0 : float
        Pressure of both chambers at rest, Pa; if None, that of a closed valve with equal leaks, Appendix 2.
    gas : Gas
        Air by default.

    Raises
    ------
    InputError
        If a number is not positive, k_0 or friction negative, a stop outside, or P_s does not exceed P_atm.
    """
    c = Cylinder._make(float(value) for value in cylinder)._replace(rests=bool(cylinder.rests))
    check_positive(k_xu=k_xu, u_max=u_max, P_s=P_s, P_atm=P_atm, T_amb=T_amb)
    check_positive(bore=c.bore, stroke=c.stroke, A_A=c.A_A, A_B=c.A_B, V_d_A=c.V_d_A, V_d_B=c.V_d_B, M=c.M)
    number("k_0", k_0, 0.0)
    half = (1 + 1e-9) * c.stroke / 2
    if not -half <= c.x_min < c.x_max <= half:
        raise InputError(f"x_min = {c.x_min:g} m, x_max = {c.x_max:g} m: must ascend, within the stroke")
    for name in ("k_f", "coulomb", "spring"):
        number(name, getattr(c, name), 0.0)
    if P_s <= P_atm:
        raise InputError(f"P_s = {P_s:g} Pa: must exceed P_atm = {P_atm:g} Pa (both absolute)")
    inlet = T_amb if T_in is None else T_in
    rest = equilibrium_pressure(P_s, P_atm, gas) if P_0 is None else P_0
    check_positive(T_in=inlet, P_0=rest)
    conditions = Conditions(*(float(value) for value in (P_s, P_atm, inlet, T_amb, rest, T_amb)))
    return Plant(gas, Valve(float(k_xu), float(u_max)), conditions, c, float(k_0))


def study_notes(study: Study) -> list[str]:
    """Sentences by which a user notices a wrong unit or a default k_0 in a configuration.

    They give size, force and speed of each cylinder, signals beyond their limits or too weak to move the
    piston, experiments that no level of wall heat counts, and each k_0 that is the default, with its origin
    and interval.
    """
    notes, defaults = [], []
    for name, p in {e.cylinder: e.plant for e in study.experiments.values()}.items():
        c = p.cylinder
        s = p.conditions
        default = default_conductance(p.cylinder)
        size = f"{1e3 * c.bore:g} x {1e3 * c.stroke:g} mm, {c.M:g} kg, supply {s.P_s / 1e5:.4g} bar absolute"
        force = c.A_A * (s.P_s - s.P_atm)
        notes.append(
            f"{name}: {size}: at most {force:.3g} N and, with its valve, about"
            f" {p.speed:.3g} m/s with chamber A at rest pressure"
        )
        ratio = sonic_coefficient(p.gas.R, p.gas.gamma) / AIR.sonic_coefficient
        if p.gas.elliptic and abs(ratio - 1) > OTHER_GAS:
            notes.append(
                f"{name}: the valve keeps the area that its C, measured with air, gives: the choked mass flow"
                f" of this gas is {ratio:.3g} times that of air"
            )
        if p.k_0 == default.k_0:
            interval = f"95 % interval {default.k_0_low:.2g} to {default.k_0_high:.2g} W/K"
            origin = f"estimated from {measured_cylinders()}; {interval}"
            smallest, largest = measured_bores()
            if not smallest <= c.bore <= largest:
                defaults.append(
                    f"warning: {name}: a bore of {1e3 * c.bore:g} mm is outside those measured,"
                    f" {1e3 * smallest:g} to {1e3 * largest:g} mm: its k_0 is an extrapolation"
                )
            defaults.append(
                f"{name}: k_0 = {default.k_0:.2g} W/K, {origin}; measure it with `pneumo fit --closed both`"
            )
    for e in study.experiments.values():
        largest = e.excitation.amplitude * max(map(abs, e.excitation.levels), default=1.0)
        limit, unit, meaning = e.plant.valve.u_max, "V", "the command's limit"
        if e.drive.closed_loop:
            limit, unit, meaning = e.plant.cylinder.stroke / 2, "m", "half the stroke"
        if largest > limit:
            notes.append(f"{e.name}: its signal of {largest:g} {unit} exceeds {meaning}, {limit:g} {unit}")
        opening = e.drive.k_p * largest if e.drive.closed_loop else largest
        if opening < WEAK * e.plant.valve.u_max:
            cause = f"a reference of {1e3 * largest:g} mm" if e.drive.closed_loop else "its signal"
            keys = "k_p_V_per_m and amplitude" if e.drive.closed_loop else "amplitude_V"
            notes.append(
                f"{e.name}: {cause} opens the valve by {opening:.2g} V of {e.plant.valve.u_max:g} V only,"
                f" and the piston hardly moves: check {keys}"
            )
    return [*notes, *defaults, *_notes_on_levels(study)]


def _notes_on_levels(study: Study) -> list[str]:
    """Note on each experiment that no level of wall heat counts, if the study has levels."""
    if not study.levels:
        return []
    in_levels = {name for names in study.experiments_by_level.values() for name in names}
    return [
        f"{name}: no level has its k_0 = {e.plant.k_0:g} W/K: averages over all experiments count it,"
        " those of the levels do not"
        for name, e in study.experiments.items()
        if name not in in_levels
    ]


def load_plant(file: Path | str, cylinder: str | None = None) -> Plant:
    """Plant of a configuration, such as the one that `pneumo init` or `pneumo fit` writes.

    `cylinder` may be omitted if the file has only one. A plant does not include `valve_dynamics`.

    Raises
    ------
    InputError
        If the file cannot be read or used, or leaves open which cylinder is meant.
    """
    return configured_plant(study(load(path("plant", file))), cylinder)


def load_rig(file: Path | str) -> tuple[Plant, ValveDynamics]:
    """Plant of a configuration's only cylinder, as `load_plant` does, and the dynamics of its valve."""
    return configured_rig(load(path("plant", file)))[1:]


def configured_rig(
    configuration: Configuration, cylinder: str | None = None, k_0: float | None = None
) -> tuple[str, Plant, ValveDynamics]:
    """Name and plant of a configured cylinder, by default of the only one, and the dynamics of its valve."""
    configured = study(configuration)
    plant = configured_plant(configured, cylinder, k_0)
    name = cylinder or next(iter(configured.experiments.values())).cylinder
    return name, plant, configured_dynamics(configuration, name)


def configured_plant(configured: Study, cylinder: str | None = None, k_0: float | None = None) -> Plant:
    """Plant of a configured cylinder, with k_0, the thermal conductance of each chamber's wall, W/K.

    `cylinder` may be omitted if the study has only one, `k_0` if all experiments of the cylinder have the
    same.

    Raises
    ------
    InputError
        If the cylinder is unknown, k_0 is negative, or the configuration leaves open which one is meant.
    """
    plants = {e.cylinder: e.plant for e in configured.experiments.values()}
    if cylinder is None and len(plants) == 1:
        (cylinder,) = plants
    if cylinder is None:
        raise InputError(f"--cylinder: missing; there are {', '.join(plants)}")
    if cylinder not in plants:
        raise InputError(f"cylinder {cylinder!r}: no such cylinder; there are {', '.join(plants)}")
    if k_0 is None:
        conductances = sorted(
            {e.plant.k_0 for e in configured.experiments.values() if e.cylinder == cylinder}
        )
        if len(conductances) > 1:
            values = ", ".join(f"{value:.3g}" for value in conductances)
            raise InputError(f"--k0: missing; cylinder {cylinder} has {values} W/K")
        k_0 = conductances[0]
    number("k_0", k_0, 0.0)
    return plants[cylinder]._replace(k_0=k_0)

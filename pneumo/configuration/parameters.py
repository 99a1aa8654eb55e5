"""Configuration: read, validated and converted to SI units once; nothing downstream reads it again.

Every error is a `ConfigurationError` of one line.
"""

import hashlib
import json
from collections.abc import Mapping, Sequence
from math import pi, radians, sin
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from pydantic import ValidationError

from pneumo.catalogue import default_conductance
from pneumo.configuration.cylinder_table import CylinderTable, read_table, with_table
from pneumo.configuration.experiment import Drive, Excitation, Experiment, Plant, Push, Study
from pneumo.configuration.plain_yaml import read_yaml
from pneumo.configuration.sampling import Sampling
from pneumo.configuration.schema import (
    ClosedLoopSection,
    Configuration,
    CylinderSection,
    ExperimentSection,
    GasSection,
    OpenLoopSection,
    ValveDynamicsSection,
    ValveSection,
)
from pneumo.configuration.schema_messages import error_line
from pneumo.configuration.schema_parts import merged
from pneumo.configuration.text_file import read_column
from pneumo.configuration.valve_conversions import area_per_conductance, in_series
from pneumo.errors import ConfigurationError, printable
from pneumo.physics.cylinder import Cylinder, heat_area
from pneumo.physics.equilibrium import equilibrium_pressure
from pneumo.physics.models import FULL_ORDER_WALLS, wall_law
from pneumo.physics.valve import Conditions, Gas, Paths, Valve, critical_ratio, sonic_coefficient
from pneumo.physics.valve_dynamics import ValveDynamics


class Sources(NamedTuple):
    """Merged configuration files, not yet validated, and the table of cylinders if they name one."""

    content: Mapping[str, Any]  # merged; `cylinders` is the path of the table if there is one
    parts: Sequence[tuple[str, Mapping[str, Any]]] = ()  # name and content of each source, for messages
    table: CylinderTable | None = None

    def validated(self) -> Configuration:
        """Validate the configuration, with every experiment on each row of the table.

        The line of a `ConfigurationError` names source, field, value and what is allowed; each wrong row of a
        table has one.
        """
        content = with_table(self.content, self.table) if self.table else self.content
        try:
            return Configuration.model_validate(content)
        except ValidationError as error:
            # A misspelt key is also a missing key: report the misspelt one.
            order = {"extra_forbidden": 0, "missing": 2}
            found = sorted(error.errors(include_url=False), key=lambda e: order.get(e["type"], 1))
            firsts: dict[Any, Any] = {}
            for e in found if self.table else found[:1]:  # the first of each row
                if e["loc"][:1] == found[0]["loc"][:1]:
                    firsts.setdefault(e["loc"][:2], e)
            raise ConfigurationError(*dict.fromkeys(map(self.line, firsts.values()))) from None

    def line(self, error: Any) -> str:
        """Message for an error of pydantic, with the source in which the field is written."""
        if self.table is None:
            return error_line(error, self.parts)
        table, experiments = self.table, self.content.get("experiments") or ()
        return error_line(error, [*self.parts, table.source], lambda path: table.written(path, experiments))


def load(*files: Path | str) -> Configuration:
    """Read and validate a configuration from files, later ones overriding earlier ones."""
    return read_sources(*files).validated()


def read_sources(*files: Path | str, options: Mapping[str, Any] | None = None) -> Sources:
    """Read configuration files and the table of cylinders that they name.

    Later files override earlier ones, and `options` overrides all. The path of a table is relative to the
    configuration that names it; in `options`, to the current folder.
    """
    parts: list[tuple[str, Mapping[str, Any], Path]]
    parts = [(printable(str(file), 300), read_yaml(Path(file)), Path(file).parent) for file in files]
    parts += [("--config", options, Path())] if options else []
    content: dict[str, Any] = {}
    source, folder = "", Path()
    for name, part, its_folder in parts:
        content = merged(content, part)
        source, folder = (name, its_folder) if "cylinders" in part else (source, folder)
    named = content.get("cylinders")
    table = read_table(folder / named, named, source) if isinstance(named, str) else None
    return Sources(content, [(name, part) for name, part, _ in parts], table)


def study(configuration: Configuration) -> Study:
    """Convert a configuration to SI units: the experiments that run and the grid of models."""
    c = configuration
    experiments = {name: _experiment(c, name) for name in c.chosen}
    # The hash includes the content of signal files, and excludes how the work is split into jobs.
    content = (
        c.model_dump(exclude={"run": {"block_size"}}),
        [e.excitation.levels for e in experiments.values()],
    )
    digest = hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()
    return Study(
        name=c.name,
        experiments=experiments,
        n=tuple(c.n),
        levels={name: tuple(values) for name, values in c.levels.items()},
        config_sha256=digest,
        percentile_rule=c.percentile_rule,
        seeds=c.run.seeds,
    )


STANDARD_GRAVITY = 9.80665  # m/s^2
STRAIGHT = 3  # knots of a valve without a curve
BENDS = (0.3, 0.6, 0.8, 1.0, 1.3, 1.7, 2.3, 3.3)  # of a throttle's C: conductances behind it, at knots
DEAD_FRACTION = 0.1  # of the volume of half the stroke, as in Table 2


def _gas(section: GasSection, cylinder: CylinderSection) -> Gas:
    R, gamma = section.R_J_per_kgK, section.gamma
    sonic = sonic_coefficient(R, gamma) if section.sonic_coefficient == "exact" else section.sonic_coefficient
    if cylinder.valve:
        return Gas(R, gamma, sonic, cylinder.valve.critical_ratio, elliptic=True)
    critical = critical_ratio(gamma) if section.critical_ratio == "exact" else section.critical_ratio
    return Gas(R, gamma, sonic, critical)


def sonic_conductance(valve: Valve, gas: Gas) -> float:
    """Sonic conductance C of a fully open valve, dm^3/(s bar), as measured with air."""
    return valve.k_xu * valve.u_max / area_per_conductance(gas)


def _valve(section: CylinderSection, gas: Gas) -> Valve:
    catalogue, u_max = section.valve, section.u_max_V
    if catalogue is None:
        assert section.k_x_k_u_m2_per_V is not None
        return Valve(section.k_x_k_u_m2_per_V, u_max)
    area = area_per_conductance(gas)
    k_xu = catalogue.largest_C * area / u_max
    valve = Valve(k_xu, u_max, exhaust=catalogue.exhaust_ratio, leak=catalogue.leak_dm3_per_sbar * area)
    if not (section.valve_B or catalogue.curve or catalogue.exhaust_b or section.throttles):
        return valve
    # Own command of each chamber; chamber B of a valve that both share has the negative of its command.
    of_B = _paths(section.valve_B, u_max) if section.valve_B else _paths(catalogue, u_max, mirrored=True)
    valves = catalogue, section.valve_B or catalogue
    throttles = section.throttle_A_dm3_per_sbar, section.throttle_B_dm3_per_sbar
    throttled = [
        _throttled(side, throttle, of.exhaust_b or of.critical_ratio)
        for side, throttle, of in zip((_paths(catalogue, u_max), of_B), throttles, valves, strict=True)
    ]
    sides = [side for side, _ in throttled]
    u = np.union1d(sides[0][0], sides[1][0])
    supply, exhaust = (
        tuple(tuple((np.interp(u, side[0], side[path]) * area / k_xu).tolist()) for side in sides)
        for path in (1, 2)
    )
    b = tuple((of.critical_ratio, b_out) for of, (_, b_out) in zip(valves, throttled, strict=True))
    b = () if {*b[0], *b[1]} == {gas.critical_ratio} else b
    return valve._replace(paths=Paths(len(u), tuple(u.tolist()), supply, exhaust, b))


def _paths(valve: ValveSection, u_max: float, mirrored: bool = False) -> tuple[np.ndarray, ...]:
    """Commands, V, and conductances from the supply and to the exhaust, dm^3/(s bar), of one chamber.

    Of chamber A over its own command or, `mirrored`, of chamber B behind the same valve.
    """
    curve, ratio = valve.curve, valve.exhaust_ratio
    if curve is None:
        u, C = np.array([0.0, u_max]), np.array([0.0, valve.largest_C])
    else:
        u, C = np.array(curve.u_V), np.array(curve.C_dm3_per_sbar)
        if curve.exhaust_C_dm3_per_sbar is not None:  # over the own command of either chamber
            return u, C, np.array(curve.exhaust_C_dm3_per_sbar)
    if u[0] >= 0:  # holds for both signs
        u, of = np.unique([*u, *-u], return_index=True)
        C = np.tile(C, 2)[of]
    null = u[C == 0].mean()  # to either side, the valve is open the one way or the other
    if mirrored:
        u, C, null = -u[::-1], C[::-1], -null
    return u, np.where(u > null, C, 0.0), ratio * np.where(u < null, C, 0.0)


def with_one_b(plant: Plant, section: CylinderSection) -> Plant:
    """Plant for replays with one critical ratio: paths behind a throttle get that of their valve.

    Paths whose ratios differ by configuration keep them.
    """
    ratios = {b for v in (section.valve, section.valve_B) if v for b in (v.critical_ratio, v.exhaust_b) if b}
    if not section.throttles or len(ratios) > 1:
        return plant
    return plant._replace(valve=plant.valve._replace(paths=plant.valve.paths._replace(b=())))


def _throttled(
    side: tuple[np.ndarray, ...], throttle: float | None, b: float
) -> tuple[tuple[np.ndarray, ...], float]:
    """Table of `_paths` with a throttle before the path to the exhaust, and b of that path fully open."""
    if throttle is None:
        return side, b
    u, _, exhaust = side
    if len(u) <= STRAIGHT:  # gets knots on the curve that its line becomes
        fully, shut = u[np.argmax(exhaust)], u[exhaust == 0]
        nearest = shut[np.argmin(np.abs(shut - fully))]
        part = throttle * np.array(BENDS) / exhaust.max()
        u = np.union1d(u, nearest + part[part < 1] * (fully - nearest))
    supply, exhaust = (np.interp(u, side[0], path) for path in side[1:])
    series = [in_series(throttle, C, b) if C else (0.0, b) for C in exhaust.tolist()]
    return (u, supply, np.array([C for C, _ in series])), series[int(np.argmax(exhaust))][1]


def _cylinder(s: CylinderSection, P_atm: float) -> Cylinder:
    bore, stroke, rod = s.bore_mm * 1e-3, s.stroke_mm * 1e-3, s.rod_mm * 1e-3
    area = pi * bore**2 / 4  # ASSUME: the paper's cylinders have no rod (Table 2's V_d and A_q say so)
    rod_area = pi * rod**2 / 4
    rod_area_A = pi * ((s.rod_A_mm or 0.0) * 1e-3) ** 2 / 4
    V_d_A = DEAD_FRACTION * area * stroke / 2 if s.dead_volume_m3 is None else s.dead_volume_m3
    V_d_B = V_d_A if s.dead_volume_B_m3 is None else s.dead_volume_B_m3
    spring = s.spring_N_per_m or 0.0
    held = (s.spring_preload_N or 0.0) + spring * stroke / 2  # force of the spring in mid-stroke
    weight = s.mass_kg * STANDARD_GRAVITY * sin(radians(s.incline_deg))
    return Cylinder(
        bore=bore,
        stroke=stroke,
        A_A=area - rod_area_A,
        A_B=area - rod_area,
        V_d_A=V_d_A,
        V_d_B=V_d_B,
        M=s.mass_kg,
        k_f=s.friction_Ns_per_m,
        x_min=-stroke / 2,
        x_max=stroke / 2,
        load=s.load_N - weight - (rod_area - rod_area_A) * P_atm - held,
        coulomb=s.coulomb_N,
        spring=spring,
    )


def _k_0(section: ExperimentSection, cylinder: Cylinder) -> float:
    if section.lambda_0_W_per_m2K is not None:
        return section.lambda_0_W_per_m2K * heat_area(0.0, cylinder)  # (12)
    assert section.k_0_W_per_K is not None
    return default_conductance(cylinder).k_0 if section.k_0_W_per_K == "catalogue" else section.k_0_W_per_K


def _excitation(c: Configuration, name: str, s: CylinderSection) -> Excitation:
    signal = c.experiments[name].signal
    h = c.step_s
    loop = c.loop(name)
    amplitude = loop.amplitude if isinstance(loop, ClosedLoopSection) else loop.amplitude_V
    plain = Excitation(s.seed, amplitude, max(1, round(s.sample_time_s / h)))
    if signal is None:
        return plain
    if signal.from_Hz and signal.to_Hz:
        return plain._replace(signal=signal.kind, band=(signal.from_Hz * h, signal.to_Hz * h))
    if signal.hold_s is None:
        return plain._replace(signal=signal.kind)
    held = plain._replace(every=max(1, round(signal.hold_s / h)), signal="levels")
    if signal.levels is not None:
        return held._replace(levels=tuple(signal.levels))
    assert signal.file and signal.column
    where = f"experiments.{name}.signal"
    return held._replace(amplitude=1.0, levels=read_column(Path(signal.file), signal.column, where))


def _drive(loop: OpenLoopSection | ClosedLoopSection, stroke_mm: float) -> Drive:
    if isinstance(loop, ClosedLoopSection):
        return Drive(True, loop.k_p_V_per_m, stroke_mm * 1e-3 / 2)
    return Drive(
        False,
        0.0,
        loop.reverse_at * stroke_mm * 1e-3 / 2,
        loop.reversal == "toggled",
        loop.reversal_tested == "each stage",
        loop.reversal_recorded_late,
    )


def _push(c: Configuration, name: str, plant: Plant) -> Push:
    e = c.experiments[name]
    settling = c.cylinders[e.cylinder].settling
    if settling is None:
        return Push(0.0, plant.cylinder.x_min)
    leak = settling.closed_loop_leak * plant.valve.k_xu * plant.valve.u_max if e.loop == "closed" else 0.0
    return Push(settling.force_N, settling.stop_mm * 1e-3, leak, e.settling_stop_s)


def plant_of(c: Configuration, name: str) -> Plant:
    """Plant of an experiment, in SI units."""
    e = c.experiments[name]
    s = c.cylinders[e.cylinder]
    gas = _gas(c.gas, s)
    P_s, P_atm = c.supply.P_s_Pa, c.supply.P_atm_Pa
    if c.supply.P_0_per_P_s == "half-bridge":
        P_0 = equilibrium_pressure(P_s, P_atm, gas)
    else:
        P_0 = c.supply.P_0_per_P_s * P_s
    conditions = Conditions(P_s, P_atm, c.supply.T_in_K, c.supply.T_amb_K, P_0, c.supply.T_amb_K)
    cylinder = _cylinder(s, P_atm)
    return Plant(
        gas,
        _valve(s, gas),
        conditions,
        cylinder,
        _k_0(e, cylinder),
        wall_law(FULL_ORDER_WALLS[s.wall_law or "area_PT"]),
        c.supply.sag or 0.0,
    )


def configured_dynamics(configuration: Configuration, cylinder: str) -> ValveDynamics:
    """Dynamics of a cylinder's valve; without such a section, a valve that follows its command at once."""
    s = configuration.cylinders[cylinder].valve_dynamics or ValveDynamicsSection()
    return ValveDynamics(s.lag_s, s.dead_time_s, s.null_V, s.dead_band_V)


def _experiment(c: Configuration, name: str) -> Experiment:
    e = c.experiments[name]
    loop = c.loop(name)
    plant = plant_of(c, name)
    s, late = c.cylinders[e.cylinder], loop.lag_s / c.step_s
    return Experiment(
        name=name,
        cylinder=e.cylinder,
        plant=plant,
        drive=_drive(loop, s.stroke_mm),
        excitation=_excitation(c, name, s),
        push=_push(c, name, plant),
        sampling=Sampling(loop.replays_read, (late, late, late)),
        h=c.step_s,
        steps=max(1, round(c.duration(name) / c.step_s)),
        pressure_stride=e.pressure_stride,
        most_halvings=c.most_halvings,
    )

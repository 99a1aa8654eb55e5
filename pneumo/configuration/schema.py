"""Schema of the configuration: every section and key with its range, as pydantic models.

Keys name their unit (bore_mm); `pneumo.configuration.parameters` converts to SI.
"""

from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from pneumo.catalogue import measured_cylinders
from pneumo.configuration.experiment import MOST_HALVINGS, MOST_SEEDS
from pneumo.configuration.schema_parts import (
    Conductance,
    Count,
    Fraction,
    Frequency,
    Level,
    Name,
    Number,
    Seconds,
    Section,
    conflict,
    increasing,
    key_of,
    listed,
)
from pneumo.configuration.valve_conversions import CONVERSIONS, USUAL_B, conductance
from pneumo.physics.valve import GASES
from pneumo.quantities.table import STUDIED

MOST_PERCENT = 50.0  # of an accuracy
Percent = Annotated[Number, Field(gt=0, le=MOST_PERCENT)]
Unknown = BeforeValidator(lambda value: None if value == "unknown" else value)
MOST_KNOTS = 30  # of a curve; both chambers' fit into the core's table
LEAST_C = 1e-9  # dm3/(s bar), of an open valve: a stroke takes years
LONGEST = 20_000_000  # steps of a run: 1 GB of states


def optional_key(meaning: str, **limits: Any) -> Any:
    """Key that is left out of the hash if it is not given: older configurations keep their hash."""
    return key_of(meaning, None, exclude_if=lambda value: value is None, **limits)


class GasSection(Section):
    """A perfect gas, and the two printed constants of eq (1); or its name, such as `gas: helium`."""

    R_J_per_kgK: Number = key_of("gas constant R", gt=0, le=5000)
    gamma: Number = key_of("ratio of specific heats", ge=1.05, le=1.67)
    sonic_coefficient: Literal["exact"] | Fraction = key_of(
        "factor of the sonic branch of eq (1), s K^0.5/m, or exact"
    )
    critical_ratio: Literal["exact"] | Fraction = key_of("P_d/P_u at which flow becomes sonic, or exact")

    @model_validator(mode="before")
    @classmethod
    def _of_its_name(cls, value: Any) -> Any:
        if not isinstance(value, str):
            return value
        if value not in GASES:
            raise conflict(value, f"must be a section, or one of {', '.join(GASES)}", ())
        constants = {"R_J_per_kgK": GASES[value].R, "gamma": GASES[value].gamma}
        return constants | {"sonic_coefficient": "exact", "critical_ratio": "exact"}


class SupplySection(Section):
    """Pressures and temperatures of the supply and of the surroundings."""

    P_s_Pa: Number = key_of("absolute supply pressure, above P_atm_Pa", gt=0, le=5e6, uncertain=True)
    P_atm_Pa: Number = key_of("atmospheric pressure", gt=0, le=2e5, uncertain=True)
    T_amb_K: Number = key_of("temperature of walls and surroundings", ge=150, le=500, uncertain=True)
    T_in_K: Number = key_of("temperature of incoming air", ge=150, le=500, uncertain=True)
    P_0_per_P_s: Literal["half-bridge"] | Fraction = key_of(
        "equilibrium over supply pressure, or half-bridge to solve Appendix 2"
    )

    sag: Number | None = optional_key(
        "fraction by which P_s_Pa falls at the largest flow, and with the square of the flow, as `pneumo fit`"
        " finds it: for runs of the full order; replays, linear models and exports have a constant supply",
        gt=0,
        lt=1,
    )

    @model_validator(mode="after")
    def _supply_above_atmosphere(self) -> Self:
        if self.P_s_Pa <= self.P_atm_Pa:
            condition = f"must exceed P_atm_Pa = {self.P_atm_Pa:g}"
            raise conflict(self.P_s_Pa, condition, ("P_s_Pa",), ("P_atm_Pa",))
        return self


class LoopSection(Section):
    """How the replays of the paper read the signals of a loop: by samples."""

    replays_read: Literal["linear", "hold", "hold_next"] = key_of(
        "samples are interpolated; held for a step; held, the step's last stage reads the next", "linear"
    )
    lag_s: Number = key_of("delay of interpolated signals", 0.0, ge=0, le=1)

    @model_validator(mode="after")
    def _lag_beside_interpolation(self) -> Self:
        if self.lag_s and self.replays_read != "linear":
            condition = f"must be 0 with replays_read: {self.replays_read}"
            raise conflict(self.lag_s, condition, ("lag_s",), ("replays_read",))
        return self


class OpenLoopSection(LoopSection):
    """Excitation of the open-loop runs: a two-valued command."""

    amplitude_V: Number = key_of("magnitude of the command", gt=0, le=1000)
    reverse_at: Number = key_of("fraction of the half-stroke at which the sign is reversed", gt=0, le=1)
    reversal: Literal["forced", "toggled"] = key_of(
        "forced: inward while the piston is beyond; toggled: it keeps its reversed sign", "forced"
    )
    reversal_tested: Literal["each stage", "each step"] = key_of(
        "when the position is compared with that fraction", "each stage"
    )
    reversal_recorded_late: Number = key_of(
        "samples by which a reversal is late in the command that replays read", 0.0, ge=0, le=1
    )


class ClosedLoopSection(LoopSection):
    """Excitation of the closed-loop runs: a random position reference, and the gain of the controller."""

    exactly_one = "amplitude_mm", "variance_m2"
    variance_m2: Number | None = key_of(
        "variance of the position reference; or give amplitude_mm", None, gt=0, le=10
    )
    amplitude_mm: Number | None = key_of(
        "standard deviation of the position reference, or amplitude of a sweep or of steps",
        None,
        gt=0,
        le=5000,
    )
    k_p_V_per_m: Number = key_of("proportional gain", gt=0, le=1e6)

    @property
    def amplitude(self) -> float:
        """Standard deviation of the reference, m."""
        return (self.variance_m2 or 0.0) ** 0.5 if self.amplitude_mm is None else self.amplitude_mm * 1e-3


class SettlingSection(Section):
    """Force and end stop of the settling-time runs."""

    force_N: Number = key_of("external force (negative: towards the stop)", lt=0, ge=-1e6)
    stop_mm: Number = key_of("position of the end stop, inside the half-stroke", lt=0, ge=-5000)
    closed_loop_leak: Number = key_of(
        "leak of the valve in closed loop, as a fraction of its full opening", 0.0, ge=0, le=0.1
    )


Knots = Annotated[
    list[Annotated[Number, Field(ge=-1000, le=1000)]],
    Field(min_length=2, max_length=MOST_KNOTS),
    AfterValidator(increasing),
]
Conductances = Annotated[list[Conductance], Field(min_length=2, max_length=MOST_KNOTS)]


class CurveSection(Section):
    """Sonic conductance as a table over the command, linear between its rows.

    With exhaust_C_dm3_per_sbar, C_dm3_per_sbar is the path from the supply and that the path to the
    atmosphere, both over the chamber's own command, which is positive where it connects the chamber to the
    supply: u_V of chamber A, and of chamber B with a valve of its own. Without it the table has what flows
    at a command through either path: a table from 0 on holds for both signs; one that begins below 0 must be
    0 where the valve changes its direction.
    """

    u_V: Knots = key_of("commands, increasing")
    C_dm3_per_sbar: Conductances = key_of("sonic conductance at each")
    exhaust_C_dm3_per_sbar: Conductances | None = key_of(
        "sonic conductance of the path to the atmosphere at each", None
    )

    @model_validator(mode="after")
    def _one_table(self) -> Self:
        for key in ("C_dm3_per_sbar", "exhaust_C_dm3_per_sbar"):
            values = getattr(self, key)
            if values is not None and len(values) != len(self.u_V):
                condition = f"must have {len(self.u_V)} numbers, as u_V has, not {len(values)}"
                raise conflict(values, condition, (key,), ("u_V",))
            if values is not None and max(values) < LEAST_C:
                raise conflict(values, f"must be at least {LEAST_C:g} somewhere", (key,))
        if self.exhaust_C_dm3_per_sbar is not None:
            return self
        if self.u_V[0] >= 0 and self.C_dm3_per_sbar[0] != 0:
            condition = f"must begin with 0, or with commands below 0: at u_V = {self.u_V[0]:g} it would jump"
            raise conflict(self.C_dm3_per_sbar, condition, ("C_dm3_per_sbar",), ("u_V",))
        if self.u_V[0] < 0 and 0 not in self.C_dm3_per_sbar:
            condition = "must be 0 at one command at least, where the valve changes its direction"
            raise conflict(self.C_dm3_per_sbar, condition, ("C_dm3_per_sbar",))
        return self


def _figure(meaning: str, largest: float) -> Any:
    """Key for a figure of `CONVERSIONS` other than C."""
    return optional_key(meaning, uncertain=True, gt=0, le=largest)


class ValveSection(Section):
    """A valve by its catalogue: flow by ISO 6358, conductance C and critical ratio b at full opening.

    Another figure of a catalogue is converted. Conductances are those with air, whatever the gas: the valve
    keeps its area.
    """

    exactly_one = (*CONVERSIONS, "curve")
    C_dm3_per_sbar: Number | None = key_of(
        "sonic conductance C from supply to chamber at u_max_V; or give Q_n_l_per_min",
        None,
        gt=0,
        le=1000,
        uncertain=True,
    )
    Q_n_l_per_min: Number | None = _figure(
        "nominal flow from supply to chamber at u_max_V, from 7 to 6 bar absolute, of air at 20 °C and 1 bar",
        2.5e5,
    )
    Q_nN_l_per_min: Number | None = _figure("the same in normal litres, at 0 °C and 1.01325 bar", 2.5e5)
    C_m3_per_sPa: Number | None = _figure("instead: C in the standard's own unit", 1e-5)
    C_l_per_minbar: Number | None = _figure("instead: C in litres (ANR) a minute and bar", 6e4)
    S_mm2: Number | None = _figure("instead: effective area; C = S / 5 within 5 %", 5000)
    Cv: Number | None = _figure("instead: flow coefficient in US units; within 15 %", 250)
    Kv_m3_per_h: Number | None = _figure("instead: metric flow coefficient; within 15 %", 220)
    b: Annotated[Number | None, Unknown] = key_of(
        "critical pressure ratio, or unknown: 0.3, from 0.15 to 0.45", None, gt=0, lt=1, uncertain=True
    )
    exhaust_ratio: Number = key_of(
        "C from chamber to exhaust over that from supply to it", 1.0, gt=0, le=10, uncertain=True
    )
    exhaust_b: Fraction | None = optional_key("critical ratio of the path to the exhaust, if it differs")
    curve: CurveSection | None = optional_key("instead of C: a table over the command")
    linearity_percent: Number | None = key_of(
        "how far C may be from proportional to the command, in % of the largest C; 7.5 if left out",
        None,
        ge=0,
        le=20,
    )
    leak_dm3_per_sbar: Number = key_of("sonic conductance of each closed path", 0.0, ge=0, le=100)

    @model_validator(mode="after")
    def _one_exhaust(self) -> Self:
        if self.curve and self.curve.exhaust_C_dm3_per_sbar and self.exhaust_ratio != 1:
            condition = "conflicts with curve.exhaust_C_dm3_per_sbar; give only one"
            raise conflict(self.exhaust_ratio, condition, ("exhaust_ratio",), ("curve",))
        if self.curve and self.linearity_percent:
            condition = "conflicts with curve; give only one"
            raise conflict(self.linearity_percent, condition, ("linearity_percent",), ("curve",))
        return self

    @property
    def critical_ratio(self) -> float:
        """Critical ratio b, or the usual one if the configuration has none."""
        return USUAL_B if self.b is None else self.b

    @property
    def flow_as_given(self) -> tuple[str, float]:
        """Key and value by which the configuration gives the flow; of a curve, the largest C."""
        if self.curve:
            return "C_dm3_per_sbar", max(self.curve.C_dm3_per_sbar)
        return next((key, value) for key in CONVERSIONS if (value := getattr(self, key)) is not None)

    @property
    def largest_C(self) -> float:
        """C of the path from the supply where it is fully open, dm^3/(s bar)."""
        return conductance(*self.flow_as_given, self.critical_ratio)


class ValveDynamicsSection(Section):
    """How the valve follows its command, as `pneumo fit` finds it: for `simulate`, exports, linear models.

    Runs of a study have a valve that follows at once and in proportion.
    """

    lag_s: Number = key_of("time constant of a first-order lag", 0.0, ge=0, le=1)
    dead_time_s: Number = key_of("time after which the valve sees its command", 0.0, ge=-0.1, le=1)
    null_V: Number = key_of("command at which the valve is shut", 0.0, ge=-1000, le=1000)
    dead_band_V: Number = key_of("command to either side of that in which it stays shut", 0.0, ge=0, le=1000)


def _studied(name: str) -> str:
    if name not in STUDIED:
        raise conflict(name, f"must be one of {listed(STUDIED)}", ())
    return name


class FittedSection(Section):
    """Joint uncertainty of the quantities that a fit estimated, and each model's error on unseen data."""

    quantities: list[Annotated[str, AfterValidator(_studied)]] = key_of(
        f"quantities, in the order of the covariance: {', '.join(STUDIED)}", max_length=len(STUDIED)
    )
    covariance: list[list[Annotated[Number, Field(ge=-1e4, le=1e4)]]] = key_of(
        "of their logarithms; of b and T_in (K) themselves"
    )
    error_kPa: dict[str, Annotated[Number, Field(ge=0, le=1e6)]] = key_of(
        "RMS error on the part of the record that was held out, by model", default_factory=dict
    )

    @model_validator(mode="after")
    def _covariance_of_the_quantities(self) -> Self:
        size, rows = len(self.quantities), self.covariance
        square = len({*self.quantities}) == size == len(rows) and all(len(row) == size for row in rows)
        if size == 0 == len(rows):
            return self
        if not (square and np.allclose(rows, np.transpose(rows)) and np.linalg.eigvalsh(rows).min() > -1e-12):
            condition = f"must be symmetric, not negative, with a row for each of the {size} quantities"
            raise conflict(f"{len(rows)} rows", condition, ("covariance",), ("quantities",))
        return self


class CylinderSection(Section):
    """A cylinder with its load, its valve and the signals that excite it."""

    exactly_one = "k_x_k_u_m2_per_V", "valve"
    bore_mm: Number = key_of("diameter phi", gt=0, le=1000, uncertain=True)
    stroke_mm: Number = key_of("stroke l", gt=0, le=10000, uncertain=True)
    rod_mm: Number = key_of("diameter of the rod in chamber B; 0: no rod", 0.0, ge=0, le=1000)
    rod_A_mm: Number | None = optional_key("through rod: its diameter in chamber A", ge=0, le=1000)
    dead_volume_m3: Annotated[Number | None, Unknown] = key_of(
        "dead volume V_d of each chamber with its tube, or unknown: 10 % of half the stroke, × or ÷ 2.5",
        None,
        gt=0,
        le=1,
        uncertain=True,
    )
    dead_volume_B_m3: Number | None = optional_key(
        "dead volume of chamber B, if it differs from that of A", gt=0, le=1, uncertain=True
    )
    mass_kg: Number = key_of("moving mass M with load", gt=0, le=1e5)
    friction_Ns_per_m: Number = key_of("viscous friction coefficient k_f", ge=0, le=1e6)
    coulomb_N: Number = key_of("Coulomb friction", 0.0, ge=0, le=1e6)
    incline_deg: Number = key_of("angle at which chamber A lifts the mass; 90: upwards", 0.0, ge=-90, le=90)
    load_N: Number = key_of("constant force, positive where it enlarges chamber A", 0.0, ge=-1e6, le=1e6)
    spring_N_per_m: Number | None = optional_key(
        "rate of a return spring, which pushes towards a smaller chamber A", gt=0, le=1e7
    )
    spring_preload_N: Number | None = optional_key(
        "force of that spring where chamber A is smallest", ge=0, le=1e6
    )
    throttle_A_dm3_per_sbar: Number | None = optional_key(
        "sonic conductance of a throttle with check valve at port A, for the air that leaves (meter-out); its"
        " critical ratio is that of the valve",
        gt=0,
        le=1000,
    )
    throttle_B_dm3_per_sbar: Number | None = optional_key("the same at port B", gt=0, le=1000)
    k_x_k_u_m2_per_V: Number | None = key_of(
        "valve area per volt, with the flow of eq (1); or give the section valve",
        None,
        gt=0,
        le=1e-2,
        uncertain=True,
    )
    valve: ValveSection | None = key_of("a valve by its catalogue", None)
    valve_B: ValveSection | None = optional_key(
        "valve of chamber B, or the paths of B, where they differ; its command is positive from the supply"
    )
    u_max_V: Number = key_of("limit of the command", gt=0, le=1000)
    wall_law: Literal["area_PT", "area", "constant"] | None = optional_key(
        "law of the wall's conductance in the full order: k_0 times area and root of P T (default), times"
        " area, or constant"
    )
    valve_dynamics: ValveDynamicsSection | None = optional_key("how the valve follows its command")
    fitted: FittedSection | None = optional_key("what a fit found, as `pneumo fit` writes it")
    seed: Count = key_of("seed of the Random Number block", ge=0, lt=2**32)
    sample_time_s: Number = key_of("time between draws", gt=0, le=1000)
    open_loop: OpenLoopSection | None = key_of("for experiments in open loop", None)
    closed_loop: ClosedLoopSection | None = key_of("for experiments in closed loop", None)
    settling: SettlingSection | None = key_of("for settling runs, which only the paper's study makes", None)

    @property
    def throttles(self) -> dict[str, float]:
        """Keys and conductances, dm^3/(s bar), of the throttles at the ports."""
        given = {f"throttle_{side}_dm3_per_sbar" for side in "AB"} & self.model_fields_set
        return {key: value for key in sorted(given) if (value := getattr(self, key)) is not None}

    @model_validator(mode="after")
    def _parts_that_fit(self) -> Self:
        if self.valve_B and not self.valve:
            raise conflict(None, "needed beside valve_B", ("valve",))
        if self.valve_B and self.valve and self.valve_B.leak_dm3_per_sbar != self.valve.leak_dm3_per_sbar:
            where, condition = ("valve_B", "leak_dm3_per_sbar"), "must be that of the section valve"
            raise conflict(self.valve_B.leak_dm3_per_sbar, condition, where, ("valve",))
        for key in self.valve_B._uncertainties if self.valve_B else ():
            condition = "cannot have an uncertainty; that of the section valve is of both"
            raise conflict(getattr(self.valve_B, key), condition, ("valve_B", key))
        for key in ("rod_mm", "rod_A_mm"):
            if (rod := getattr(self, key) or 0.0) >= self.bore_mm:
                raise conflict(self.bore_mm, f"must exceed {key} = {rod:g}", ("bore_mm",), (key,))
        if self.spring_preload_N is not None and self.spring_N_per_m is None:
            raise conflict(None, "needed beside spring_preload_N", ("spring_N_per_m",))
        if self.throttles and not self.valve:
            raise conflict(None, f"needed beside {next(iter(self.throttles))}", ("valve",))
        if self.settling and self.settling.stop_mm <= -self.stroke_mm / 2:
            condition = f"must lie inside the half-stroke, above {-self.stroke_mm / 2:g}"
            raise conflict(self.settling.stop_mm, condition, ("settling", "stop_mm"), ("stroke_mm",))
        if (dynamics := self.valve_dynamics) and abs(dynamics.null_V) + dynamics.dead_band_V >= self.u_max_V:
            condition = f"with dead_band_V = {dynamics.dead_band_V:g} must be below {self.u_max_V:g}"
            raise conflict(dynamics.null_V, condition, ("valve_dynamics", "null_V"), ("u_max_V",))
        return self


class SignalSection(Section):
    """Signal of an experiment, if not the default: prbs in open loop, gaussian in closed loop.

    Its amplitude is that of the loop's section, in V or in mm.
    """

    kind: Literal["prbs", "gaussian", "sweep", "steps", "csv"] = key_of(
        "two-valued or normal random numbers, a sine of rising frequency, steps, a file"
    )
    from_Hz: Frequency | None = key_of("sweep: frequency at the start", None)
    to_Hz: Frequency | None = key_of("sweep: frequency at the end", None)
    levels: Annotated[list[Level], Field(min_length=1, max_length=1000)] | None = key_of(
        "steps: levels as multiples of the amplitude, repeated to the end", None
    )
    hold_s: Seconds | None = key_of("steps: length of each; csv: time between rows", None)
    file: str | None = key_of("csv: path from the working directory; its first row names the columns", None)
    column: str | None = key_of(
        "csv: column with the command, V, in open loop, or the reference, m, in closed loop", None
    )

    @model_validator(mode="after")
    def _keys_of_its_kind(self) -> Self:
        wanted = {
            "sweep": ("from_Hz", "to_Hz"),
            "steps": ("levels", "hold_s"),
            "csv": ("file", "column", "hold_s"),
        }.get(self.kind, ())
        for key in ("from_Hz", "to_Hz", "levels", "hold_s", "file", "column"):
            value = getattr(self, key)
            if key in wanted and value is None:
                raise conflict(None, f"for kind: {self.kind}", (key,))
            if key not in wanted and value is not None:
                raise conflict(value, f"not allowed with kind: {self.kind}", (key,), ("kind",))
        return self


class ExperimentSection(Section):
    """One experiment: which cylinder, which loop, how much wall heat, how long."""

    exactly_one = "k_0_W_per_K", "lambda_0_W_per_m2K"
    cylinder: str = key_of("one of the cylinders' names; not with a table: each experiment runs on every row")
    loop: Literal["open", "closed"] = key_of("open loop, or proportional position control")
    signal: SignalSection | None = key_of("signal, if not the loop's default", None)
    k_0_W_per_K: Annotated[
        Literal["catalogue"] | Conductance | None,
        BeforeValidator(lambda value: "catalogue" if value == "unknown" else value),
    ] = key_of(
        "thermal conductance of a chamber's wall at equilibrium; catalogue, or unknown: estimated from"
        f" {measured_cylinders()}; or give lambda_0_W_per_m2K",
        None,
        uncertain=True,
    )
    lambda_0_W_per_m2K: Number | None = key_of(
        "heat transfer coefficient at equilibrium: k_0 over the heat transfer area in mid-stroke",
        None,
        ge=0,
        le=1e5,
        uncertain=True,
    )
    duration_s: Seconds = key_of("length of the full-order run")
    settling_stop_s: Seconds | None = key_of(
        "settling run: time after release at which it ends; default: once its air is near T_amb_K", None
    )
    pressure_stride: Count = key_of("steps between stored pressures of replays", 10, ge=1, le=10**6)


class SensorsSection(Section):
    """How accurately the sensors of a record are known: half-widths of 95 % intervals, for `pneumo fit`.

    Offsets are fitted within theirs; the others cannot be fitted, and widen all intervals. By default the
    zero of x is known within 0.5 mm where stops or configured dead volumes show it, else within 5 mm.
    """

    x_zero_mm: Number | None = key_of("of the position's zero", None, gt=0, le=1000)
    x_scale_percent: Percent = key_of("of the position's scale", 0.1)
    P_gain_percent: Percent = key_of("of the gain of each pressure sensor", 0.1)
    P_offset_kPa: Number = key_of("of the offset of the sensors of P_A and P_B", 2.0, gt=0, le=100)


class RunSection(Section):
    """Which experiments run, how long at most, how often, and how many cylinders of a table in one job."""

    experiments: Literal["all"] | Annotated[list[str], Field(min_length=1)] = key_of(
        "names of the experiments to run, or all", "all"
    )
    duration_limit_s: Seconds | None = key_of("full-order runs are cut to this length", None)
    seeds: Count = key_of(
        "pneumo study: runs of each experiment, each with its own seed", 5, ge=1, le=MOST_SEEDS
    )
    block_size: Count = key_of("table of cylinders: cylinders in one job of the workflow", 50, ge=1, le=10**6)


class Configuration(Section):
    """The whole configuration of a study."""

    name: str = key_of("name of the study", pattern=r"^[\w-]{1,40}$")
    gas: GasSection
    supply: SupplySection
    cylinders: dict[Name, CylinderSection] = key_of(
        "cylinders by name; or the path of a CSV table, relative to this file", min_length=1
    )
    experiments: dict[Name, ExperimentSection] = key_of("experiments by name", min_length=1)
    levels: dict[Name, list[Conductance]] = key_of(
        "conductances k_0, W/K, of each heat-transfer level", default_factory=dict, min_length=1
    )
    n: Annotated[list[Annotated[Number, Field(gt=0, le=3)]], AfterValidator(increasing)] = key_of(
        "polytropic indices of the grid, increasing", min_length=1, max_length=1000
    )
    step_s: Number = key_of("integration step", ge=1e-7, le=1)
    most_halvings: Count = key_of(
        "how often a step that fails or is not accurate is halved", MOST_HALVINGS, ge=0, le=MOST_HALVINGS
    )
    percentile_rule: Literal["linear", "hazen"] = key_of(
        "how percentiles over experiments are interpolated, by NumPy's names; linear is a spreadsheet's",
        "linear",
    )
    run: RunSection = RunSection()
    sensors: SensorsSection | None = optional_key("how accurately sensors are known, for pneumo fit")

    @property
    def chosen(self) -> list[str]:
        """Names of the experiments that run."""
        return [*self.experiments] if self.run.experiments == "all" else self.run.experiments

    def duration(self, experiment: str) -> float:
        """Length of an experiment's run, s."""
        duration = self.experiments[experiment].duration_s
        return min(duration, self.run.duration_limit_s or duration)

    def loop(self, experiment: str) -> OpenLoopSection | ClosedLoopSection:
        """Section of an experiment's loop."""
        e = self.experiments[experiment]
        return getattr(self.cylinders[e.cylinder], f"{e.loop}_loop")

    @model_validator(mode="after")
    def _names_differ_by_more_than_case(self) -> Self:
        for section in ("cylinders", "experiments", "levels"):
            names: dict[str, str] = {}
            for name in getattr(self, section):
                if (other := names.setdefault(name.lower(), name)) != name:
                    raise conflict(name, f"differs from {other} by case only", (section, name))
        return self

    @model_validator(mode="after")
    def _names_exist(self) -> Self:
        for name, experiment in self.experiments.items():
            if experiment.cylinder not in self.cylinders:
                condition = f"must be one of {listed(self.cylinders)}"
                raise conflict(experiment.cylinder, condition, ("experiments", name, "cylinder"))
            section = f"{experiment.loop}_loop"
            if getattr(self.cylinders[experiment.cylinder], section) is None:
                condition = f"needs the section cylinders.{experiment.cylinder}.{section}"
                where = ("cylinders", experiment.cylinder, section)
                raise conflict(experiment.loop, condition, ("experiments", name, "loop"), where)
        for name in self.chosen:
            if name not in self.experiments:
                condition = f"no such experiment; there are {listed(self.experiments)}"
                raise conflict(name, condition, ("run", "experiments"))
        return self

    @model_validator(mode="after")
    def _grid_and_runs_can_be_made(self) -> Self:
        if "overall" in self.levels:
            condition = "reserved for Table 7's average; choose another name"
            raise conflict("overall", condition, ("levels", "overall"))
        for name in self.experiments:
            if (duration := self.duration(name)) > LONGEST * self.step_s:
                condition = f"must be at most {LONGEST:g} steps of step_s = {self.step_s:g}"
                raise conflict(duration, condition, ("experiments", name, "duration_s"), ("step_s",))
        return self


SCHEMA = Configuration.model_json_schema()

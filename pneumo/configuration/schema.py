"""Schema of the configuration: every section and key with its range, as pydantic models.

Keys name their unit (bore_mm); `pneumo.configuration.parameters` converts to SI.
"""

import itertools
import unicodedata
from collections.abc import Iterable
from typing import Annotated, Any, Literal, Self

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    ModelWrapValidatorHandler,
    PrivateAttr,
    model_validator,
)
from pydantic_core import PydanticCustomError

from pneumo.configuration.experiment import MOST_HALVINGS
from pneumo.configuration.nominal_flow import conductance_of_nominal_flow
from pneumo.configuration.text_file import NUMBER
from pneumo.errors import printable


def _number(value: Any) -> Any:
    """Refuse values that pydantic would accept as numbers: booleans, text such as 1_000, non-ASCII digits."""
    if isinstance(value, bool) or (isinstance(value, str) and not NUMBER.fullmatch(value.strip())):
        raise ValueError("must be a number")
    return value


MOST_PERCENT = 50.0  # of an accuracy
MOST_K_0_FACTOR = 100.0  # within which k_0 may be known

Number = Annotated[float, BeforeValidator(_number), Field(allow_inf_nan=False)]
Fraction = Annotated[Number, Field(gt=0, lt=1)]
Seconds = Annotated[Number, Field(gt=0, le=1e5)]
Frequency = Annotated[Number, Field(gt=0, le=1e4)]
Percent = Annotated[Number, Field(gt=0, le=MOST_PERCENT)]
Level = Annotated[Number, Field(ge=-100, le=100)]
Conductance = Annotated[Number, Field(ge=0, le=1e4)]
Name = Annotated[str, Field(pattern=r"^[A-Za-z][\w-]{0,39}$")]
Count = Annotated[int, BeforeValidator(_number)]


def _key(meaning: str, default: Any = ..., **limits: Any) -> Any:
    """Key of the configuration: its meaning, its default if it has one, and its limits."""
    return Field(default, description=meaning, **limits)


def _listed(names: Iterable[Any]) -> str:
    """Names in one line of text, at most twenty."""
    first = [printable(str(name)) for name in itertools.islice(names, 21)]
    return ", ".join([*first[:20], "..."] if len(first) > 20 else first)


def _conflict(value: Any, condition: str, *fields: tuple[str, ...]) -> PydanticCustomError:
    """Error for a value that conflicts with others; `fields` are their paths, first that of the value."""
    context = {"value": value, "condition": condition, "fields": fields}
    return PydanticCustomError("conflict", "{condition}", context)


LONGEST = 20_000_000  # steps of a run: 1 GB of states


class _Section(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)

    def _exactly_one(self, key: str, other: str, other_in_words: str = "") -> None:
        """Raise an error if a section has neither or both of two keys."""
        value, words = getattr(self, key), other_in_words or other
        if (value is None) == (getattr(self, other) is None):
            condition = f"or give {words}" if value is None else f"conflicts with {words}; give only one"
            raise _conflict(value, condition, (key,), (other,))


class GasSection(_Section):
    """Air as a perfect gas, and the two printed constants of eq (1)."""

    R_J_per_kgK: Number = _key("gas constant R", gt=0, le=5000)
    gamma: Number = _key("ratio of specific heats", ge=1.05, le=1.67)
    sonic_coefficient: Literal["exact"] | Fraction = _key(
        "factor of the sonic branch of eq (1), s K^0.5/m, or exact"
    )
    critical_ratio: Literal["exact"] | Fraction = _key("P_d/P_u at which flow becomes sonic, or exact")


class SupplySection(_Section):
    """Pressures and temperatures of the supply and of the surroundings."""

    P_s_Pa: Number = _key("absolute supply pressure, above P_atm_Pa", gt=0, le=5e6)
    P_atm_Pa: Number = _key("atmospheric pressure", gt=0, le=2e5)
    T_amb_K: Number = _key("temperature of walls and surroundings", ge=150, le=500)
    T_in_K: Number = _key("temperature of incoming air", ge=150, le=500)
    P_0_per_P_s: Literal["half-bridge"] | Fraction = _key(
        "equilibrium over supply pressure, or half-bridge to solve Appendix 2"
    )

    @model_validator(mode="after")
    def _supply_above_atmosphere(self) -> Self:
        if self.P_s_Pa <= self.P_atm_Pa:
            condition = f"must exceed P_atm_Pa = {self.P_atm_Pa:g}"
            raise _conflict(self.P_s_Pa, condition, ("P_s_Pa",), ("P_atm_Pa",))
        return self


class LoopSection(_Section):
    """How the replays of the paper read the signals of a loop: by samples."""

    replays_read: Literal["linear", "hold", "hold_next"] = _key(
        "samples are interpolated; held for a step; held, the step's last stage reads the next", "linear"
    )
    lag_s: Number = _key("delay of interpolated signals", 0.0, ge=0, le=1)

    @model_validator(mode="after")
    def _lag_beside_interpolation(self) -> Self:
        if self.lag_s and self.replays_read != "linear":
            condition = f"must be 0 with replays_read: {self.replays_read}"
            raise _conflict(self.lag_s, condition, ("lag_s",), ("replays_read",))
        return self


class OpenLoopSection(LoopSection):
    """Excitation of the open-loop runs: a two-valued command."""

    amplitude_V: Number = _key("magnitude of the command", gt=0, le=1000)
    reverse_at: Number = _key("fraction of the half-stroke at which the sign is reversed", gt=0, le=1)
    reversal: Literal["forced", "toggled"] = _key(
        "forced: inward while the piston is beyond; toggled: it keeps its reversed sign", "forced"
    )
    reversal_tested: Literal["each stage", "each step"] = _key(
        "when the position is compared with that fraction", "each stage"
    )
    reversal_recorded_late: Number = _key(
        "samples by which a reversal is late in the command that replays read", 0.0, ge=0, le=1
    )


class ClosedLoopSection(LoopSection):
    """Excitation of the closed-loop runs: a random position reference, and the gain of the controller."""

    variance_m2: Number | None = _key(
        "variance of the position reference; or give amplitude_mm", None, gt=0, le=10
    )
    amplitude_mm: Number | None = _key(
        "standard deviation of the position reference, or amplitude of a sweep or of steps",
        None,
        gt=0,
        le=5000,
    )
    k_p_V_per_m: Number = _key("proportional gain", gt=0, le=1e6)

    @model_validator(mode="after")
    def _one_amplitude(self) -> Self:
        self._exactly_one("amplitude_mm", "variance_m2")
        return self


class SettlingSection(_Section):
    """Force and end stop of the settling-time runs."""

    force_N: Number = _key("external force (negative: towards the stop)", lt=0, ge=-1e6)
    stop_mm: Number = _key("position of the end stop, inside the half-stroke", lt=0, ge=-5000)
    closed_loop_leak: Number = _key(
        "leak of the valve in closed loop, as a fraction of its full opening", 0.0, ge=0, le=0.1
    )


class ValveSection(_Section):
    """A valve by its catalogue: flow by ISO 6358, conductance C and critical ratio b at full opening.

    A nominal flow is converted: the section then has the C that belongs to it.
    """

    C_dm3_per_sbar: Number | None = _key(
        "sonic conductance C from supply to chamber at u_max_V; or give Q_n_l_per_min", None, gt=0, le=1000
    )
    Q_n_l_per_min: Number | None = _key(
        "nominal flow from supply to chamber at u_max_V, from 7 to 6 bar absolute, of air at 20 °C and 1 bar",
        None,
        exclude_if=lambda value: value is None,
        gt=0,
        le=2.5e5,
    )
    b: Number = _key("critical pressure ratio; take 0.3 if the catalogue has none", gt=0, lt=1)
    exhaust_ratio: Number = _key("C from chamber to exhaust over C from supply to chamber", 1.0, gt=0, le=10)
    leak_dm3_per_sbar: Number = _key("sonic conductance of each closed path", 0.0, ge=0, le=100)
    _Q_n: float | None = PrivateAttr(None)

    @model_validator(mode="wrap")
    @classmethod
    def _with_conductance(cls, value: Any, handler: ModelWrapValidatorHandler[Self]) -> Self:
        section = handler(value)
        section._exactly_one("C_dm3_per_sbar", "Q_n_l_per_min")
        if section.Q_n_l_per_min is None:
            return section
        C = conductance_of_nominal_flow(section.Q_n_l_per_min, section.b)
        others = section.model_dump(exclude_unset=True, exclude={"C_dm3_per_sbar", "Q_n_l_per_min"})
        converted = cls(C_dm3_per_sbar=C, **others)
        converted._Q_n = section.Q_n_l_per_min
        return converted

    @property
    def flow_as_given(self) -> tuple[str, float]:
        """Key and value by which the configuration gives the flow."""
        if self._Q_n is not None:
            return "Q_n_l_per_min", self._Q_n
        assert self.C_dm3_per_sbar is not None
        return "C_dm3_per_sbar", self.C_dm3_per_sbar


class ValveDynamicsSection(_Section):
    """How the valve follows its command, as `pneumo fit` finds it: for exports and linear models.

    Runs of a study have a valve that follows at once and in proportion.
    """

    lag_s: Number = _key("time constant of a first-order lag", 0.0, ge=0, le=1)
    dead_time_s: Number = _key("time after which the valve sees its command", 0.0, ge=-0.1, le=1)
    null_V: Number = _key("command at which the valve is shut", 0.0, ge=-1000, le=1000)
    dead_band_V: Number = _key("command to either side of that in which it stays shut", 0.0, ge=0, le=1000)


class CylinderSection(_Section):
    """A cylinder with its load, its valve and the signals that excite it."""

    bore_mm: Number = _key("diameter phi", gt=0, le=1000)
    stroke_mm: Number = _key("stroke l", gt=0, le=10000)
    rod_mm: Number = _key("diameter of a single rod, in chamber B; 0: no rod", 0.0, ge=0, le=1000)
    dead_volume_m3: Number | None = _key(
        "dead volume V_d of each chamber with its tube; 10 % of half the stroke if left out", None, gt=0, le=1
    )
    # Left out of the hash if not given: older configurations keep their hash.
    dead_volume_B_m3: Number | None = _key(
        "dead volume of chamber B, if it differs from that of A",
        None,
        exclude_if=lambda value: value is None,
        gt=0,
        le=1,
    )
    mass_kg: Number = _key("moving mass M with load", gt=0, le=1e5)
    friction_Ns_per_m: Number = _key("viscous friction coefficient k_f", ge=0, le=1e6)
    coulomb_N: Number = _key("Coulomb friction", 0.0, ge=0, le=1e6)
    incline_deg: Number = _key("angle by which chamber A lifts the mass; 90: straight up", 0.0, ge=-90, le=90)
    load_N: Number = _key("constant force, positive where it enlarges chamber A", 0.0, ge=-1e6, le=1e6)
    k_x_k_u_m2_per_V: Number | None = _key(
        "valve area per volt, with the flow of eq (1); or give the section valve", None, gt=0, le=1e-2
    )
    valve: ValveSection | None = _key("a valve by its catalogue", None)
    u_max_V: Number = _key("limit of the command", gt=0, le=1000)
    valve_dynamics: ValveDynamicsSection | None = _key(
        "how the valve follows its command", None, exclude_if=lambda value: value is None
    )
    k_0_factor: Number | None = _key(
        "pneumo study: factor within which k_0 is known; default 2, or that of the catalogue",
        None,
        exclude_if=lambda value: value is None,
        ge=1,
        le=MOST_K_0_FACTOR,
    )
    valve_within_percent: Percent | None = _key(
        "pneumo study: accuracy of the valve's flow; left out: exact",
        None,
        exclude_if=lambda value: value is None,
    )
    dead_volumes_within_percent: Percent | None = _key(
        "pneumo study: accuracy of both dead volumes; left out: exact",
        None,
        exclude_if=lambda value: value is None,
    )
    seed: Count = _key("seed of the Random Number block", ge=0, lt=2**32)
    sample_time_s: Number = _key("time between draws", gt=0, le=1000)
    open_loop: OpenLoopSection | None = _key("for experiments in open loop", None)
    closed_loop: ClosedLoopSection | None = _key("for experiments in closed loop", None)
    settling: SettlingSection | None = _key("for settling runs, which only the paper's study makes", None)

    @model_validator(mode="after")
    def _one_valve_and_parts_that_fit(self) -> Self:
        self._exactly_one("k_x_k_u_m2_per_V", "valve", "the section valve")
        if self.rod_mm >= self.bore_mm:
            condition = f"must be below bore_mm = {self.bore_mm:g}"
            raise _conflict(self.rod_mm, condition, ("rod_mm",), ("bore_mm",))
        if self.settling and self.settling.stop_mm <= -self.stroke_mm / 2:
            condition = f"must lie inside the half-stroke, above {-self.stroke_mm / 2:g},"
            raise _conflict(self.settling.stop_mm, condition, ("settling", "stop_mm"), ("stroke_mm",))
        if (dynamics := self.valve_dynamics) and abs(dynamics.null_V) + dynamics.dead_band_V >= self.u_max_V:
            condition = f"with dead_band_V = {dynamics.dead_band_V:g} must be below {self.u_max_V:g}"
            raise _conflict(dynamics.null_V, condition, ("valve_dynamics", "null_V"), ("u_max_V",))
        return self


class SignalSection(_Section):
    """Signal of an experiment, if not the default: prbs in open loop, gaussian in closed loop.

    Its amplitude is that of the loop's section, in V or in mm.
    """

    kind: Literal["prbs", "gaussian", "sweep", "steps", "csv"] = _key(
        "two-valued or normal random numbers, a sine of rising frequency, steps, a file"
    )
    from_Hz: Frequency | None = _key("sweep: frequency at the start", None)
    to_Hz: Frequency | None = _key("sweep: frequency at the end", None)
    levels: Annotated[list[Level], Field(min_length=1, max_length=1000)] | None = _key(
        "steps: levels as multiples of the amplitude, repeated to the end", None
    )
    hold_s: Seconds | None = _key("steps: length of each; csv: time between rows", None)
    file: str | None = _key("csv: path from the working directory; its first row names the columns", None)
    column: str | None = _key(
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
                raise _conflict(None, f"for kind: {self.kind}", (key,))
            if key not in wanted and value is not None:
                raise _conflict(value, f"not allowed with kind: {self.kind}", (key,), ("kind",))
        return self


class ExperimentSection(_Section):
    """One experiment: which cylinder, which loop, how much wall heat, how long."""

    cylinder: str = _key("name of one of the cylinders; not with a table: each experiment runs on every row")
    loop: Literal["open", "closed"] = _key("open loop, or proportional position control")
    signal: SignalSection | None = _key("signal, if not the loop's default", None)
    k_0_W_per_K: Literal["catalogue"] | Conductance | None = _key(
        "thermal conductance of a chamber's wall at equilibrium; catalogue: estimated from"
        " measured cylinders; or give lambda_0_W_per_m2K",
        None,
    )
    lambda_0_W_per_m2K: Number | None = _key(
        "heat transfer coefficient at equilibrium: k_0 over the heat transfer area in mid-stroke",
        None,
        ge=0,
        le=1e5,
    )
    duration_s: Seconds = _key("length of the full-order run")
    settling_stop_s: Seconds | None = _key(
        "settling run: time after release at which it ends; default: once its air is near T_amb_K", None
    )
    pressure_stride: Count = _key("steps between stored pressures of replays", 10, ge=1, le=10**6)

    @model_validator(mode="after")
    def _one_conductance(self) -> Self:
        keys = ("k_0_W_per_K", "lambda_0_W_per_m2K")  # the error names the first if both are missing
        self._exactly_one(*(keys if self.k_0_W_per_K is None else keys[::-1]))
        return self


class AccuracySection(_Section):
    """How accurately the rig is known, for `pneumo fit`: limits of errors, as data sheets state them.

    A limit is half of a 95 % interval. b, exhaust ratio and supply pressure are fitted within theirs; the
    other quantities cannot be fitted, and widen the intervals of what is. The zero of x is taken for good
    to 0.5 mm where stops or configured dead volumes show it, else to 5 mm, its scale for good to 0.1 %.
    """

    b: Number = _key("of the critical pressure ratio", 0.1, gt=0, le=1)
    exhaust_percent: Percent = _key("of the exhaust ratio", 5.0)
    P_s_percent: Percent = _key("of the supply pressure", 2.0)
    bore_percent: Percent = _key("of the bore", 0.2)
    stroke_mm: Number = _key("of the stroke", 0.5, gt=0, le=1000)
    x_zero_mm: Number | None = _key("of the position's zero", None, gt=0, le=1000)
    x_scale_percent: Percent | None = _key("of the position's scale", None)
    T_amb_K: Number = _key("of the temperature of walls and surroundings", 3.0, gt=0, le=100)
    T_in_K: Number = _key("of the temperature of incoming air", 3.0, gt=0, le=100)
    P_atm_percent: Percent = _key("of the atmospheric pressure", 2.0)
    P_gain_percent: Percent = _key("of the gain of each pressure sensor", 0.1)


class RunSection(_Section):
    """Which experiments run, how long at most, how often, and how many cylinders of a table in one job."""

    experiments: Literal["all"] | Annotated[list[str], Field(min_length=1)] = _key(
        "names of the experiments to run, or all", "all"
    )
    duration_limit_s: Seconds | None = _key("full-order runs are cut to this length", None)
    seeds: Count = _key("pneumo study: runs of each experiment, each with its own seed", 5, ge=1, le=1000)
    block_size: Count = _key("table of cylinders: cylinders in one job of the workflow", 50, ge=1, le=10**6)


class Configuration(_Section):
    """The whole configuration of a study."""

    name: str = _key("name of the study", pattern=r"^[\w-]{1,40}$")
    gas: GasSection
    supply: SupplySection
    cylinders: dict[Name, CylinderSection] = _key(
        "cylinders by name; or the path of a table, CSV or Parquet, relative to this file", min_length=1
    )
    experiments: dict[Name, ExperimentSection] = _key("experiments by name", min_length=1)
    levels: dict[Name, list[Conductance]] = _key(
        "conductances k_0, W/K, of each heat-transfer level", default_factory=dict, min_length=1
    )
    n: list[Annotated[Number, Field(gt=0, le=3)]] = _key(
        "polytropic indices of the grid, increasing", min_length=1, max_length=1000
    )
    step_s: Number = _key("integration step", ge=1e-7, le=1)
    most_halvings: Count = _key(
        "how often a step that fails or is not accurate is halved", MOST_HALVINGS, ge=0, le=MOST_HALVINGS
    )
    percentile_rule: Literal[
        "linear",
        "hazen",
        "weibull",
        "median_unbiased",
        "normal_unbiased",
        "inverted_cdf",
        "averaged_inverted_cdf",
        "closest_observation",
        "interpolated_inverted_cdf",
    ] = _key(
        "how percentiles over experiments are interpolated, by NumPy's names; linear is a spreadsheet's",
        "linear",
    )
    run: RunSection = RunSection()
    accuracy: AccuracySection | None = _key(
        "how accurately the rig is known, for pneumo fit", None, exclude_if=lambda value: value is None
    )

    @model_validator(mode="after")
    def _names_can_be_told_apart(self) -> Self:
        for section in ("cylinders", "experiments", "levels"):
            by_look: dict[str, str] = {}
            for name in getattr(self, section):
                if not all(c.isalnum() or c in "_-" for c in name):
                    raise _conflict(name, "contains a character that cannot be seen", (section, name))
                other = by_look.setdefault(unicodedata.normalize("NFKC", name).casefold(), name)
                if other != name:
                    raise _conflict(name, f"differs from {other} by case or look only", (section, name))
        return self

    @model_validator(mode="after")
    def _names_exist(self) -> Self:
        for name, experiment in self.experiments.items():
            if experiment.cylinder not in self.cylinders:
                condition = f"must be one of {_listed(self.cylinders)}"
                raise _conflict(experiment.cylinder, condition, ("experiments", name, "cylinder"))
            section = f"{experiment.loop}_loop"
            if getattr(self.cylinders[experiment.cylinder], section) is None:
                condition = f"needs the section cylinders.{experiment.cylinder}.{section}"
                where = ("cylinders", experiment.cylinder, section)
                raise _conflict(experiment.loop, condition, ("experiments", name, "loop"), where)
        for name in self.run.experiments if self.run.experiments != "all" else ():
            if name not in self.experiments:
                condition = f"no such experiment; there are {_listed(self.experiments)}"
                raise _conflict(name, condition, ("run", "experiments"))
        return self

    @model_validator(mode="after")
    def _grid_and_runs_can_be_made(self) -> Self:
        if "overall" in self.levels:
            condition = "reserved for Table 7's average; choose another name"
            raise _conflict("overall", condition, ("levels", "overall"))
        for before, after in itertools.pairwise(self.n):
            if before >= after:
                raise _conflict(self.n, f"must increase, and {after:g} follows {before:g}", ("n",))
        for name, experiment in self.experiments.items():
            duration = min(experiment.duration_s, self.run.duration_limit_s or experiment.duration_s)
            if duration > LONGEST * self.step_s:
                condition = f"must be at most {LONGEST:g} steps of step_s = {self.step_s:g}"
                raise _conflict(duration, condition, ("experiments", name, "duration_s"), ("step_s",))
        return self


SCHEMA = Configuration.model_json_schema()

"""Schema of the configuration: every section and key with its range, as pydantic models.

Keys name their unit (bore_mm); `pneumo.configuration.parameters` converts to SI.
"""

import itertools
from collections.abc import Iterable
from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, model_validator
from pydantic_core import PydanticCustomError

from pneumo.configuration.experiment import MOST_HALVINGS
from pneumo.errors import printable


def _number(value: Any) -> Any:
    """Refuse booleans, which pydantic would turn into numbers."""
    if isinstance(value, bool):
        raise ValueError("must be a number")
    return value


Number = Annotated[float, BeforeValidator(_number), Field(allow_inf_nan=False)]
Share = Annotated[Number, Field(gt=0, lt=1)]
Seconds = Annotated[Number, Field(gt=0, le=1e5)]
Frequency = Annotated[Number, Field(gt=0, le=1e4)]
Level = Annotated[Number, Field(ge=-100, le=100)]
Conductance = Annotated[Number, Field(ge=0, le=1e4)]
Name = Annotated[str, Field(pattern=r"^[A-Za-z][\w-]{0,39}$")]
Count = Annotated[int, BeforeValidator(_number)]


def _listed(names: Iterable[Any]) -> str:
    """Names in one line, at most twenty."""
    first = [printable(str(name)) for name in itertools.islice(names, 21)]
    return ", ".join([*first[:20], "..."] if len(first) > 20 else first)


def _conflict(value: Any, condition: str, *fields: tuple[str, ...]) -> PydanticCustomError:
    """Error of a value that conflicts with others; `fields` are paths, the first that of the value."""
    context = {"value": value, "condition": condition, "fields": fields}
    return PydanticCustomError("conflict", "{condition}", context)


def _missing(field: str, alternative: str, *others: str) -> PydanticCustomError:
    """Error of a key that is missing, as are the others that may replace it."""
    return _conflict(None, alternative, (field,), *((other,) for other in others))


LONGEST = 20_000_000  # steps of a run: 1 GB of states


class _Section(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class GasSection(_Section):
    """Air as a perfect gas, and the two printed constants of eq (1)."""

    R_J_per_kgK: Number = Field(gt=0, le=5000, description="gas constant R")
    gamma: Number = Field(ge=1.05, le=1.67, description="ratio of specific heats")
    sonic_coefficient: Literal["exact"] | Share = Field(
        description="factor of the sonic branch of eq (1), s K^0.5/m, or exact"
    )
    critical_ratio: Literal["exact"] | Share = Field(
        description="P_d/P_u at which flow becomes sonic, or exact"
    )


class SupplySection(_Section):
    """Supply and surroundings."""

    P_s_Pa: Number = Field(gt=0, le=5e6, description="absolute supply pressure, above P_atm_Pa")
    P_atm_Pa: Number = Field(gt=0, le=2e5, description="atmospheric pressure")
    T_amb_K: Number = Field(ge=150, le=500, description="temperature of walls and surroundings")
    T_in_K: Number = Field(ge=150, le=500, description="temperature of incoming air")
    P_0_per_P_s: Literal["half-bridge"] | Share = Field(
        description="equilibrium over supply pressure, or half-bridge to solve Appendix 2"
    )

    @model_validator(mode="after")
    def _supply_above_atmosphere(self) -> Self:
        if self.P_s_Pa <= self.P_atm_Pa:
            condition = f"must exceed P_atm_Pa = {self.P_atm_Pa:g}"
            raise _conflict(self.P_s_Pa, condition, ("P_s_Pa",), ("P_atm_Pa",))
        return self


class LoopSection(_Section):
    """How the replays of the paper read the signals of a loop: by samples."""

    replays_read: Literal["linear", "hold", "hold_next"] = Field(
        "linear",
        description="samples are interpolated; held for a step; held, the step's last stage reads the next",
    )
    lag_s: Number = Field(0.0, ge=0, le=1, description="delay of interpolated signals")

    @model_validator(mode="after")
    def _lag_beside_interpolation(self) -> Self:
        if self.lag_s and self.replays_read != "linear":
            condition = f"must be 0 with replays_read: {self.replays_read}"
            raise _conflict(self.lag_s, condition, ("lag_s",), ("replays_read",))
        return self


class OpenLoopSection(LoopSection):
    """Two-valued sequence of the open-loop runs."""

    amplitude_V: Number = Field(gt=0, le=1000, description="magnitude of the command")
    reverse_at: Number = Field(
        gt=0, le=1, description="fraction of the half-stroke at which the sign is reversed"
    )
    reversal: Literal["forced", "toggled"] = Field(
        "forced",
        description="forced: inward while the piston is beyond; toggled: it keeps its reversed sign",
    )
    reversal_tested: Literal["each stage", "each step"] = Field(
        "each stage", description="when the position is compared with that fraction"
    )


class ClosedLoopSection(LoopSection):
    """Random position reference and proportional controller of the closed-loop runs."""

    variance_m2: Annotated[Number, Field(gt=0, le=10)] | None = Field(
        None, description="variance of the position reference; or give amplitude_mm"
    )
    amplitude_mm: Annotated[Number, Field(gt=0, le=5000)] | None = Field(
        None, description="standard deviation of the position reference, or amplitude of a sweep or of steps"
    )
    k_p_V_per_m: Number = Field(gt=0, le=1e6, description="proportional gain")

    @model_validator(mode="after")
    def _one_amplitude(self) -> Self:
        if self.variance_m2 is None and self.amplitude_mm is None:
            raise _missing("amplitude_mm", "or give variance_m2", "variance_m2")
        if self.variance_m2 is not None and self.amplitude_mm is not None:
            condition = "conflicts with variance_m2; give only one"
            raise _conflict(self.amplitude_mm, condition, ("amplitude_mm",), ("variance_m2",))
        return self


class SettlingSection(_Section):
    """Force and end stop of the settling-time runs."""

    force_N: Number = Field(lt=0, ge=-1e6, description="external force (negative: towards the stop)")
    stop_mm: Number = Field(lt=0, ge=-5000, description="position of the end stop, inside the half-stroke")
    closed_loop_leak: Number = Field(
        0.0, ge=0, le=0.1, description="leak of the valve in closed loop, as a fraction of its full opening"
    )


class ValveSection(_Section):
    """A valve by its catalogue: flow by ISO 6358, conductance C and critical ratio b at full opening."""

    C_dm3_per_sbar: Number = Field(
        gt=0, le=1000, description="sonic conductance C from supply to chamber at u_max_V"
    )
    b: Number = Field(gt=0, lt=1, description="critical pressure ratio; take 0.3 if the catalogue has none")
    exhaust_ratio: Number = Field(
        1.0, gt=0, le=10, description="C from chamber to exhaust over C from supply to chamber"
    )
    leak_dm3_per_sbar: Number = Field(0.0, ge=0, le=100, description="sonic conductance of each closed path")


class CylinderSection(_Section):
    """A cylinder with its load, its valve and the signals that excite it."""

    bore_mm: Number = Field(gt=0, le=1000, description="diameter phi")
    stroke_mm: Number = Field(gt=0, le=10000, description="stroke l")
    rod_mm: Number = Field(
        0.0, ge=0, le=1000, description="diameter of a single rod, in chamber B; 0: no rod"
    )
    dead_volume_m3: Annotated[Number, Field(gt=0, le=1)] | None = Field(
        None, description="dead volume V_d of each chamber with its tube; 10 % of half the stroke if left out"
    )
    # Left out of the hash if not given: older configurations keep their hash.
    dead_volume_B_m3: Annotated[Number, Field(gt=0, le=1)] | None = Field(
        None,
        exclude_if=lambda value: value is None,
        description="dead volume of chamber B, if it differs from that of A",
    )
    mass_kg: Number = Field(gt=0, le=1e5, description="moving mass M with load")
    friction_Ns_per_m: Number = Field(ge=0, le=1e6, description="viscous friction coefficient k_f")
    coulomb_N: Number = Field(0.0, ge=0, le=1e6, description="Coulomb friction")
    incline_deg: Number = Field(
        0.0, ge=-90, le=90, description="angle by which chamber A lifts the mass; 90: straight up"
    )
    load_N: Number = Field(
        0.0, ge=-1e6, le=1e6, description="constant force, positive where it enlarges chamber A"
    )
    k_x_k_u_m2_per_V: Annotated[Number, Field(gt=0, le=1e-2)] | None = Field(
        None, description="valve area per volt, with the flow of eq (1); or give the section valve"
    )
    valve: ValveSection | None = Field(None, description="a valve by its catalogue")
    u_max_V: Number = Field(gt=0, le=1000, description="limit of the command")
    k_0_factor: Annotated[Number, Field(ge=1, le=100)] | None = Field(
        None,
        exclude_if=lambda value: value is None,
        description="pneumo study: factor within which k_0 is known; default 2, or that of the catalogue",
    )
    seed: Count = Field(ge=0, lt=2**32, description="seed of the Random Number block")
    sample_time_s: Number = Field(gt=0, le=1000, description="time between draws")
    open_loop: OpenLoopSection | None = Field(None, description="for experiments in open loop")
    closed_loop: ClosedLoopSection | None = Field(None, description="for experiments in closed loop")
    settling: SettlingSection | None = Field(
        None, description="for settling runs, which only the paper's study makes"
    )

    @model_validator(mode="after")
    def _one_valve_and_parts_that_fit(self) -> Self:
        if self.k_x_k_u_m2_per_V is None and self.valve is None:
            raise _missing("k_x_k_u_m2_per_V", "or give the section valve", "valve")
        if self.k_x_k_u_m2_per_V is not None and self.valve is not None:
            condition = "conflicts with the section valve; give only one"
            raise _conflict(self.k_x_k_u_m2_per_V, condition, ("k_x_k_u_m2_per_V",), ("valve",))
        if self.rod_mm >= self.bore_mm:
            condition = f"must be below bore_mm = {self.bore_mm:g}"
            raise _conflict(self.rod_mm, condition, ("rod_mm",), ("bore_mm",))
        if self.settling and self.settling.stop_mm <= -self.stroke_mm / 2:
            condition = f"must lie inside the half-stroke, above {-self.stroke_mm / 2:g},"
            raise _conflict(self.settling.stop_mm, condition, ("settling", "stop_mm"), ("stroke_mm",))
        return self


class SignalSection(_Section):
    """Signal of an experiment, if not the default: prbs in open loop, gaussian in closed loop.

    Its amplitude is that of the loop's section, in V or in mm.
    """

    kind: Literal["prbs", "gaussian", "sweep", "steps", "csv"] = Field(
        description="two-valued or normal random numbers, a sine of rising frequency, steps, a file"
    )
    from_Hz: Frequency | None = Field(None, description="sweep: frequency at the start")
    to_Hz: Frequency | None = Field(None, description="sweep: frequency at the end")
    levels: Annotated[list[Level], Field(min_length=1, max_length=1000)] | None = Field(
        None, description="steps: levels as multiples of the amplitude, repeated to the end"
    )
    hold_s: Seconds | None = Field(None, description="steps: length of each; csv: time between rows")
    file: str | None = Field(
        None, description="csv: path from the working directory; its first row names the columns"
    )
    column: str | None = Field(
        None, description="csv: column with the command, V, in open loop, or the reference, m, in closed loop"
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
                raise _missing(key, f"for kind: {self.kind}")
            if key not in wanted and value is not None:
                raise _conflict(value, f"not allowed with kind: {self.kind}", (key,), ("kind",))
        return self


class ExperimentSection(_Section):
    """One experiment: which cylinder, which loop, how much wall heat, how long."""

    cylinder: str = Field(
        description="name of one of the cylinders; not with a table: each experiment runs on every row"
    )
    loop: Literal["open", "closed"] = Field(description="open loop, or proportional position control")
    signal: SignalSection | None = Field(None, description="signal, if not the loop's default")
    k_0_W_per_K: Literal["catalogue"] | Conductance | None = Field(
        None,
        description="thermal conductance of a chamber's wall at equilibrium; catalogue: estimated from"
        " measured cylinders; or give lambda_0_W_per_m2K",
    )
    lambda_0_W_per_m2K: Annotated[Number, Field(ge=0, le=1e5)] | None = Field(
        None,
        description="heat transfer coefficient at equilibrium: k_0 over the heat transfer area in mid-stroke",
    )
    duration_s: Seconds = Field(description="length of the full-order run")
    settling_stop_s: Seconds | None = Field(
        None, description="settling run: time after release at which it ends; default: once settled"
    )
    pressure_stride: Count = Field(
        10, ge=1, le=10**6, description="steps between stored pressures of replays"
    )

    @model_validator(mode="after")
    def _one_conductance(self) -> Self:
        if self.k_0_W_per_K is None and self.lambda_0_W_per_m2K is None:
            raise _missing("k_0_W_per_K", "or give lambda_0_W_per_m2K", "lambda_0_W_per_m2K")
        if self.k_0_W_per_K is not None and self.lambda_0_W_per_m2K is not None:
            condition = "conflicts with k_0_W_per_K; give only one"
            raise _conflict(self.lambda_0_W_per_m2K, condition, ("lambda_0_W_per_m2K",), ("k_0_W_per_K",))
        return self


class RunSection(_Section):
    """Which experiments run, how long at most, how often, and how many cylinders of a table in one job."""

    experiments: Literal["all"] | Annotated[list[str], Field(min_length=1)] = Field(
        default="all", description="names of the experiments to run, or all"
    )
    duration_limit_s: Seconds | None = Field(
        default=None, description="full-order runs are cut to this length"
    )
    seeds: Count = Field(
        default=5, ge=1, le=1000, description="pneumo study: runs of each experiment, each with its own seed"
    )
    block_size: Count = Field(
        default=50, ge=1, le=10**6, description="table of cylinders: cylinders in one job of the workflow"
    )


class Configuration(_Section):
    """The whole configuration of a study."""

    name: str = Field(pattern=r"^[\w-]{1,40}$", description="name of the study")
    gas: GasSection
    supply: SupplySection
    cylinders: dict[Name, CylinderSection] = Field(
        min_length=1,
        description="cylinders by name; or the path of a table, CSV or Parquet, relative to this file",
    )
    experiments: dict[Name, ExperimentSection] = Field(min_length=1, description="experiments by name")
    levels: dict[Name, list[Conductance]] = Field(
        default_factory=dict, min_length=1, description="conductances k_0, W/K, of each heat-transfer level"
    )
    n: list[Annotated[Number, Field(gt=0, le=3)]] = Field(
        min_length=1, max_length=1000, description="polytropic indices of the grid, increasing"
    )
    step_s: Number = Field(ge=1e-7, le=1, description="integration step")
    most_halvings: Count = Field(
        MOST_HALVINGS,
        ge=0,
        le=MOST_HALVINGS,
        description="how often a step that fails or is not accurate is halved",
    )
    stationary_tolerance: Number = Field(
        0.002,
        gt=0,
        lt=1,
        description="relative change over one thermal time constant below which a run is at rest",
    )
    run: RunSection = RunSection()

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
            if not before < after:
                raise _conflict(self.n, f"must increase, and {after:g} follows {before:g}", ("n",))
        for name, experiment in self.experiments.items():
            duration = min(experiment.duration_s, self.run.duration_limit_s or experiment.duration_s)
            if duration > LONGEST * self.step_s:
                condition = f"must be at most {LONGEST:g} steps of step_s = {self.step_s:g}"
                raise _conflict(duration, condition, ("experiments", name, "duration_s"), ("step_s",))
        return self


SCHEMA = Configuration.model_json_schema()

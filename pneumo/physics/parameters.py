"""Configuration: read, validated and converted to SI units once; nothing downstream reads it again.

Units stand in the keys (bore_mm). The only errors are `ConfigurationError`s of one line.
"""

import hashlib
import itertools
import json
from collections.abc import Iterable, Mapping, Sequence
from math import pi
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    ValidationError,
    model_validator,
)
from pydantic_core import PydanticCustomError

from pneumo.physics.cylinder import Cylinder
from pneumo.physics.equilibrium import equilibrium_pressure
from pneumo.physics.experiment import Drive, Excitation, Experiment, Plant, Push, Study
from pneumo.physics.plain_yaml import ConfigurationError, printable, read_yaml, shown
from pneumo.physics.valve import Conditions, Gas, Valve, critical_ratio, sonic_coefficient


def _number(value: Any) -> Any:
    """Refuse what pydantic would quietly turn into a number."""
    if isinstance(value, bool):
        raise ValueError("must be a number")
    return value


Number = Annotated[float, BeforeValidator(_number), Field(allow_inf_nan=False)]
Name = Annotated[str, Field(pattern=r"^[A-Za-z][\w-]{0,39}$")]
Count = Annotated[int, BeforeValidator(_number)]


def _listed(names: Iterable[Any]) -> str:
    """Names after one another, as many as a line can take."""
    first = [printable(str(name)) for name in itertools.islice(names, 21)]
    return ", ".join([*first[:20], "..."] if len(first) > 20 else first)


def _conflict(value: Any, condition: str, *fields: tuple[str, ...]) -> PydanticCustomError:
    """Error of a value that disagrees with others; fields are paths, the first that of the value."""
    context = {"value": value, "condition": condition, "fields": fields}
    return PydanticCustomError("conflict", "{condition}", context)


LONGEST = 20_000_000  # steps of a run; their states fill 1 GB


class _Section(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class GasSection(_Section):
    """Air as a perfect gas, and the two printed constants of eq (1)."""

    R_J_per_kgK: Annotated[Number, Field(gt=0, le=5000, description="gas constant R")]
    gamma: Annotated[Number, Field(ge=1.05, le=1.67, description="ratio of specific heats")]
    sonic_coefficient: Annotated[
        Literal["exact"] | Annotated[Number, Field(gt=0, lt=1)],
        Field(description="factor of the sonic branch of eq (1), s K^0.5/m, or exact"),
    ]
    critical_ratio: Annotated[
        Literal["exact"] | Annotated[Number, Field(gt=0, lt=1)],
        Field(description="P_d/P_u at which flow becomes sonic, or exact"),
    ]


class SupplySection(_Section):
    """Supply and surroundings."""

    P_s_Pa: Annotated[Number, Field(gt=0, le=5e6, description="absolute supply pressure, above P_atm_Pa")]
    P_atm_Pa: Annotated[Number, Field(gt=0, le=2e5, description="atmospheric pressure")]
    T_amb_K: Annotated[Number, Field(ge=150, le=500, description="temperature of walls and surroundings")]
    T_in_K: Annotated[Number, Field(ge=150, le=500, description="temperature of incoming air")]
    P_0_per_P_s: Annotated[
        Literal["half-bridge"] | Annotated[Number, Field(gt=0, lt=1)],
        Field(description="equilibrium over supply pressure, or half-bridge to solve Appendix 2"),
    ]

    @model_validator(mode="after")
    def _supply_above_atmosphere(self) -> Self:
        if self.P_s_Pa <= self.P_atm_Pa:
            condition = f"must exceed P_atm_Pa = {self.P_atm_Pa:g}"
            raise _conflict(self.P_s_Pa, condition, ("P_s_Pa",), ("P_atm_Pa",))
        return self


class OpenLoopSection(_Section):
    """Two-valued sequence of the open-loop runs."""

    amplitude_V: Annotated[Number, Field(gt=0, le=1000, description="magnitude of the command")]
    reverse_at: Annotated[
        Number, Field(gt=0, le=1, description="fraction of the half-stroke at which the sign is forced back")
    ]


class ClosedLoopSection(_Section):
    """Random position reference and proportional controller of the closed-loop runs."""

    variance_m2: Annotated[Number, Field(gt=0, le=10, description="variance of the position reference")]
    k_p_V_per_m: Annotated[Number, Field(gt=0, le=1e6, description="proportional gain")]


class SettlingSection(_Section):
    """Force and end stop of the settling-time runs."""

    force_N: Annotated[
        Number, Field(lt=0, ge=-1e6, description="external force (negative: towards the stop)")
    ]
    stop_mm: Annotated[
        Number, Field(lt=0, ge=-5000, description="position of the end stop, inside the half-stroke")
    ]


class CylinderSection(_Section):
    """A cylinder with its load, its valve and the signals that excite it."""

    bore_mm: Annotated[Number, Field(gt=0, le=1000, description="diameter phi")]
    stroke_mm: Annotated[Number, Field(gt=0, le=10000, description="stroke l")]
    dead_volume_m3: Annotated[Number, Field(gt=0, le=1, description="dead volume V_d of each chamber")]
    mass_kg: Annotated[Number, Field(gt=0, le=1e5, description="moving mass M with load")]
    friction_Ns_per_m: Annotated[Number, Field(ge=0, le=1e6, description="viscous friction coefficient k_f")]
    k_x_k_u_m2_per_V: Annotated[Number, Field(gt=0, le=1e-2, description="valve area per volt")]
    u_max_V: Annotated[Number, Field(gt=0, le=1000, description="limit of the command")]
    seed: Annotated[Count, Field(ge=0, lt=2**32, description="seed of the Random Number block")]
    sample_time_s: Annotated[Number, Field(gt=0, le=1000, description="time between draws")]
    open_loop: OpenLoopSection
    closed_loop: ClosedLoopSection
    settling: SettlingSection

    @model_validator(mode="after")
    def _stop_inside_stroke(self) -> Self:
        if self.settling.stop_mm <= -self.stroke_mm / 2:
            condition = f"must lie inside the half-stroke, above {-self.stroke_mm / 2:g},"
            raise _conflict(self.settling.stop_mm, condition, ("settling", "stop_mm"), ("stroke_mm",))
        return self


class ExperimentSection(_Section):
    """One experiment: which cylinder, which loop, how much wall heat, how long."""

    cylinder: Annotated[str, Field(description="name of one of the cylinders")]
    loop: Annotated[
        Literal["open", "closed"], Field(description="open loop, or proportional position control")
    ]
    k_0_W_per_K: Annotated[Number, Field(ge=0, le=1e4, description="thermal conductance at equilibrium")]
    duration_s: Annotated[Number, Field(gt=0, le=1e5, description="length of the full-order run")]
    pressure_stride: Annotated[
        Count, Field(ge=1, le=10**6, description="steps between stored pressures of replays")
    ]


class RunSection(_Section):
    """Which experiments run, and a limit on their length for smoke runs."""

    experiments: Annotated[
        Literal["all"] | Annotated[list[str], Field(min_length=1)],
        Field(description="names of experiments, or all"),
    ]
    duration_limit_s: Annotated[
        Annotated[Number, Field(gt=0, le=1e5)] | None, Field(description="longest full-order run")
    ] = None


class Configuration(_Section):
    """The whole configuration of a study."""

    name: Annotated[str, Field(pattern=r"^[\w-]{1,40}$", description="name of the study")]
    gas: GasSection
    supply: SupplySection
    cylinders: Annotated[dict[Name, CylinderSection], Field(min_length=1, description="cylinders by name")]
    experiments: Annotated[
        dict[Name, ExperimentSection],
        Field(min_length=1, description="experiments by name"),
    ]
    levels: Annotated[
        dict[Name, list[Annotated[Number, Field(ge=0, le=1e4)]]],
        Field(min_length=1, description="conductances k_0 of each heat-transfer level by name, W/K"),
    ]
    n: Annotated[
        list[Annotated[Number, Field(gt=0, le=3)]],
        Field(min_length=1, max_length=1000, description="polytropic indices of the grid, increasing"),
    ]
    step_s: Annotated[Number, Field(ge=1e-7, le=1, description="integration step")]
    lag_s: Annotated[Number, Field(ge=0, le=1, description="delay of recorded signals, published transport")]
    stationary_tolerance: Annotated[
        Number,
        Field(gt=0, lt=1, description="relative change over one thermal time constant that counts as none"),
    ]
    run: RunSection

    @model_validator(mode="after")
    def _names_exist(self) -> Self:
        for name, experiment in self.experiments.items():
            if experiment.cylinder not in self.cylinders:
                condition = f"must be one of {_listed(self.cylinders)}"
                raise _conflict(experiment.cylinder, condition, ("experiments", name, "cylinder"))
        for name in self.run.experiments if self.run.experiments != "all" else ():
            if name not in self.experiments:
                condition = f"no such experiment; there are {_listed(self.experiments)}"
                raise _conflict(name, condition, ("run", "experiments"))
        return self

    @model_validator(mode="after")
    def _grid_and_runs_can_be_made(self) -> Self:
        if "overall" in self.levels:
            raise _conflict(
                "overall", "is the name of Table 7's average; take another", ("levels", "overall")
            )
        for before, after in itertools.pairwise(self.n):
            if not before < after:
                raise _conflict(self.n, f"must increase, and {after:g} follows {before:g}", ("n",))
        for name, experiment in self.experiments.items():
            duration = min(experiment.duration_s, self.run.duration_limit_s or experiment.duration_s)
            if duration > LONGEST * self.step_s:
                condition = f"must be at most {LONGEST:g} steps of step_s = {self.step_s:g}"
                raise _conflict(duration, condition, ("experiments", name, "duration_s"), ("step_s",))
        return self


def merged(base: Mapping[str, Any], override: Mapping[str, Any]) -> dict[str, Any]:
    """Return base with the override's keys put in, section by section."""
    result = dict(base)
    for key, value in override.items():
        inner = result.get(key)
        both = isinstance(value, Mapping) and isinstance(inner, Mapping)
        result[key] = merged(inner, value) if both else value  # type: ignore[arg-type]
    return result


SCHEMA = Configuration.model_json_schema()
_BOUNDS = (
    ("greater than", "gt", "exclusiveMinimum"),
    ("at least", "ge", "minimum"),
    ("less than", "lt", "exclusiveMaximum"),
    ("at most", "le", "maximum"),
)


def resolved(node: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return a node of the schema, or the section that it refers to."""
    return SCHEMA["$defs"][node["$ref"].rsplit("/", 1)[1]] if "$ref" in node else node


def named_sections(node: Mapping[str, Any]) -> Mapping[str, Any] | None:
    """Return the schema of a mapping's values where its keys are names that the user gives, else None."""
    return next(iter(node.get("patternProperties", {}).values()), node.get("additionalProperties") or None)


def allowed(node: Mapping[str, Any]) -> str:
    """Say in words what a field may hold, from its schema."""
    node = resolved(node)
    if "anyOf" in node:
        return " or ".join(allowed(option) for option in node["anyOf"] if option.get("type") != "null")
    if "const" in node:
        return node["const"]
    if "enum" in node:
        return " or ".join(node["enum"])
    if node["type"] == "array":
        return f"a list{' (not empty)' if node.get('minItems') else ''}, each {allowed(node['items'])}"
    kind = {"number": "a number", "integer": "a whole number", "string": "text", "object": "a section"}
    limits = [f"{words} {node[key]:.10g}" for words, *keys in _BOUNDS for key in keys if key in node]
    pattern = f" matching `{node['pattern']}`" if "pattern" in node else ""
    return f"{kind[node['type']]} {' and '.join(limits)}".rstrip() + pattern


def _schema_at(location: tuple[Any, ...]) -> tuple[tuple[Any, ...], Mapping[str, Any]]:
    """Return path and schema of the field at an error's location; of the section for an unknown key."""
    node: Mapping[str, Any] = SCHEMA
    path: list[Any] = []
    for key in location:
        if "anyOf" in node or key == "[key]":  # the rest names branches of a union, not fields
            break
        path.append(key)
        inner = node.get("properties", {}).get(key) or named_sections(node) or node.get("items")
        if inner is None:
            break
        node = resolved(inner)
    return tuple(path), node


def _sets(content: Mapping[str, Any], path: tuple[Any, ...]) -> bool:
    """Whether a source sets the field at `path`, or the list that holds it."""
    node: Any = content
    for key in path:
        if isinstance(node, list):
            return True
        if not isinstance(node, Mapping) or key not in node:
            return False
        node = node[key]
    return True


def _sentence(error: Any, sources: Sequence[tuple[str, Mapping[str, Any]]]) -> str:
    """One line for a validation error: source, field, value, what is allowed."""
    path, node = _schema_at(error["loc"])
    value, text = error["input"], f"must be {allowed(node)}"
    paths = [path]
    if error["type"] == "conflict":
        value, text = error["ctx"]["value"], error["ctx"]["condition"]
        paths = [path + field for field in error["ctx"]["fields"]]
        if isinstance(value, float):
            text += f" and be {allowed(_schema_at(paths[0])[1])}"
    elif error["type"] in ("extra_forbidden", "invalid_key"):
        text = f"unknown key; config/README.md lists the known ones: {', '.join(node['properties'])}"
    elif error["loc"][-1:] == ("[key]",):
        _, parent = _schema_at(error["loc"][:-2])
        text = " ".join(
            ["the name must be text", *(f"matching `{p}`" for p in parent.get("patternProperties", ()))]
        )
    field = ".".join(printable(k) if isinstance(k, str) else shown(k) for k in paths[0])
    if error["type"] == "missing":
        name = next((name for name, content in sources if _sets(content, path[:-1])), "configuration")
        return f"{name}: {field}: missing; {text}"
    setters = [name for name, content in sources if any(_sets(content, path) for path in paths)]
    return f"{setters[-1] if setters else 'configuration'}: {field} = {shown(value)}: {text}"


def validated(content: Mapping[str, Any], sources: Sequence[tuple[str, Mapping[str, Any]]]) -> Configuration:
    """Validate a configuration.

    Parameters
    ----------
    content : mapping
        The merged configuration.
    sources : sequence of (name, content)
        Where it came from, later ones overriding earlier ones; for the error message only.

    Raises
    ------
    ConfigurationError
        With one line that names source, field, value and what is allowed.
    """
    try:
        return Configuration.model_validate(content)
    except ValidationError as error:
        # A misspelt key is a missing one too: the line is about what was written.
        first = min(error.errors(include_url=False), key=lambda e: e["type"] != "extra_forbidden")
        raise ConfigurationError(" ".join(_sentence(first, sources).split())) from None


def load(*files: Path | str) -> Configuration:
    """Read and validate a configuration from files, later ones overriding earlier ones."""
    sources = [(printable(str(file), 300), read_yaml(Path(file))) for file in files]
    content: dict[str, Any] = {}
    for _, part in sources:
        content = merged(content, part)
    return validated(content, sources)


def study(configuration: Configuration) -> Study:
    """Convert a configuration to SI units: the experiments that run and the grid of models."""
    c = configuration
    chosen = list(c.experiments) if c.run.experiments == "all" else c.run.experiments
    digest = hashlib.sha256(json.dumps(c.model_dump(), sort_keys=True).encode()).hexdigest()
    experiments = {name: _experiment(c, name) for name in chosen}
    levels = {name: tuple(values) for name, values in c.levels.items()}
    return Study(c.name, experiments, tuple(c.n), levels, c.lag_s, digest)


def _gas(section: GasSection) -> Gas:
    R, gamma = section.R_J_per_kgK, section.gamma
    sonic = sonic_coefficient(R, gamma) if section.sonic_coefficient == "exact" else section.sonic_coefficient
    critical = critical_ratio(gamma) if section.critical_ratio == "exact" else section.critical_ratio
    return Gas(R, gamma, sonic, critical)


def _experiment(c: Configuration, name: str) -> Experiment:
    e = c.experiments[name]
    s = c.cylinders[e.cylinder]
    gas = _gas(c.gas)
    P_s, P_atm = c.supply.P_s_Pa, c.supply.P_atm_Pa
    if c.supply.P_0_per_P_s == "half-bridge":
        P_0 = equilibrium_pressure(P_s, P_atm, gas)
    else:
        P_0 = c.supply.P_0_per_P_s * P_s
    conditions = Conditions(P_s, P_atm, c.supply.T_in_K, c.supply.T_amb_K, P_0, c.supply.T_amb_K)
    bore, stroke = s.bore_mm * 1e-3, s.stroke_mm * 1e-3
    area = pi * bore**2 / 4  # ASSUME: no rod, both areas pi phi^2/4 (Table 2's V_d and A_q say so)
    cylinder = Cylinder(
        bore, stroke, area, area, s.dead_volume_m3, s.mass_kg, s.friction_Ns_per_m, -stroke / 2, stroke / 2
    )
    plant = Plant(gas, Valve(s.k_x_k_u_m2_per_V, s.u_max_V), conditions, cylinder, e.k_0_W_per_K)
    closed = e.loop == "closed"
    drive = Drive(closed, s.closed_loop.k_p_V_per_m, s.open_loop.reverse_at * stroke / 2)
    amplitude = s.closed_loop.variance_m2**0.5 if closed else s.open_loop.amplitude_V
    excitation = Excitation(s.seed, amplitude, max(1, round(s.sample_time_s / c.step_s)))
    push = Push(s.settling.force_N, s.settling.stop_mm * 1e-3, c.stationary_tolerance)
    duration = min(e.duration_s, c.run.duration_limit_s or e.duration_s)
    return Experiment(
        name,
        e.cylinder,
        plant,
        drive,
        excitation,
        push,
        c.step_s,
        max(1, round(duration / c.step_s)),
        e.pressure_stride,
    )

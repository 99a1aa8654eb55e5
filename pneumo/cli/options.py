"""Arguments and options that several commands of ``pneumo`` take, and the configuration that they name."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from typer import Argument, Option

if TYPE_CHECKING:
    from pneumo.configuration.schema import Configuration

PAPER = Path("config/paper.yaml")  # in a checkout
MODEL = Argument(help="one of `pneumo models`, or full for the full-order model")
MODELS_OF_FIT = Option("--model", help="one of `pneumo models`, or full; may be repeated [all]")
Config = Annotated[
    list[Path] | None,
    Option(
        help="configuration; may be repeated, later files override earlier ones [in a checkout: the paper's]"
    ),
]
Index = Annotated[float | None, Option("--n", help="polytropic index n, for models that have one")]
Cylinder = Annotated[
    str | None, Option("--cylinder", help="name in the configuration [the only cylinder there]")
]
Conductance = Annotated[
    float | None,
    Option(
        "--k0", help="thermal conductance of each chamber's wall, W/K [the cylinder's, if it has only one]"
    ),
]
Trust = Annotated[bool, Option("--trust", help="accept numbers that describe no actuator together")]
Threads = Annotated[int, Option(min=1, help="parallel runs; the result does not depend on it")]


def output_to(what: str) -> Any:
    """Command-line option -o for the file or folder to write; `what` is its help text."""
    return Option("--output", "-o", help=what)


def check_index(model: str, n: float | None) -> None:
    """Raise `InputError` if a polytropic index is given for a model without one."""
    from pneumo.errors import InputError
    from pneumo.physics.models import MODELS

    if n is not None and (model == "full" or (model in MODELS and not MODELS[model].has_n)):
        raise InputError(f"--n = {n:g}: {model} has no polytropic index; leave it out")


def read_configuration(files: list[Path] | None, trust: bool = False) -> "Configuration":
    """Merged and validated configuration of files; without files, that of the paper.

    `InputError` without files in an installed package, which has no configuration of the paper;
    `ConfigurationError` if the configuration is wrong or, unless `trust` is true, implausible.
    """
    from pneumo.configuration.parameters import read_sources
    from pneumo.configuration.plausible_cylinders import checked
    from pneumo.errors import InputError

    if not files and not PAPER.exists():
        raise InputError("--config: missing; name a configuration, `pneumo init` writes one")
    return checked(read_sources(*(files or [PAPER])), trust=trust)

"""pneumo: reduced-order thermodynamic models of servo-pneumatic actuator chambers, reproduced and judged."""

# True to type checkers. `typing` takes long to import; Ctrl-C would meet a traceback there, before `main`.
TYPE_CHECKING = False

if TYPE_CHECKING:
    from pneumo.catalogue import default_conductance as default_conductance
    from pneumo.catalogue import measured_conductances as measured_conductances
    from pneumo.configuration.experiment import Plant as Plant
    from pneumo.configuration.parameters import load as load
    from pneumo.equations.chamber_rate import chamber_rate as chamber_rate
    from pneumo.errors import ConfigurationError as ConfigurationError
    from pneumo.errors import InputError as InputError
    from pneumo.errors import PneumoError as PneumoError
    from pneumo.errors import ResultError as ResultError
    from pneumo.errors import RunError as RunError
    from pneumo.linear.linear_model import Linear as Linear
    from pneumo.linear.linear_model import linearise as linearise
    from pneumo.linear.observer import Estimate as Estimate
    from pneumo.linear.observer import ekf as ekf
    from pneumo.notebook.model_study import ModelStudy as ModelStudy
    from pneumo.notebook.model_study import study as study
    from pneumo.notebook.record_fit import RecordFit as RecordFit
    from pneumo.notebook.record_fit import fit as fit
    from pneumo.notebook.record_fit import read_record as read_record
    from pneumo.physics.cylinder import Cylinder as Cylinder
    from pneumo.physics.models import MODELS as MODELS
    from pneumo.physics.models import Model as Model
    from pneumo.physics.valve import Conditions as Conditions
    from pneumo.physics.valve import Gas as Gas
    from pneumo.physics.valve import Valve as Valve
    from pneumo.runs import Prediction as Prediction
    from pneumo.runs import Run as Run
    from pneumo.runs import State as State
    from pneumo.runs import recorded as recorded
    from pneumo.runs import replay as replay
    from pneumo.runs import simulate as simulate
    from pneumo.selection.plants import load_plant as load_plant
    from pneumo.selection.plants import plant as plant
    from pneumo.stepping import Sensors as Sensors
    from pneumo.stepping import Simulation as Simulation
    from pneumo.storage.files import open_grid as open_grid

    __version__: str

# The same names, whose modules are loaded on first use: `import pneumo` imports no numerics.
_NAMES = {
    "catalogue": "default_conductance measured_conductances",
    "configuration.experiment": "Plant",
    "configuration.parameters": "load",
    "equations.chamber_rate": "chamber_rate",
    "errors": "ConfigurationError InputError PneumoError ResultError RunError",
    "linear.linear_model": "Linear linearise",
    "linear.observer": "Estimate ekf",
    "notebook.model_study": "ModelStudy study",
    "notebook.record_fit": "RecordFit fit read_record",
    "physics.cylinder": "Cylinder",
    "physics.models": "MODELS Model",
    "physics.valve": "Conditions Gas Valve",
    "runs": "Prediction Run State recorded replay simulate",
    "selection.plants": "load_plant plant",
    "stepping": "Sensors Simulation",
    "storage.files": "open_grid",
}
_MODULE_OF = {name: f"pneumo.{module}" for module, names in _NAMES.items() for name in names.split()}
__all__ = ["__version__", *sorted(_MODULE_OF)]  # pyright: ignore[reportUnsupportedDunderAll]


def __dir__() -> list[str]:
    """Public names, loaded or not."""
    return __all__


def __getattr__(name: str) -> object:
    """Load a public name on first use."""
    if name == "__version__":
        from importlib.metadata import version

        return version("pneumo")
    if name not in _MODULE_OF:
        raise AttributeError(f"module 'pneumo' has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(_MODULE_OF[name]), name)

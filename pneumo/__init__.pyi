"""Public names, for type checkers; `__init__.py` reads here which module each one is in."""

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
from pneumo.notebook import ModelStudy as ModelStudy
from pneumo.notebook import RecordFit as RecordFit
from pneumo.notebook import RigFit as RigFit
from pneumo.notebook import fit as fit
from pneumo.notebook import read_record as read_record
from pneumo.notebook import rig as rig
from pneumo.notebook import study as study
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
from pneumo.selection.plants import plant as plant
from pneumo.storage.files import open_grid as open_grid

__version__: str
__all__: list[str]

def __dir__() -> list[str]: ...

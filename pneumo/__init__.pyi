# Public names: type checkers read this file, and `__init__.py` finds here in which module each name is.

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

"""Hypothesis strategies for cylinders, gases and signals, and checks of chamber models; needs Hypothesis."""

try:
    import hypothesis as hypothesis
except ImportError:
    raise ImportError("pneumo.testing needs Hypothesis: install pneumo[testing]") from None

from pneumo.testing.chamber_checks import CheckReport as CheckReport
from pneumo.testing.chamber_checks import ModelCheck as ModelCheck
from pneumo.testing.chamber_checks import check_model as check_model
from pneumo.testing.chamber_checks import model_checks as model_checks
from pneumo.testing.fmu_checks import check_fmu as check_fmu
from pneumo.testing.strategies import commands as commands
from pneumo.testing.strategies import conditions as conditions
from pneumo.testing.strategies import conductances as conductances
from pneumo.testing.strategies import cylinders as cylinders
from pneumo.testing.strategies import gammas as gammas
from pneumo.testing.strategies import gas_constants as gas_constants
from pneumo.testing.strategies import gases as gases
from pneumo.testing.strategies import plants as plants
from pneumo.testing.strategies import polytropic_indices as polytropic_indices
from pneumo.testing.strategies import positions as positions
from pneumo.testing.strategies import pressures as pressures
from pneumo.testing.strategies import temperatures as temperatures
from pneumo.testing.strategies import velocities as velocities
from pneumo.testing.strategies import voltages as voltages

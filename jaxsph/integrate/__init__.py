"""Integration in time: the model protocol, the loop, its steppers and its faults."""

from .faults import Fault as Fault
from .faults import FaultCode as FaultCode
from .faults import SimulationError as SimulationError
from .faults import explanation as explanation
from .loop import integrate as integrate
from .model import Model as Model
from .runge_kutta import RK4 as RK4
from .runge_kutta import rk4_step as rk4_step
from .stepper import Stepper as Stepper
from .stepping import AutomaticSteps as AutomaticSteps
from .stepping import FixedSteps as FixedSteps
from .stepping import Stepping as Stepping

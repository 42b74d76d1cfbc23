"""The functions that derivatives are taken of: functions of one state without contact."""

from . import dynamics, kinematics
from .function import signed

FUNCTIONS = signed(dynamics.ASSEMBLIES | kinematics.ASSEMBLIES)

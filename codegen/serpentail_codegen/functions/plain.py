"""The functions that derivatives are taken of: all of one state that no contact acts on."""

from . import dynamics, kinematics
from .function import signed

FUNCTIONS = signed(dynamics.ASSEMBLIES | kinematics.ASSEMBLIES)

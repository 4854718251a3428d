"""Electrothermal MEMS mirrors on their driver board, from Python.

Numbers are in SI units throughout: metres, volts, amperes, ohms, kelvins, seconds.
"""

from .files import Model, Parameter, fit, session
from .instrument import Instrument, InstrumentError
from .lab import Comparison, Diagnosis, ExperimentError, RankedEffect, compare, diagnose
from .mirror import Calibration, Mirror, Pose, Room, Trace, Uncertainty
from .processes import EmulatedBoard, Server, ToolError, run_tool

__all__ = [
    "Calibration",
    "Comparison",
    "Diagnosis",
    "EmulatedBoard",
    "ExperimentError",
    "Instrument",
    "InstrumentError",
    "Mirror",
    "Model",
    "Parameter",
    "Pose",
    "RankedEffect",
    "Room",
    "Server",
    "ToolError",
    "Trace",
    "Uncertainty",
    "compare",
    "diagnose",
    "fit",
    "run_tool",
    "session",
]

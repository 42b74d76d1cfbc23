"""Design of experiments: how certain a motion would make parameters, before it is recorded."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..checks import finite_array, number, refusal
from ..errors import IdentificationError
from ..model.model import Model
from ..motion.trajectory import Trajectory
from .certainty import Combination, certainty
from .identify import check_model
from .placement import Marker, placements
from .search import first_iterate
from .solve import Fit, triangle
from .solve import Point
from .start import on_mesh
from .torques import known_torques
from .tracks import MarkerTracks
from .trial import Iterate, linearised, solved, trial_of
from .unknowns import unknowns


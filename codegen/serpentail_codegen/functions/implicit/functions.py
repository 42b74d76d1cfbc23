"""The functions of implicit methods' linear systems (1 - w J) k = r: factoring, and solving."""

from .factor import assemble_factor
from .solve import assemble_solve

ASSEMBLIES = {"implicit_factor": assemble_factor, "implicit_solve": assemble_solve}

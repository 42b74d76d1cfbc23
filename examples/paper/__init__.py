"""The paper's own optimal control (Sect. 3) as one plain program, and what its torques truly do."""

"""Model-predictive control of planned flights, computed in C that also runs on microcontrollers."""

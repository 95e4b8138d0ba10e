"""What went wrong with my simulator? Calibration of simulators and discovery of the physics that they lack."""

__version__ = "0.1.0"

"""Arms of hinges: Newton-Euler dynamics of their own, drives, sensors, and laws from the literature of robot joints."""

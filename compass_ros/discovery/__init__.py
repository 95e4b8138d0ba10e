"""What is left after the best parameters: where, which physics, how much better with it."""

from compass_ros.discovery.discover import discover
from compass_ros.discovery.finding import Discovery, data_bad, fit_failed, not_evaluated

__all__ = ["Discovery", "data_bad", "discover", "fit_failed", "not_evaluated"]

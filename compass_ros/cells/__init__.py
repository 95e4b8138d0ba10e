"""Robot cells: what can be tuned, what is done, what is seen."""

from compass_ros.cells.cell import Cell
from compass_ros.cells.loading import load

__all__ = ["Cell", "load"]

"""Batched rollouts of a cell, and physics that can be added to it."""

from compass_ros.simulation.simulator import Simulator

__all__ = ["Simulator"]

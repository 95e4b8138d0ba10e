"""The agent retrained in the calibrated simulator: which shot brings a body to a goal, and how surely."""

from compass_ros.policy.agent import Agent, train
from compass_ros.policy.shots import Goal, Judged, Shots

__all__ = ["Agent", "Goal", "Judged", "Shots", "train"]

"""The agent retrained in the calibrated simulator: which shot brings a body to a goal, and how surely."""

from compass_ros.policy.agent import ROLLOUTS, Agent, train
from compass_ros.policy.belief import Belief, Case, one
from compass_ros.policy.shots import Goal, Judged, Shots

__all__ = ["ROLLOUTS", "Agent", "Belief", "Case", "Goal", "Judged", "Shots", "one", "train"]

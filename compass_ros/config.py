"""One validated configuration; YAML files, the command line and ROS parameters all fill the same frozen dataclasses."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Literal

import yaml
from pydantic import ConfigDict, Field, TypeAdapter, ValidationError
from pydantic.dataclasses import dataclass

from compass_ros.errors import ConfigError, nearest, shown
from compass_ros.plain_yaml import LARGEST, plain_yaml

Parameters = Literal["cell", "auto"]
"""What is tuned: the parameters that the cell lists, or every other tunable field of its scene too."""
_strict = ConfigDict(extra="forbid")


@dataclass(frozen=True, config=_strict)
class CompassConfig:
    """Hyperparameters of the COMPASS method; defaults from the paper's table of hyperparameters."""

    n_round: int = Field(default=10, ge=1, description="iterations of Algorithm 1")
    n_cmd_action: int = Field(default=10, ge=1, description="real rollouts N used in an iteration")
    n_sim: int = Field(default=64, ge=2, description="simulated rollouts M for each real one")
    n_epochs: int = Field(default=4000, ge=1, description="passes over the data of one iteration")
    batch_size: int = Field(default=64, ge=2, description="rollouts of one gradient step")
    learning_rate: float = Field(default=1e-3, gt=0, description="of Adam")
    emb_dim: int = Field(default=32, ge=1, description="width of the encoder of one parameter")
    hidden_dim: tuple[int, ...] = Field(default=(256, 256), description="widths of the decoder's layers")
    causal_dim: int = Field(default=32, ge=1, description="features d_z that pass through the graph")
    sparse_weight: float = Field(default=0.003, ge=0, description="lambda of loss (2)")
    sw_discount: float = Field(default=0.5, gt=0, le=1, description="factor on lambda from one iteration to the next")
    threshold: float = Field(default=0.5, gt=0, lt=1, description="psi at or above this is an edge")
    stop_gap_m: float = Field(
        default=0.0, ge=0, description="zeta: stop when the mean trajectory difference is at or below [m]"
    )
    graph_learning_rate: float = Field(
        default=1e-2,
        gt=0,
        description="learning rate of psi; the paper's 0.001 needs all its epochs where psi is still near one",
    )
    temperature: float = Field(default=1.0, gt=0, description="temperature of the Gumbel-Softmax")
    norm_p: float = Field(default=1.0, gt=0, description="p of the norm in loss (2); the paper names none")
    psi_margin: float = Field(
        default=1e-3, gt=0, lt=0.5, description="psi is sampled within [margin, 1 - margin]; keeps logits finite"
    )
    patience_epochs: int = Field(
        default=100,
        ge=0,
        description="stop training when the loss of this many epochs fell by less than `plateau`; 0: all epochs",
    )
    plateau: float = Field(
        default=0.01, ge=0, lt=1, description="least relative fall of loss (2) from one window to the next"
    )
    update_rate: float = Field(
        default=0.05, gt=0, description="eta of update (3), in half-widths per unit of normalised gradient"
    )
    update_steps: int = Field(default=500, ge=1, description="most steps of update (3) in an iteration")
    update_tolerance: float = Field(
        default=1e-4, ge=0, description="update (3) has converged when a step is shorter, in half-widths"
    )


@dataclass(frozen=True, config=_strict)
class CalibrationConfig:
    """What `compass calibrate` does; everything but the recordings and the cell."""

    method: str = Field(default="default", description="default, compass, or a rival")
    parameters: Parameters = Field(
        default="cell", description="what is tuned: the cell's list, or auto: every tunable field of the scene too"
    )
    seed: int = Field(default=0, ge=0, description="of the held-out episodes and of all random numbers")
    rollouts: int = Field(
        default=0, ge=0, description="most simulated rollouts of the method; 0 = what it takes by default"
    )
    discover: bool = Field(default=True, description="look for missing physics after the calibration")
    false_alarm: float = Field(
        default=0.01,
        ge=1e-4,
        lt=0.5,
        description="probability of a verdict other than `none` where nothing is missing; at least 0.0001, for the "
        "threshold is simulated with two recordings beyond it",
    )
    held_out_share: float = Field(default=0.25, ge=0, lt=1, description="share of the episodes that is never fitted")
    episodes: int = Field(
        default=100, ge=1, description="most episodes that are used; of more, so many are taken evenly over their order"
    )
    windows: int = Field(
        default=0,
        ge=0,
        description="most windows of long recordings that are fitted, those that are most unlike each other; 0: 100 s "
        "of them, 10 to 40",
    )
    threads: int = Field(default=0, ge=0, description="threads for rollouts; 0: all cores. Results do not depend on it")
    compass: CompassConfig = Field(default_factory=CompassConfig, description="of the method `compass`, fields below")


def read_yaml(path: Path) -> Mapping[str, object]:
    """The mapping in a YAML file, as plain data. Raises ConfigError with one line."""
    try:
        with path.open(encoding="utf-8") as file:
            content = plain_yaml(file.read(LARGEST + 1))
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read: {error.strerror}") from error
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path}: not valid YAML: {' '.join(str(error).split())[:300]}") from error
    if not isinstance(content, dict):
        raise ConfigError(f"{path}: expected a mapping at the top, found {type(content).__name__}")
    return content


def calibration_config(content: Mapping[str, object], where: str = "configuration") -> CalibrationConfig:
    """Validate a mapping. Raises ConfigError naming the field, what was expected and what was found."""
    try:
        return TypeAdapter(CalibrationConfig).validate_python(dict(content))
    except ValidationError as error:
        first = error.errors()[0]
        name = ".".join(str(part) for part in first["loc"])
        known = [f.name for f in (*fields(CalibrationConfig), *fields(CompassConfig))]
        hint = nearest(name.rsplit(".", 1)[-1], known) if first["type"] == "unexpected_keyword_argument" else ""
        raise ConfigError(f"{where}: {name}: {first['msg']}, found {shown(first['input'])}{hint}") from error

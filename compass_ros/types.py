"""Frozen data that cross the steps. Arrays are read-only by convention; nobody writes into one that it was given.

Units are SI. Frame `table`: origin at the centre of the table's surface, x along its length towards the goal, y to the
left of x, z up. Time is integer nanoseconds of the sensor's clock. Quaternions are (w, x, y, z).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

Unit = Literal["m", "rad", "rad and mm"]
"""Of an error over all that is tracked; its thousandth is shown. The last: angles and places in one number."""
Quantity = Literal[
    "xy",
    "xyz",
    "pose",
    "joint",
    "joint_position",
    "joint_velocity",
    "joint_effort",
    "position",
    "scalar",
    "twist",
    "wrench",
    "gyro",
    "accelerometer",
]
"""What one row of a track holds: planar position [m], position [m], position [m] + quaternion, joint position [rad or
m]; joint positions [rad or m], velocities [rad/s or m/s] or efforts [N m or N] of several joints; position [m]; numbers
without a meaning of their own; linear and angular velocity [m/s, rad/s]; force and torque [N, N m]; angular velocity
[rad/s]; acceleration [m/s^2]."""

QUANTITY_SIZE: Mapping[Quantity, int] = {
    "xy": 2,
    "xyz": 3,
    "pose": 7,
    "joint": 1,
    "joint_position": 1,
    "joint_velocity": 1,
    "joint_effort": 1,
    "position": 3,
    "scalar": 1,
    "twist": 6,
    "wrench": 6,
    "gyro": 3,
    "accelerometer": 3,
}
"""Numbers in a row; of what is asked of several joints (or of several scalars): for each of them."""

NUMBERS: Mapping[Quantity, tuple[str, ...]] = {
    "xy": ("x", "y"),
    "xyz": ("x", "y", "z"),
    "position": ("x", "y", "z"),
    "pose": ("x", "y", "z", "qw", "qx", "qy", "qz"),
    "twist": ("vx", "vy", "vz", "wx", "wy", "wz"),
    "wrench": ("fx", "fy", "fz", "tx", "ty", "tz"),
    "gyro": ("wx", "wy", "wz"),
    "accelerometer": ("ax", "ay", "az"),
}
"""What the numbers of a row are called, where the quantity itself says it."""

NAMES_SAID = 4
"""Parameters of a group that a sentence names; the result has all."""
WRONG = 3.0
"""Error bars from which a parameter has moved: of 64 right ones, one in six calibrations shows one by chance."""

Channel = Literal["dynamics", "contact", "actuation", "sensing"]
Phase = Literal["start", "free", "contact", "rest", "all", "strike", "wall_contact", "object_contact"]
"""start: the command is given; free: something moves and touches nothing; contact; rest. The last three are a table's
words, and those of the first version of result.json."""
GENERAL: Mapping[str, Phase] = {"strike": "start", "wall_contact": "contact", "object_contact": "contact"}
"""Words that a result has for a table's."""
SiteWord = Literal["joint", "body", "geom_pair", "body_pair", "actuator", "signal", "field"]
"""A geom pair may be all contacts of a scene, or those of one wall. A field: a number of the scene."""
Verdict = Literal["none", "named", "ambiguous", "unknown", "fit_failed", "data_bad", "not_evaluated"]


@dataclass(frozen=True)
class Parameter:
    """One tunable number of the simulator, called `object@param_type@param` as in the paper."""

    name: str
    default: float
    low: float
    high: float
    unit: str
    half_width: float
    """Half-width of the uniform randomisation around the current value, in `unit` (delta_r of Algorithm 2)."""
    description: str = ""


@dataclass(frozen=True)
class ActionField:
    """One number of the shot command."""

    name: str
    unit: str
    low: float
    high: float


@dataclass(frozen=True)
class Track:
    """What a sensor saw of one object, or a time series of several numbers: a signal, or an input that was recorded.

    Frames in which the object was not seen are absent; a number that a message lacked is NaN.
    """

    object: str
    """Name of the object, signal or input."""
    quantity: Quantity
    stamp_ns: Ints
    """(F,) strictly increasing, the sensor's clock."""
    value: Floats
    """(F, D) in the cell's frame; D is QUANTITY_SIZE[quantity], times the joints of a signal of joints."""
    std: Floats | None = None
    """(F,) one standard deviation of the position [m] (joint: [rad]) as the sensor states it; None: not stated."""
    frame: str = ""
    """Frame of the positions as the messages name it; empty: they name none."""


@dataclass(frozen=True)
class Episode:
    """One recorded shot."""

    name: str
    cell: str
    cell_hash: str
    """Hash of the cell's configuration at recording time; empty when the bag does not say (foreign bags)."""
    action: Mapping[str, float]
    """The shot command by name of its fields, SI units; empty for a passive recording."""
    start_ns: int
    """When the command was given, in the clock of the stamps. Simulated time 0."""
    tracks: tuple[Track, ...]
    initial_state: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    """Measured first state by object, where the cell does not fix it: position (and velocity) as the cell defines
    them."""
    source: str = ""
    """Path of the bag."""
    others: tuple[Track, ...] = ()
    """The same objects seen in other frames than those of `tracks`: kept apart, and not used."""
    remarks: tuple[str, ...] = ()
    """What reading left out or chose, one sentence each."""
    inputs: tuple[Track, ...] = ()
    """What drove the robot, as recorded: one series for each input of the cell."""
    initial_std: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    """One standard deviation of each number of `initial_state`, where it was estimated from the recording."""
    recording: str = ""
    """Name of the recording that this is a window of; empty: the episode is a recording of its own."""

    def track(self, name: str) -> Track:
        for track in self.tracks:
            if track.object == name:
                return track
        raise KeyError(f"episode {self.name} has no track of '{name}'; it has {[t.object for t in self.tracks]}")


@dataclass(frozen=True)
class LeftOut:
    """A recording that could not be used with others."""

    bag: str
    """Its path, as it was named."""
    reason: str

    def __str__(self) -> str:
        return f"{self.bag} was left out: {self.reason}"


@dataclass(frozen=True)
class Progress:
    """One step of a long computation, handed to a callback."""

    stage: str
    """What runs now, in words: 'calibrate', 'screen effects', ..."""
    iteration: int
    done: float
    """Share of the whole, 0 to 1."""
    gap: float
    """Mean trajectory difference now [m]; NaN where it is not defined."""
    sparsity: float
    """Share of the graph's entries under the threshold; NaN where there is no graph."""


class Report(Protocol):
    """Takes progress; returns False to ask for a stop (the computation then returns what it has, marked cancelled)."""

    def __call__(self, progress: Progress) -> bool: ...


def silent(progress: Progress) -> bool:
    """A `Report` that says nothing and never stops."""
    return True


Differences = Callable[[Floats, Ints], Floats]
"""(B, P) parameter values, (B,) indices of episodes -> (B, K) trajectory differences, summed over time [m]."""


@dataclass(frozen=True)
class Graph:
    """The causal graph: probability of an edge from each parameter to each factor's trajectory difference."""

    parameters: tuple[str, ...]
    factors: tuple[str, ...]
    psi: Floats
    """(P, K) in [0, 1]."""
    threshold: float

    @property
    def sparsity(self) -> float:
        """Share of entries under the threshold."""
        return float(np.mean(self.psi < self.threshold))

    def active(self) -> Bools:
        """(P,) whether a parameter has an edge at or above the threshold."""
        return np.asarray((self.psi >= self.threshold).any(axis=1))


@dataclass(frozen=True)
class Together:
    """Parameters of which the recordings tell a combination, and none alone."""

    parameters: tuple[str, ...]
    ratios: bool
    """All may be larger by one factor: only their ratios show."""

    @property
    def sentence(self) -> str:
        """`a : b : c show only as ratios`, without a full stop; of many the first ones."""
        if self.ratios and len(self.parameters) <= NAMES_SAID:
            return f"{' : '.join(self.parameters)} show only as ratios"
        said = self.parameters[: NAMES_SAID if len(self.parameters) > NAMES_SAID else -1]
        rest = self.parameters[len(said) :]
        last = rest[0] if len(rest) == 1 else f"{len(rest)} more"
        return f"{', '.join(said)} and {last} show only {'as ratios' if self.ratios else 'together'}"


@dataclass(frozen=True)
class Told:
    """What recordings tell of parameters, by name; each is in one of the four, or in several groups."""

    alone: tuple[str, ...]
    """Pinned down, whatever is thought of the others."""
    together: tuple[Together, ...]
    weakly: tuple[str, ...]
    """Narrower than before only by what is known of others, or by little."""
    not_at_all: tuple[str, ...]


@dataclass(frozen=True)
class Iteration:
    """State of a calibration after one iteration, for figures."""

    values: Floats
    """(P,) parameter values."""
    difference: Floats
    """(K,) mean trajectory difference on the fitted episodes before this iteration's update [m]."""
    psi: Floats
    """(P, K); empty (0, 0) for methods without a graph."""
    rollouts: int
    """Rollouts spent so far."""


@dataclass(frozen=True)
class Estimate:
    """What a calibration method returns, ours or a rival's."""

    method: str
    values: Floats
    """(P,) in the order of the parameters it was given."""
    std: Floats
    """(P,) one standard deviation; NaN where the method gives none."""
    identifiable: Bools
    """(P,) False where the recordings cannot tell this parameter from others (or from nothing)."""
    graph: Graph | None
    trace: tuple[Iteration, ...]
    rollouts: int
    converged: bool
    stop_reason: str
    """One sentence: why it stopped."""
    together: tuple[Together, ...] = ()
    draws: Floats | None = None
    """(N, P) of the posterior, where the method has one."""
    note: str = ""
    """What else a user should know of these values; empty where nothing."""


@dataclass(frozen=True)
class SignalGap:
    """The same of one signal, in its own unit."""

    rms: float
    unit: str
    floor: float = math.nan
    """What the noise alone would leave."""
    parts: Mapping[str, float] = field(default_factory=dict)
    """rms by joint, where it is of several."""


@dataclass(frozen=True)
class Gap:
    """Difference between simulated and recorded trajectories for one model on one set of episodes."""

    d: Mapping[str, float]
    """Mean trajectory difference by factor: sum over the cell's control steps of the 2-norm [m]."""
    rmse_m: float
    """Root mean square distance over all frames and objects [m]."""
    signals: Mapping[str, SignalGap] = field(default_factory=dict)


@dataclass(frozen=True)
class ParameterRow:
    name: str
    unit: str
    default: float
    value: float
    std: float
    bounds: tuple[float, float]
    active: bool
    """It matters: it has an edge in the causal graph."""
    identifiable: bool
    without_laws: float = math.nan
    """Value of the simulator with calibrated parameters alone, where `value` is the one beside laws; else NaN."""

    @property
    def calibrated(self) -> float:
        """Value of the simulator with calibrated parameters alone."""
        return self.value if math.isnan(self.without_laws) else self.without_laws

    @property
    def error_bars(self) -> float:
        """How many of its standard deviations it moved; NaN for a method that gives none."""
        return abs(self.value - self.default) / self.std if self.std > 0 else math.nan

    @property
    def wrong(self) -> bool:
        """Whether its default was wrong: it moved by more than WRONG error bars."""
        return self.error_bars > WRONG


@dataclass(frozen=True)
class EffectParameter:
    value: float
    std: float
    unit: str


@dataclass(frozen=True)
class Evidence:
    held_out_gain: float
    """Share of the excess held-out error (above the noise floor) that the effect removes; 1 = all."""
    log_evidence: float
    """Log evidence over the model without the effect, corrected for correlated noise."""
    false_alarm_p: float
    """Probability of such evidence where nothing is missing, from simulation of the fitted null model."""


@dataclass(frozen=True)
class EffectFinding:
    name: str
    parameters: Mapping[str, EffectParameter]
    evidence: Evidence
    equivalents: tuple[str, ...]
    """Effects that these recordings cannot tell from this one."""


@dataclass(frozen=True)
class Region:
    """A disc in the plane x, y."""

    centre_m: tuple[float, float]
    radius_m: float
    frame: str = "world"
    """Of the scene: MuJoCo's world, on an air-hockey cell the table's."""


DependsOn = Literal["place", "velocity", "time"]


@dataclass(frozen=True)
class Interval:
    """A range of what something is a function of."""

    quantity: Literal["angle", "position", "speed"]
    low: float
    high: float
    unit: str


@dataclass(frozen=True)
class Where:
    object: str
    """Name of the object, or 'all'."""
    phase: Phase
    channel: Channel | Literal["all"]
    region: Region | None = None
    time_s: tuple[float, float] | None = None
    """From, to, since the command."""
    interval: Interval | None = None
    """Where along the motion most of it sits; None: everywhere."""
    depends_on: DependsOn | None = None
    """What it is a function of, where that is clear; `time`: of neither place nor velocity."""
    site_kind: SiteWord | None = None
    """None: sites of several kinds, or a result of the first version."""
    site: str = "all"
    """Names with a `+` between them: a joint, a body, two geoms, an actuator, a signal; all: all of them."""


@dataclass(frozen=True)
class ExplainedLaw:
    """One law of an explanation."""

    name: str
    sites: tuple[str, ...]
    quantities: Mapping[str, EffectParameter]


@dataclass(frozen=True)
class HeldOut:
    """rms distance on episodes that were opened after the verdict."""

    before: float
    """Of the calibrated simulator without a law."""
    after: float
    """With the explanation's laws."""
    floor: float
    """What noise alone would leave."""
    unit: Unit

    @property
    def removed(self) -> float:
        """Share of the error above the floor that the laws remove; NaN where there is none."""
        excess = self.before - self.floor
        return (self.before - self.after) / excess if excess > 0 else math.nan


@dataclass(frozen=True)
class Explanation:
    """A set of laws, and how probable it is that it is what the simulator lacks."""

    laws: tuple[ExplainedLaw, ...]
    """Empty: nothing is missing. A law named `unknown`: a discrepancy of no known form."""
    probability: float
    log_evidence: float
    held_out: HeldOut | None = None
    """None for a discrepancy of no known form, which predicts nothing, and where no episode was held out."""
    corrections: tuple[ExplainedLaw, ...] = ()
    """What stands in the simulator for the rest of the form of `laws`: no physics of its own."""


@dataclass(frozen=True)
class Mismatch:
    """The answer to question 3: what is left."""

    verdict: Verdict
    where: Where | None
    effects: tuple[EffectFinding, ...]
    undetectable: tuple[str, ...]
    next_experiment: str
    sentence: str
    explanations: tuple[Explanation, ...] = ()
    """The most probable first; over all that were asked the probabilities sum to one."""
    false_alarm: float = math.nan
    """Probability of a verdict other than `none` where nothing is missing, as it was asked for."""


@dataclass(frozen=True)
class Budget:
    rollouts: int
    simulated_seconds: float
    wall_seconds: float


@dataclass(frozen=True)
class ReplayedTrack:
    """One object of one episode, recorded and simulated, for drawing."""

    object: str
    time_s: Floats
    """(F,) since the command."""
    real: Floats
    """(F, D) as recorded."""
    nominal: Floats
    """(F, D) simulated with the default parameters at the same times."""
    calibrated: Floats
    """(F, D) simulated with the calibrated parameters."""
    with_effects: Floats | None
    """(F, D) simulated with the effects too; None where no effect was fitted."""


@dataclass(frozen=True)
class Replay:
    episode: str
    held_out: bool
    tracks: tuple[ReplayedTrack, ...]


@dataclass(frozen=True)
class Result:
    """Everything that a calibration says; `result.json` after design.md and the report are drawn from it."""

    cell: str
    method: str
    seed: int
    versions: Mapping[str, str]
    budget: Budget
    fit: tuple[str, ...]
    held_out: tuple[str, ...]
    gap: Mapping[Literal["nominal", "calibrated", "with_effects"], Mapping[Literal["fit", "held_out"], Gap]]
    noise_floor_m: float
    parameters: tuple[ParameterRow, ...]
    graph: Graph
    mismatch: Mismatch
    trace: tuple[Iteration, ...]
    replays: tuple[Replay, ...]
    cancelled: bool = False
    warnings: Sequence[str] = ()
    unit: Unit = "m"
    """Of gap and noise floor."""
    cell_file: str = ""
    """YAML of the cell from the folder of the result; empty for a cell of the suite's own."""
    left_out: tuple[LeftOut, ...] = ()
    """Recordings that were named and could not be used."""
    together: tuple[Together, ...] = ()
    """Parameters that are told only together."""
    time_step_s: float | None = None
    """Of the simulation, where it is not the scene's."""
    friction_holds: bool = False
    """Whether dry friction holds a joint that is at rest, where the scene's lets it creep."""

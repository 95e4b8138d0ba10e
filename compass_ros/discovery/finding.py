"""What is said when the verdict is due: named, ambiguous, unknown, nothing or failed, with its evidence."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from compass_ros.calibration.likelihood import Likelihood
from compass_ros.calibration.noise import Noise
from compass_ros.calibration.refine import Refined, with_launches
from compass_ros.calibration.residuals import variances
from compass_ros.cells import Cell
from compass_ros.discovery.choice import Choice
from compass_ros.discovery.floor import EVERYWHERE, UNEXPLAINED, left_over, shown_noise
from compass_ros.discovery.formula import Proposal, propose
from compass_ros.discovery.joint import Joint, from_second_start
from compass_ros.discovery.maps import TableMap, residual_map
from compass_ros.discovery.next_shot import next_experiment
from compass_ros.discovery.null import Null
from compass_ros.discovery.numerics import shift
from compass_ros.discovery.pairs import needs_each
from compass_ros.discovery.scatter import spreads
from compass_ros.discovery.screen import Score, Space
from compass_ros.discovery.unknown import whereabouts
from compass_ros.discovery.unseen import HeldOut
from compass_ros.discovery.words import errors, place, value_of, where_of
from compass_ros.simulation import Simulator
from compass_ros.simulation.replay import rms_distance
from compass_ros.types import EffectFinding, EffectParameter, Evidence, Floats, Mismatch, Verdict


@dataclass(frozen=True)
class Tried:
    """One candidate for the report's ranking."""

    name: str
    channel: str
    log_evidence: float
    held_out_gain: float
    kept: bool
    note: str


@dataclass(frozen=True)
class Discovery:
    """The verdict, and the simulator with the effects inside where some were found."""

    mismatch: Mismatch
    simulator: Simulator | None = None
    values: Floats | None = None
    """(P + Q,) parameters and effects of that simulator."""
    parameters: Floats | None = None
    """(P,) the parameters, fitted together with the effects."""
    std: Floats | None = None
    """(P,) one standard deviation of the parameters."""
    effect_std: Floats | None = None
    """(P + Q,) one standard deviation of `values`."""
    tried: tuple[Tried, ...] = ()
    before: TableMap | None = None
    after: TableMap | None = None
    warnings: Sequence[str] = ()
    untaught: bool = False
    """What leaves nothing of the fitted episodes does not predict the others: they have what no fitted one shows."""
    noise: Noise | None = None
    """With what the fit has shown of it, where that is more than the recordings alone did."""


def not_evaluated(reason: str) -> Discovery:
    """No verdict, said plainly."""
    return Discovery(Mismatch("not_evaluated", None, (), (), "", f"Missing physics was not looked for: {reason}."))


def fit_failed(reason: str) -> Discovery:
    """No verdict, for a fit of the search went wrong."""
    return Discovery(Mismatch("fit_failed", None, (), (), "", f"No verdict on missing physics: {reason}."))


def data_bad(sentence: str) -> Discovery:
    """No verdict, for the recordings are wrong."""
    return Discovery(Mismatch("data_bad", None, (), (), "", sentence))


def held_out_error(cell: Cell, judged: Likelihood, values: Floats) -> float:
    """rms distance on held-out episodes [m or rad], each with the launch that agrees best with it."""
    inputs = judged.inputs + with_launches(judged, values).launch
    predicted = judged.predict(np.tile(values, (len(inputs), 1)), inputs, judged.time_s)
    return rms_distance(cell, judged.difference(predicted, judged.measured))


@dataclass(frozen=True)
class Finding:
    """What is known when the verdict is due."""

    simulator: Simulator
    space: Space
    refined: Refined
    judge: Likelihood
    noise: Noise
    null: Null
    undetectable: tuple[str, ...]
    before: TableMap | None
    seed: int
    warnings: tuple[str, ...]

    def none(self, scores: Sequence[Score], unseen: HeldOut) -> Discovery:
        """No effect stands out: the noise explains everything, or these recordings cannot say what does."""
        noise, unit = self.noise, f"m{self.simulator.unit}"
        if left_over(self._before, self._floor(noise), True) != "none":
            noise = shown_noise(noise, self.space.likelihood, self.space.fit)
        verdict = left_over(self._before, self._floor(noise), unseen.excess > unseen.seen)
        numbers = f"held-out error {1e3 * self._before:.2f} {unit}, noise {1e3 * self._floor(noise):.2f} {unit}"
        tried = tuple(
            Tried(s.candidate.name, s.candidate.attached.effect.channel, s.gain, 0.0, False, "within the noise")
            for s in scores[:8]
        )
        where = EVERYWHERE if verdict == "unknown" else None
        mismatch = Mismatch(verdict, where, (), self.undetectable, "", f"{UNEXPLAINED[verdict]}: {numbers}.")
        return Discovery(mismatch, tried=tried, before=self.before, warnings=self.warnings, noise=noise)

    def failed(self, sentence: str) -> Discovery:
        """Something is left, and it is no evidence of physics."""
        mismatch = Mismatch("fit_failed", None, (), self.undetectable, "", sentence)
        return Discovery(mismatch, before=self.before, warnings=self.warnings)

    def judged(self, choice: Choice, unseen: HeldOut) -> Discovery:
        """Named, ambiguous, unknown or failed."""
        for found in choice.verdicts(unseen):
            joint = from_second_start(found)
            if joint.distinct and needs_each(joint, self.space):
                return self.named(joint, choice, (choice.equal,) if len(joint.added) == 1 else ((), ()))
        return replace(self.unknown(choice, unseen), untaught=choice.complete() or choice.untaught(unseen))

    def named(self, joint: Joint, choice: Choice, equal: tuple[tuple[Joint, ...], ...]) -> Discovery:
        """One or two effects with values, errors and evidence."""
        std = self._std(joint)
        movers = self.simulator.movers()
        findings, at = [], len(self.simulator.cell.parameters)
        for attached, equals in zip(joint.added, equal, strict=True):
            size = len(attached.effect.quantities)
            numbers, errors_of = joint.fit.point.values[at : at + size], std[at : at + size]
            parameters = {
                q.name: EffectParameter(float(v), float(e), q.unit)
                for q, v, e in zip(attached.effect.quantities, numbers, errors_of, strict=True)
            }
            names = tuple(dict.fromkeys(a.effect.name for other in equals for a in other.added))
            findings.append(EffectFinding(attached.effect.name, parameters, self._evidence(joint, choice), names))
            at += size
        at = len(self.simulator.cell.parameters)
        first = joint.fit.point.values[at : at + len(joint.added[0].effect.quantities)]
        where = where_of(joint.added[0], first, movers)
        rivals = [joint, *equal[0]]
        ambiguous = len(rivals) > 1
        following = ""
        lacks = " and ".join(a.effect.sentence for a in joint.added)
        if ambiguous:
            following = next_experiment(self.simulator, self.space.likelihood, rivals, self.seed).sentence
            lacks = "one of these: " + "; ".join(a.effect.sentence for j in rivals for a in j.added)
        values = "; ".join(value_of(f, a) for f, a in zip(findings, joint.added, strict=True))
        sentence = f"{place(where, self._flat)}, the simulator lacks {lacks}; {values}; {self._errors(joint)}."
        verdict: Verdict = "ambiguous" if ambiguous else "named"
        mismatch = Mismatch(verdict, where, tuple(findings), self.undetectable, following, sentence)
        return self._with(joint, mismatch, choice, std)

    def unknown(self, choice: Choice, unseen: HeldOut) -> Discovery:
        """Something is there that no known effect explains; a formula is proposed where one predicts."""
        where, sure = whereabouts(self.space, choice)
        if not sure and not choice.singles:
            return self.failed("No verdict: the fit did not reach the noise floor and no place stands out.")
        proposal: Proposal | None = propose(self.space, self.judge)
        sentence = f"{place(where, self._flat)}, something differs that no known effect explains"
        if choice.singles:
            best = choice.singles[0]
            explained, predicted = 100 * choice.share(best), 100 * np.clip(unseen.share(best), 0, 1)
            sentence += f" (the best, {best.name}, explains {explained:.0f} % of it"
            sentence += f", and {predicted:.0f} % in held-out episodes)"
        sentence += f"; {proposal.sentence}" if proposal else "."
        mismatch = Mismatch("unknown", where, (), self.undetectable, "", sentence)
        if proposal is None:
            return Discovery(mismatch, tried=self._tried(choice, None), before=self.before, warnings=self.warnings)
        return self._with(proposal.joint, mismatch, choice, self._std(proposal.joint))

    def _with(self, joint: Joint, mismatch: Mismatch, choice: Choice, std: Floats) -> Discovery:
        cell = len(self.simulator.cell.parameters)
        after = residual_map(self.space, joint.fit.linear.residual)
        return Discovery(
            mismatch,
            joint.simulator,
            joint.fit.point.values,
            joint.fit.point.values[:cell],
            std[:cell],
            std,
            self._tried(choice, joint),
            self.before,
            after,
            self.warnings,
        )

    def _held_out(self, likelihood: Likelihood, values: Floats) -> float:
        return held_out_error(self.simulator.cell, likelihood.on(self.judge), values)

    def _floor(self, noise: Noise) -> float:
        return rms_distance(self.simulator.cell, noise.rms[None, None])

    @property
    def _flat(self) -> bool:
        """Whether something that is tracked slides on a table."""
        return not self.space.pushes.joints.all()

    @cached_property
    def _before(self) -> float:
        """The same for the simulator without effects."""
        return self._held_out(self.space.likelihood, self.refined.fit.point.values)

    def _errors(self, joint: Joint) -> str:
        after = self._held_out(joint.likelihood, joint.fit.point.values)
        return errors(self._before, after, self._floor(self.noise), self.simulator.unit)

    def _gain(self, joint: Joint) -> float:
        after, floor = self._held_out(joint.likelihood, joint.fit.point.values), self._floor(self.noise)
        return float(np.clip((self._before - after) / max(self._before - floor, 1e-9), -1.0, 1.0))

    def _evidence(self, joint: Joint, choice: Choice) -> Evidence:
        kappa = self.noise.correlation_time
        gained = choice.floor + choice.excess - joint.fit.point.cost
        hessians = joint.log_evidence(kappa) + joint.fit.point.cost / kappa
        plain = Joint(self.simulator, self.space.likelihood, self.space.fit, ())
        without = plain.log_evidence(kappa) + self.space.fit.point.cost / kappa
        return Evidence(self._gain(joint), gained / kappa + hessians - without, self.null.false_alarm_p(gained / kappa))

    def _std(self, joint: Joint) -> Floats:
        """(P + Q,) standard deviations; the prior's where the recordings say nothing.

        An effect has the library's formula, which need not be nature's: what the episodes disagree on counts where it
        is more than the noise. Those of effects also hold what a finite time step does to them; the parameters are
        those of this simulator. That of a scatter is what so few episodes tell of it.
        """
        std = joint.likelihood.prior_std.copy()
        free = joint.fit.free
        of_effects = free >= len(self.simulator.cell.parameters)
        std[free] *= np.sqrt(variances(joint.likelihood, joint.fit) + np.where(of_effects, shift(joint), 0.0) ** 2)
        of_spreads = spreads(joint)
        std[of_spreads] = joint.fit.point.values[of_spreads] / np.sqrt(2 * len(joint.likelihood.inputs))
        return std

    def _tried(self, choice: Choice, chosen: Joint | None) -> tuple[Tried, ...]:
        movers = self.simulator.movers()

        def on(joint: Joint) -> str:
            parts = {o for a in joint.added for o in a.objects}
            return "" if not parts or parts >= set(movers) else f"on {' and '.join(sorted(parts))}: "

        joints = ((choice.pair,) if choice.pair else ()) + choice.singles
        return tuple(
            Tried(
                joint.name,
                joint.added[0].effect.channel,
                evidence.log_evidence,
                evidence.held_out_gain,
                chosen is not None and joint.added is chosen.added,
                f"{on(joint)}explains {100 * choice.share(joint):.0f} % of the excess",
            )
            for joint, evidence in ((joint, self._evidence(joint, choice)) for joint in joints)
        )

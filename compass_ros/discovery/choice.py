"""Fitted models side by side: what each explains, and which of them may be named."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from compass_ros.calibration.least_squares import Fit, cost
from compass_ros.calibration.likelihood import Likelihood
from compass_ros.discovery.joint import Joint
from compass_ros.discovery.remainder import smooth_excess
from compass_ros.discovery.screen import Space
from compass_ros.discovery.trials import different, worth
from compass_ros.discovery.unseen import HeldOut

ENOUGH = 0.93
"""Share of the excess (cost above the noise floor) that a single effect must explain to be named alone."""
PAIR_ENOUGH = 0.95
"""The same for two effects."""
SMALL = 0.12
"""Excess of chi-square under which a remainder is put down to the effect's functional form..."""
FORM_SHARE = 0.6
"""...if the effect explains at least this share."""
PREDICTS = 0.92
"""Share of the held-out excess that what is named must remove, but for a SMALL remainder: less is another law's."""
SEEN = 0.04
"""Excess of chi-square that an effect which is enough must leave for another to be looked for beside it: less, 0.2 of
the noise, is what its form gets wrong, and many a second effect would take some of that."""
LITTLE, MANY_TIMES, SEVERAL = 0.12, 4.0, 2
"""Share that an effect may leave where at least so many others, fitted as well, leave so many times as much."""
OF_LIMIT = 8.0
"""Log evidence by which an effect must surpass what it comes to at an end of its shapes."""
FORM_LEFT = 0.25
"""Part of what one effect leaves that a second may leave to be its cause."""
LEADERS = 4
"""Best fits that are continued, and of which one may be named."""


@dataclass(frozen=True)
class Choice:
    """Fitted models, the best first."""

    singles: tuple[Joint, ...]
    pair: Joint | None
    excess: float
    """Cost of the plain model above the noise floor."""
    floor: float
    """Cost that the noise alone leaves."""
    two: bool = False
    """The first single is enough, and the pair still explains what it leaves: there are two."""
    equal: tuple[Joint, ...] = ()
    """Where the first single is enough: others that explain the recordings as well."""

    def of(self, singles: Sequence[Joint]) -> Choice:
        """The same recordings with these models; shares are of what the best shows to be above the noise."""
        best = min(singles, key=lambda j: j.fit.point.cost)
        return replace(self.shown_by(best), singles=tuple(singles))

    def shown_by(self, joint: Joint) -> Choice:
        """The same with the noise floor that a model shows."""
        floor = floor_of(joint.likelihood, joint.fit, joint.fit.point.cost)
        return replace(self, excess=self.excess + self.floor - floor, floor=floor)

    def share(self, joint: Joint) -> float:
        """Part of the excess that a model explains."""
        return 1 - max(joint.fit.point.cost - self.floor, 0.0) / max(self.excess, 1e-9)

    def remainder(self, joint: Joint) -> float:
        """Excess of chi-square that a model leaves."""
        return 2 * max(joint.fit.point.cost - self.floor, 0.0) / joint.likelihood.measurements

    def ends(self, joint: Joint, unseen: HeldOut) -> bool:
        """Whether an effect reaches the noise floor: no other is to be looked for beside it."""
        return self.remainder(joint) < SEEN and unseen.remainder(joint) < SMALL

    def explains(self, pair: Joint, first: Joint) -> bool:
        """Whether what one effect leaves has a second cause.

        What a wrong functional form leaves is explained in part by many effects and wholly by none; a second effect is
        explained wholly by one.
        """
        return self.remainder(pair) < FORM_LEFT * self.remainder(first)

    def verdict(self, unseen: HeldOut) -> Joint | None:
        """The model that is to be named: of one effect or of two; None where none may be."""
        return next(iter(self.verdicts(unseen)), None)

    def verdicts(self, unseen: HeldOut) -> Iterator[Joint]:
        """Models that may be named, the best first: two effects where they are two, one that is enough, a pair."""
        best, pair = self.singles[0] if self.singles else None, self.pair
        needed = best is not None and pair is not None and self.explains(pair, best)
        ranked = (pair if self.two else None, best, pair if needed and not self.two else None)
        return (joint for joint in ranked if joint is not None and self.nameable(joint, unseen))

    def good(self, unseen: HeldOut) -> list[Joint]:
        """Models of one effect that may be named, the best first."""
        good = [j for j in self.singles[:LEADERS] if self.nameable(j, unseen)]
        return sorted(good, key=lambda j: -evidence(j, unseen))

    def nameable(self, joint: Joint, unseen: HeldOut) -> bool:
        """Whether a model explains the fitted episodes and predicts the others, with laws that are what they say."""
        share = unseen.share(joint)
        predicts = share >= PREDICTS or (share >= FORM_SHARE and unseen.remainder(joint) < SMALL)
        return self.enough(joint) and unseen.helps(joint) and predicts and not joint.stands_in and joint.distinct

    def complete(self) -> bool:
        """Whether a model leaves nothing of the fitted episodes: what it does not predict, only others can show."""
        return any(self.enough(j) and self.remainder(j) < SEEN and not j.stands_in for j in self._models)

    def untaught(self, unseen: HeldOut) -> bool:
        """Whether a model leaves little of the fitted episodes and fails on the others.

        They have something then that no fitted one shows.
        """
        models = [j for j in self._models if self.enough(j) and self.remainder(j) < SMALL]
        return bool(models) and not any(unseen.helps(j) for j in models)

    @property
    def _models(self) -> list[Joint]:
        return [*self.singles, *([self.pair] if self.pair else [])]

    def enough(self, joint: Joint) -> bool:
        """Whether a model explains what there is to explain."""
        share = self.share(joint)
        form_only = share >= FORM_SHARE and self.remainder(joint) < SMALL
        return share >= (ENOUGH if len(joint.added) == 1 else PAIR_ENOUGH) or form_only or self._alone(joint)

    def _alone(self, joint: Joint) -> bool:
        """Whether an effect leaves little, and any other of several leaves many times that: its form is not ours."""
        others = self._others(joint)
        left = 1 - self.share(joint)
        if len(joint.added) > 1 or len(others) < SEVERAL or left > LITTLE:
            return False
        return all(1 - self.share(other) > MANY_TIMES * left for other in others)

    def _others(self, joint: Joint) -> list[Joint]:
        """Fits of other effects; one that comes to this at an end of its shapes is no other."""
        return [j for j in different(self.singles) if j.name != joint.name and not comes_to(j, joint)]


def comes_to(joint: Joint, simpler: Joint) -> bool:
    """Whether a model says no more than a simpler one that it comes to at an end of the shapes of one of its laws."""
    own, others = ({a.effect.name: a.effect.limit for a in j.added} for j in (joint, simpler))
    apart = [limit for name, limit in own.items() if name not in others]
    limits = len(own) == len(others) and len(apart) == 1 and apart[0] in others.keys() - own.keys()
    return limits and worth(simpler) - worth(joint) < OF_LIMIT


def evidence(joint: Joint, unseen: HeldOut) -> float:
    """Log evidence of all episodes: of the fitted ones, and of the others as they are predicted."""
    return -worth(joint) - unseen.surprise(joint) / joint.likelihood.correlation_time


def undecided(space: Space) -> Choice:
    """The plain fit, before any effect was tried."""
    base = float(cost(space.likelihood, [space.fit.point], space.fit.robust)[0][0])
    floor = floor_of(space.likelihood, space.fit, base)
    return Choice((), None, base - floor, floor)


def floor_of(likelihood: Likelihood, fit: Fit, reached: float) -> float:
    """Cost that noise alone leaves, from a fit of cost `reached`: less what is still smooth in its residual."""
    return reached - 0.5 * max(smooth_excess(likelihood, fit.point, fit.robust), 0.0) * likelihood.measurements

"""A fitted model, linear about its fit: what its parameters, and pushes on all that is tracked, do to the residual."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from compass_ros.calibration.cost import Point, launches_away
from compass_ros.calibration.least_squares import Fit, normal_equations
from compass_ros.calibration.likelihood import Likelihood
from compass_ros.discovery.evidence import Tangent
from compass_ros.discovery.nuisances import nuisances
from compass_ros.discovery.objections import frame_rate
from compass_ros.discovery.settings import MOMENTS
from compass_ros.simulation import Simulator
from compass_ros.simulation.effects import Attached
from compass_ros.simulation.extents import along
from compass_ros.simulation.kicks import Kicks, inertias, kicks
from compass_ros.simulation.simulator import in_chunks
from compass_ros.simulation.site_kinds import JOINTS, PLANAR
from compass_ros.simulation.sites import Site
from compass_ros.simulation.visited import Visited
from compass_ros.types import Floats, Ints


@dataclass(frozen=True, eq=False)
class Response:
    """E episodes, D residuals of each, K moments, S directions of a discrepancy: first those of forces, one of a joint,
    two of a body in the plane, all of one in space, then the C observed columns.

    A push is an acceleration: a generalised force over the direction's own inertia.
    """

    simulator: Simulator
    likelihood: Likelihood
    fit: Fit
    kicks: Kicks
    sites: tuple[Site, ...]
    """What is pushed."""
    site_of: Ints
    """(F,) which of them a direction of forces belongs to."""
    inertia: Floats
    """(F,) its entry of the mass matrix, mean over all moments [kg or kg m^2]."""
    unit: Floats
    """(S,) of forces what moves and holds it (`at_work`) [m/s^2 or rad/s^2], of signals the rms of what moves."""
    pushes: Floats
    """(E, D, K, S) change of the residual [sigma] per unit around a moment."""

    @cached_property
    def inside(self) -> Ints:
        """Which of the free parameters may move: one that lies on a bound and would leave it is held there, and a law
        whose size is zero there adds nothing to the evidence."""
        likelihood, fit = self.likelihood, self.fit
        _, gradient = normal_equations(likelihood, fit.point, fit.linear, fit.free, fit.robust)
        values, outward = fit.point.values[fit.free], gradient[: len(fit.free)]
        held = ((values <= likelihood.low[fit.free]) & (outward > 0)) | (
            (values >= likelihood.high[fit.free]) & (outward < 0)
        )
        return np.flatnonzero(~held)

    @property
    def launches(self) -> Floats:
        """(E, D, l) change of the residual by an episode's launch, in standard deviations of its prior."""
        linear = self.fit.linear
        return linear.launch_jacobian.reshape(len(linear.residual), linear.residual[0].size, -1)

    @cached_property
    def tangent(self) -> Tangent:
        """Beside the parameters stand the engine's approximations, as nuisances; the time step's of each episode too
        where things touch, for a contact falls into a step by chance (`nuisances`)."""
        likelihood, fit = self.likelihood, self.fit
        episodes = len(likelihood.inputs)
        linear, point = fit.linear, fit.point
        rows = (episodes, linear.residual[0].size)
        engine = nuisances(self.simulator, likelihood, fit).reshape(*rows, -1)
        by_chance = engine[:, :, : int(self.simulator.places.touching)]
        known = ((likelihood.prior_mean - point.values) / likelihood.prior_std)[fit.free[self.inside]]
        return Tangent(
            residual=linear.residual.reshape(rows),
            parameters=np.concatenate([linear.jacobian.reshape(*rows, -1)[:, :, self.inside], engine], axis=2),
            own=np.concatenate([self.launches, by_chance], axis=2),
            pushes=self.pushes.reshape(*rows, -1),
            away=np.append(known, np.zeros(engine.shape[2])),
            own_away=np.pad(-launches_away(likelihood, point), ((0, 0), (0, by_chance.shape[2]))),
            robust=fit.robust,
            correlation_time=likelihood.correlation_time,
        )

    @property
    def forces(self) -> Floats:
        """(S,) 1 for directions of forces, 0 for signals."""
        return (np.arange(len(self.unit)) < len(self.site_of)).astype(float)

    @property
    def values(self) -> Floats:
        """(P,) of the cell's parameters, without those of laws."""
        return self.fit.point.values[: len(self.simulator.cell.parameters)]

    def along(self, n: int) -> tuple[Floats, Floats]:
        """(E, K, a) places of a site and (E, K, a) their rates: of a joint one number, in the plane two, in space three
        of its centre of mass."""
        if n < self.states.shape[2]:
            a = 1 if self.sites[n].kind in JOINTS else 2
            return self.states[:, :, n, :a], self.states[:, :, n, 2 : 2 + a]
        name, states = self.sites[n].name, self.kicks.states
        path = along(self.simulator.written(self.fit.point.values), [name], states)[name]
        return path.position.reshape(*states.shape[:2], 3), path.velocity.reshape(*states.shape[:2], 3)

    @cached_property
    def ways(self) -> Floats:
        """(E, K, S, N) unit vectors along the motion of each of the N sites; zero of turns of bodies and of signals."""
        model, states = self.simulator.physics.model, self.kicks.states
        _, dofs = directions(self.simulator, self.sites)
        speeds = states[..., 1 + model.nq : 1 + model.nq + model.nv][..., dofs]
        out = np.zeros((*states.shape[:2], len(self.unit), len(self.sites)))
        for n, own in enumerate(self._straight):
            speed = np.linalg.norm(speeds[..., own], axis=2, keepdims=True)
            out[:, :, own, n] = speeds[..., own] / np.maximum(speed, 1e-300)
        return out

    @property
    def _straight(self) -> list[Ints]:
        """Directions in which each site moves along a line: three of a body in space, two in the plane, one of a
        joint."""
        straight = [1 if s.kind in JOINTS else 2 if s.kind in PLANAR else 3 for s in self.sites]
        return [np.flatnonzero(self.site_of == n)[:count] for n, count in enumerate(straight)]

    def follows(self, attached: Attached) -> bool:
        """Whether a law is a force on what moves along a path, which pushes say all of."""
        flat = [site.names[0] for site in self.sites[: self.states.shape[2]]]
        effect = attached.effect
        return effect.along_path and all(name in flat for name in attached.objects)

    @cached_property
    def states(self) -> Floats:
        """(E, K, N, 6) of each site but bodies in space: x, y, vx, vy, mass, time; of a joint angle, 0, rate, 0,
        inertia, time."""
        return self._states_at(self.kicks.moments_s)

    @cached_property
    def _often(self) -> tuple[Floats, Floats]:
        """(E, J, N, 6) the same as often as frames, and (K, J) how much of a force there belongs to each moment.

        Of a force that changes between two moments: pushes are linear in time between them, as `readings`.
        """
        moments = self.kicks.moments_s
        if len(moments) < 2:
            return self.states, np.ones((1, 1))
        apart = float(np.diff(moments).mean())
        each = max(round(apart * frame_rate(self.likelihood.time_s)), 1)
        time = np.ravel(moments[:, None] + apart * ((np.arange(each) + 0.5) / each - 0.5))
        return self._states_at(np.maximum(time, 0.0)), _hats(time, moments).T / each

    def _states_at(self, moments_s: Floats) -> Floats:
        names = list(self.simulator.moving)
        if not names:
            return np.zeros((len(self.likelihood.inputs), len(moments_s), 0, 6))
        inputs = self.likelihood.inputs + self.fit.point.launch
        tiled = np.tile(self.fit.point.values, (len(inputs), 1))
        paths = self.simulator.paths(tiled, inputs, moments_s, names)
        first = [int(np.flatnonzero(self.site_of == n)[0]) for n in range(len(names))]
        mass = np.broadcast_to(self.inertia[first, None], (*paths.shape[:3], 1))
        time = np.broadcast_to(moments_s[:, None, None], (*paths.shape[:3], 1))
        return np.concatenate([paths, mass, time], axis=3)

    def accelerations(self, attached: Attached, numbers: Floats) -> Floats:
        """(E, K, S) of a law of forces with (q,) numbers, along the fitted motion; zero of signals."""
        out = np.zeros((*self.states.shape[:2], len(self.unit)))
        out[:, :, self.pushed_by(attached)] = self.law(attached)(numbers)
        return out

    def at_once(self, values: Floats, other: Floats) -> Floats:
        """(E, K, S) accelerations by which a step from the states of the moments differs with two (P,) sets of values;
        zero of signals."""
        states, controls, simulator = self.kicks.states, self.kicks.controls, self.simulator
        flat = states.reshape(-1, states.shape[2])
        driven = () if controls is None else (controls.reshape(len(flat), 1, -1),)

        def stepped(of: Floats, begin: Floats, *told: Floats) -> Floats:
            return simulator.play(of, begin, told[0] if told else None, 1)[0][:, 0]

        first, second = (in_chunks(stepped, np.tile(v, (len(flat), 1)), flat, *driven) for v in (values, other))
        model = simulator.physics.model
        _, dofs = directions(simulator, self.sites)
        change = (first - second)[:, 1 + model.nq + dofs] / simulator.time_step
        out = np.zeros((*states.shape[:2], len(self.unit)))
        out[:, :, : len(dofs)] = change.reshape(*states.shape[:2], -1)
        return out

    def groups(self) -> list[Ints]:
        """Directions in which one thing moves along a line, and turns of bodies, each by itself."""
        out: list[Ints] = []
        for n, line in enumerate(self._straight):
            turns = np.setdiff1d(np.flatnonzero(self.site_of == n), line)
            out += [line, *(turns[i : i + 1] for i in range(len(turns)))]
        return out

    def pushed_by(self, attached: Attached) -> Ints:
        """(n,) directions in which a law of forces pushes."""
        return np.concatenate([np.flatnonzero(self.site_of == n) for n in self._chosen(attached)])

    def law(self, attached: Attached) -> Callable[[Floats], Floats]:
        """A law of forces as a function of its (q,) numbers: (E, K, n) accelerations in the directions it pushes in."""
        own = [np.flatnonzero(self.site_of == n) for n in self._chosen(attached)]
        often = any(q.grid > 1 for q in attached.effect.quantities)
        states, shares = self._often if often else (self.states, None)
        states = np.ascontiguousarray(states[:, :, self._chosen(attached)])
        force = self.simulator.force_law(attached, self.values, states)

        def accelerations(numbers: Floats) -> Floats:
            of = force(np.tile(numbers, (len(states), 1)))
            parts = [of[n][..., : len(i)] / self.inertia[i] for n, i in zip(attached.objects, own, strict=True)]
            pushed = np.concatenate(parts, axis=2)
            return pushed if shares is None else np.asarray(shares @ pushed)

        return accelerations

    def _chosen(self, attached: Attached) -> list[int]:
        """Sites by the law's objects."""
        return [next(n for n, s in enumerate(self.sites) if s.names[0] == name) for name in attached.objects]

    @cached_property
    def _motion(self) -> Floats:
        """(E, T + 1, n) raw rows of the fitted motion."""
        inputs = self.likelihood.inputs + self.fit.point.launch
        return self.simulator.raw(np.tile(self.fit.point.values, (len(inputs), 1)), inputs, self.likelihood.time_s)

    def changes(self, attached: Attached, numbers: Floats) -> Floats:
        """(E, D, n) changes of the residual by (n, q) numbers of one more law, from rollouts.

        A sensor that does not look ahead needs none, unless first places were read from it: the motion is as it was.
        """
        point, likelihood = self.fit.point, self.likelihood
        with_it = self.simulator.with_effects([*self.simulator.effects, attached])
        episodes, index = len(likelihood.inputs), np.tile(np.arange(len(likelihood.inputs)), len(numbers))
        values = np.concatenate([np.tile(point.values, (len(numbers), 1)), numbers], axis=1)
        inputs = np.tile(likelihood.inputs + point.launch, (len(numbers), 1))
        asked = np.repeat(values, episodes, axis=0), inputs, likelihood.time_s[index]
        same = np.array_equal(with_it.physics.truly(*asked[:2]), inputs[:, : len(self.simulator.cell.input_names)])
        if attached.effect.sensing is not None and attached.effect.ahead is None and same:
            predicted = with_it.sensed(*asked, np.tile(self._motion, (len(numbers), 1, 1)))
        else:
            predicted = with_it.observe(*asked)
        there = np.nan_to_num(likelihood.difference(predicted, likelihood.measured[index]) / likelihood.sigma[index])
        change = there.reshape(len(numbers), episodes, -1) - self.tangent.residual
        return np.moveaxis(change, 0, 2)

    def bent(self, attached: Attached) -> Callable[[Floats], Floats]:
        """A law of a sensor that looks at no other time, as a function of its (q,) numbers: (E, D) changes of the
        residual; with the first places that were read from it, to first order."""
        sensing, physics, likelihood = attached.effect.sensing, self.simulator.physics, self.likelihood
        assert sensing is not None
        inputs = likelihood.inputs + self.fit.point.launch
        values = np.tile(self.fit.point.values, (len(inputs), 1))
        context = physics.context(attached.sites(physics.places), values)
        plain = self.simulator.sensed(values, inputs, likelihood.time_s, self._motion)

        told, std = inputs[:, : len(likelihood.launch_std)], likelihood.launch_std
        wider = self.simulator.with_effects([*self.simulator.effects, attached]).physics
        read, random = physics.truly(values, told), std > 0

        def change(numbers: Floats) -> Floats:
            of = np.tile(numbers, (len(plain), 1))
            predicted = sensing(lambda _: plain, of, context)(likelihood.time_s)
            there = np.nan_to_num(likelihood.difference(predicted, likelihood.measured) / likelihood.sigma)
            begins = (wider.truly(np.concatenate([values, of], axis=1), told) - read)[:, random] / std[random]
            moved = (self.launches @ begins[:, :, None])[..., 0]
            return np.asarray(there.reshape(len(plain), -1) - self.tangent.residual + moved)

        return change


def respond(simulator: Simulator, likelihood: Likelihood, fit: Fit) -> Response:
    """The response of a fitted simulator, with the laws that it has."""
    point = fit.point
    inputs = likelihood.inputs + point.launch
    unit_kicks = kicks(simulator, point.values, inputs, likelihood.time_s, MOMENTS)
    sites = (*simulator.moving.values(), *simulator.in_space.values())
    site_of, dofs = directions(simulator, sites)
    matrices = inertias(simulator, point.values, unit_kicks.states)
    inertia = matrices[..., dofs, dofs].mean(axis=(0, 1))
    inverse = np.linalg.inv(matrices)[..., dofs] * inertia  # (E, K, V, S)
    spacing = float(np.diff(unit_kicks.moments_s).mean()) if len(unit_kicks.moments_s) > 1 else 1.0
    forced = np.einsum("efckv,ekvs->efcks", unit_kicks.response, inverse) * spacing
    read = readings(likelihood, unit_kicks.moments_s)
    seen = ~np.isnan(likelihood.measured)
    moved = np.concatenate([forced, np.broadcast_to(read, (*seen.shape, *read.shape[3:]))], axis=4)
    pushes = np.where(seen[..., None, None], moved / likelihood.sigma[..., None, None], 0.0)
    model = simulator.physics.model
    speeds = unit_kicks.states[..., 1 + model.nq : 1 + model.nq + model.nv][..., dofs]
    accelerations = np.sqrt(np.mean(np.diff(speeds, axis=1) ** 2, axis=(0, 1))) / spacing
    unit = np.concatenate([at_work(simulator, likelihood, point, sites, site_of, accelerations), motion(likelihood)])
    rows = (len(inputs), seen[0].size, len(unit_kicks.moments_s), len(unit))
    return Response(simulator, likelihood, fit, unit_kicks, sites, site_of, inertia, unit, pushes.reshape(rows))


def at_work(
    simulator: Simulator, likelihood: Likelihood, point: Point, sites: Sequence[Site], site_of: Ints, moving: Floats
) -> Floats:
    """(F,) `moving`, the rms acceleration; of a joint what gravity and drives would give it alone, where that is more.

    A servo against its friction exerts much and accelerates little: what is missing there has the size of the forces,
    as laws on joints have (`simulation/sizes.py`).
    """
    sizes = Visited(simulator, point.values, likelihood.inputs + point.launch, likelihood.time_s).joint_sizes()
    forces = [sizes[s.name].force / sizes[s.name].inertia if s.name in sizes else 0.0 for s in sites]
    return np.maximum(moving, np.array(forces)[site_of])


def motion(likelihood: Likelihood) -> Floats:
    """(C,) root mean square of what each column moves within an episode; 0 where it was not measured."""
    seen = ~np.isnan(likelihood.measured)
    count = np.maximum(seen.sum(axis=1, keepdims=True), 1)
    values = np.where(seen, likelihood.measured, 0.0)
    away = np.where(seen, values - values.sum(axis=1, keepdims=True) / count, 0.0)
    return np.asarray(np.sqrt(np.mean(np.sum(away**2, axis=1) / count[:, 0], axis=0)))


def readings(likelihood: Likelihood, moments: Floats) -> Floats:
    """(E, F, C, K, C) change of each observed column by an error of each at a moment, linear in time between them."""
    hats = _hats(likelihood.time_s, moments)
    columns = likelihood.measured.shape[2]
    return np.asarray(hats[:, :, None, :, None] * np.eye(columns)[:, None, :])


def _hats(time: Floats, moments: Floats) -> Floats:
    """(..., K) share of each moment in a time, linear between them."""
    time = np.clip(time, moments[0], moments[-1])
    return np.asarray(np.maximum(1 - np.abs(time[..., None] - moments) / np.diff(moments).mean(), 0.0))


def directions(simulator: Simulator, sites: tuple[Site, ...]) -> tuple[Ints, Ints]:
    """(S,) sites and (S,) degrees of freedom in which they are pushed."""
    model = simulator.physics.model
    of, dofs = [], []
    for n, site in enumerate(sites):
        if site.kind in JOINTS:
            first, count = int(model.jnt_dofadr[model.joint(site.name).id]), 1
        else:
            body = model.body(site.name).id
            first, count = int(model.body_dofadr[body]), 2 if site.kind in PLANAR else int(model.body_dofnum[body])
        of += [n] * count
        dofs += list(range(first, first + count))
    return np.array(of, int), np.array(dofs, int)

"""Accelerations of a chain of hinges, by Newton-Euler in the world's axes, compiled (Featherstone, Rigid Body Dynamics
Algorithms, Springer 2008, chapters 5 and 6).

Dry friction is a force that opposes sliding and is as large as it must be up to its bounds: the dual of Gauss's
principle, a quadratic programme with box constraints. Its two numbers of softness are those that MuJoCo's documentation
(Computation, constraint model) gives to a scene's `frictionloss`: at rest a joint creeps as the drawing says it does.
"""

from __future__ import annotations

from collections.abc import Callable
from math import cos, sin
from typing import TypeVar, cast

import numpy as np
from numba import njit

from compass_ros.types import Floats

Vector = tuple[float, float, float]
F = TypeVar("F", bound=Callable[..., object])
_SWEEPS = 200
_CLOSE = 1e-11
"""Change of a friction torque, over the widest bounds, at which the sweeps of the programme end."""


def compiled(function: F) -> F:
    """The function by numba, kept on disk for the next process."""
    return cast(F, njit(cache=True)(function))


@compiled
def _add(a: Vector, b: Vector) -> Vector:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@compiled
def _less(a: Vector, b: Vector) -> Vector:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@compiled
def _times(k: float, a: Vector) -> Vector:
    return k * a[0], k * a[1], k * a[2]


@compiled
def _dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@compiled
def _cross(a: Vector, b: Vector) -> Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@compiled
def _row(A: Floats, i: int) -> Vector:
    return A[i, 0], A[i, 1], A[i, 2]


@compiled
def _put(A: Floats, i: int, a: Vector) -> None:
    A[i, 0], A[i, 1], A[i, 2] = a


@compiled
def _turned(R: Floats, a: Vector) -> Vector:
    return _dot(_row(R, 0), a), _dot(_row(R, 1), a), _dot(_row(R, 2), a)


@compiled
def _product(A: Floats, B: Floats, out: Floats) -> None:
    for i in range(3):
        for j in range(3):
            out[i, j] = A[i, 0] * B[0, j] + A[i, 1] * B[1, j] + A[i, 2] * B[2, j]


@compiled
def _about(axis: Vector, angle: float, out: Floats) -> None:
    """Rotation about a unit axis (Rodrigues)."""
    s, c = sin(angle), cos(angle)
    x, y, z = axis
    k = 1.0 - c
    _put(out, 0, (c + x * x * k, x * y * k - z * s, x * z * k + y * s))
    _put(out, 1, (y * x * k + z * s, c + y * y * k, y * z * k - x * s))
    _put(out, 2, (z * x * k - y * s, z * y * k + x * s, c + z * z * k))


@compiled
def _invert(M: Floats, W: Floats) -> None:
    """Inverse of a positive definite matrix by Gauss and Jordan; M is used up."""
    size = len(M)
    for i in range(size):
        for j in range(size):
            W[i, j] = 1.0 if i == j else 0.0
    for i in range(size):
        pivot = 1.0 / M[i, i]
        for j in range(size):
            M[i, j] *= pivot
            W[i, j] *= pivot
        for k in range(size):
            share = M[k, i]
            if k != i and share != 0.0:
                for j in range(size):
                    M[k, j] -= share * M[i, j]
                    W[k, j] -= share * W[i, j]


@compiled
def _dry(
    W: Floats, free: Floats, v: Floats, lower: Floats, upper: Floats, soft: Floats, back: Floats, f: Floats
) -> None:
    """(N,) torques f within their bounds that minimise f (W + diag(soft)) f / 2 + f (free + back v): Gauss-Seidel."""
    size, widest = len(f), 1e-30
    for i in range(size):
        f[i] = 0.0
        widest = max(widest, upper[i] - lower[i])
    for _ in range(_SWEEPS):
        change = 0.0
        for i in range(size):
            if upper[i] <= lower[i]:
                continue
            slope = free[i] + back[i] * v[i] + soft[i] * f[i]
            for j in range(size):
                slope += W[i, j] * f[j]
            new = min(max(f[i] - slope / (W[i, i] + soft[i]), lower[i]), upper[i])
            change = max(change, abs(new - f[i]))
            f[i] = new
        if change <= _CLOSE * widest:
            break


@compiled
def _place(
    q: Floats, origin: Floats, turn: Floats, axis: Floats, centre: Floats, inertia: Floats,
    R: Floats, z: Floats, o: Floats, c: Floats, J: Floats,
) -> None:  # fmt: skip
    """Links in the world at (n,) angles: rotations, axes, origins, centres, inertias."""
    start, other = np.empty((3, 3)), np.empty((3, 3))
    for i in range(len(z)):
        if i == 0:
            start[:] = turn[0]
            _put(o, 0, _row(origin, 0))
        else:
            _product(R[i - 1], turn[i], start)
            _put(o, i, _add(_row(o, i - 1), _turned(R[i - 1], _row(origin, i))))
        _about(_row(axis, i), q[i], other)
        _product(start, other, R[i])
        _put(z, i, _turned(start, _row(axis, i)))
        _put(c, i, _add(_row(o, i), _turned(R[i], _row(centre, i))))
        _product(R[i], inertia[i], start)
        _product(start, R[i].T, J[i])


@compiled
def _masses(z: Floats, o: Floats, c: Floats, J: Floats, mass: Floats, armature: Floats, M: Floats) -> None:
    """(N, N) mass matrix: kinetic energy of all links, and what belongs to one coordinate."""
    M[:] = 0.0
    for i in range(len(armature)):
        M[i, i] = armature[i]
    for k in range(len(z)):
        for i in range(k + 1):
            arm = _times(mass[k], _cross(_row(z, i), _less(_row(c, k), _row(o, i))))
            turning = _turned(J[k], _row(z, i))
            for j in range(i + 1):
                other = _cross(_row(z, j), _less(_row(c, k), _row(o, j)))
                M[i, j] += _dot(arm, other) + _dot(turning, _row(z, j))
    for i in range(len(z)):
        for j in range(i):
            M[j, i] = M[i, j]


@compiled
def _bias(
    v: Floats,
    z: Floats,
    o: Floats,
    c: Floats,
    J: Floats,
    mass: Floats,
    gravity: Vector,
    F: Floats,
    T: Floats,
    h: Floats,
) -> None:
    """(n,) torques that gravity, centrifugal and Coriolis forces need."""
    n = len(z)
    w, dw, a = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), _times(-1.0, gravity)
    for i in range(n):
        if i > 0:
            r = _less(_row(o, i), _row(o, i - 1))
            a = _add(a, _add(_cross(dw, r), _cross(w, _cross(w, r))))
        turning = _times(v[i], _row(z, i))
        dw = _add(dw, _cross(w, turning))
        w = _add(w, turning)
        r = _less(_row(c, i), _row(o, i))
        _put(F, i, _times(mass[i], _add(a, _add(_cross(dw, r), _cross(w, _cross(w, r))))))
        _put(T, i, _add(_turned(J[i], dw), _cross(w, _turned(J[i], w))))
    f, t = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    for i in range(n - 1, -1, -1):
        t = _add(t, _add(_row(T, i), _cross(_less(_row(c, i), _row(o, i)), _row(F, i))))
        if i + 1 < n:
            t = _add(t, _cross(_less(_row(o, i + 1), _row(o, i)), f))
        f = _add(f, _row(F, i))
        h[i] = _dot(_row(z, i), t)


@compiled
def accelerate(
    q: Floats, v: Floats, force: Floats, lower: Floats, upper: Floats, soft: Floats, back: Floats, armature: Floats,
    origin: Floats, turn: Floats, axis: Floats, mass: Floats, centre: Floats, inertia: Floats, gravity: Floats,
) -> Floats:  # fmt: skip
    """(B, N) accelerations: n hinges of the chain, then N - n rotors that are no part of it.

    Args:
        q, v: (B, N) angles [rad] and rates [rad/s].
        force: (B, N) all torques but gravity, inertia and dry friction [N m].
        lower, upper: (B, N) bounds of the torque of dry friction, lower <= 0 <= upper [N m].
        soft, back: (N,) regularisation [rad/s^2 per N m] and rate [1/s] at which a stuck joint's speed decays.
        armature: (N,) inertia that belongs to one coordinate [kg m^2].
        origin, turn, axis: (n, 3), (n, 3, 3), (n, 3) pose of each link in the one before at angle zero, and its axis.
        mass, centre, inertia: (n,), (n, 3), (n, 3, 3) of each link in its own frame, the inertia about the centre.
        gravity: (3,) [m/s^2].
    """
    size, n = q.shape[1], len(mass)
    out, down = np.empty(q.shape), (gravity[0], gravity[1], gravity[2])
    R, J = np.empty((n, 3, 3)), np.empty((n, 3, 3))
    z, o, c, F, T = np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 3))
    M, W, free, dry, h = np.empty((size, size)), np.empty((size, size)), np.empty(size), np.empty(size), np.zeros(size)
    for e in range(len(q)):
        _place(q[e], origin, turn, axis, centre, inertia, R, z, o, c, J)
        _masses(z, o, c, J, mass, armature, M)
        _bias(v[e], z, o, c, J, mass, down, F, T, h)
        _invert(M, W)
        for i in range(size):
            free[i] = 0.0
            for j in range(size):
                free[i] += W[i, j] * (force[e, j] - h[j])
        _dry(W, free, v[e], lower[e], upper[e], soft, back, dry)
        for i in range(size):
            out[e, i] = free[i]
            for j in range(size):
                out[e, i] += W[i, j] * dry[j]
    return out


@compiled
def mass_matrix(
    q: Floats,
    armature: Floats,
    origin: Floats,
    turn: Floats,
    axis: Floats,
    mass: Floats,
    centre: Floats,
    inertia: Floats,
) -> Floats:
    """(N, N) at (n,) angles."""
    n, size = len(mass), len(armature)
    R, J, M = np.empty((n, 3, 3)), np.empty((n, 3, 3)), np.empty((size, size))
    z, o, c = np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 3))
    _place(q, origin, turn, axis, centre, inertia, R, z, o, c, J)
    _masses(z, o, c, J, mass, armature, M)
    return M

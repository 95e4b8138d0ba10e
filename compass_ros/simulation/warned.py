"""MuJoCo's warnings, counted and said once: it would print one for each rollout, and write MUJOCO_LOG.TXT."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager

import mujoco

_WHERE = re.compile(r" at DOF \d+| Time = .*| at time .*|\d+")


class Warned:
    """How many rollouts had a warning of each kind, and the first of each as MuJoCo says it."""

    def __init__(self) -> None:
        self._first: dict[str, str] = {}
        self._count: dict[str, int] = {}

    @contextmanager
    def counting(self) -> Iterator[None]:
        """MuJoCo's warnings are counted while this is open, of all threads: at most one of each kind a rollout."""
        before = mujoco.get_mju_user_warning()
        mujoco.set_mju_user_warning(self._count_one)
        try:
            yield
        finally:
            mujoco.set_mju_user_warning(before)

    def _count_one(self, text: str) -> None:
        kind = _WHERE.sub("", text)
        self._first.setdefault(kind, " ".join(text.split()))
        self._count[kind] = self._count.get(kind, 0) + 1

    def said(self, rollouts: int) -> tuple[str, ...]:
        """One line for all of them, of so many rollouts; none where there was none."""
        if not self._count:
            return ()
        kinds = "; ".join(f"{count} times '{self._first[kind]}'" for kind, count in self._count.items())
        said = f"MuJoCo warned in {rollouts} rollouts {kinds}: each stood still from there on"
        return (f"{said}. A smaller time step of the scene or narrower bounds of the parameters may help",)

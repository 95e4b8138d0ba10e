"""Rollouts of prepared cases in MJX on whatever device jax has; a part of `gpu.py`, which starts it once a precision.

    JAX_ENABLE_X64=1 python gpu_worker.py FOLDER LABEL SECONDS BATCH...

Reads FOLDER/CASE.npz and CASE.xml, writes FOLDER/LABEL-CASE.npz (places at the frames of all prepared rollouts) and
prints a JSON line for each thing that it measured. Several precisions may run at once: all compile, one plays, by a
lock on FOLDER/lock. Needs jax, mujoco-mjx and `mjx_laws.py`, nothing else of ours.
"""

from __future__ import annotations

import fcntl
import importlib.util
import json
import os
import sys
import time
from concurrent.futures import ThreadPoolExecutor, wait
from pathlib import Path
from types import ModuleType
from typing import Any

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
from mujoco import mjx

LAWS = Path(__file__).parents[1] / "compass_ros" / "targets" / "mjx_laws.py"
TIMED_S = 2.5
"""How long a batch is rolled out for its rate, at least; its window is not always played to the end."""
WINDOW_S = 40.0
"""The same of the batch whose places are compared, at most."""
SOLVER = {"iterations": 10, "ls_iterations": 10}
"""MJX computes all iterations of a line search that it is allowed, and in float32 never gets below the tolerances of
the scenes. What this many leave of MuJoCo's answer is among what is measured, in float64 alone."""
CHUNK = 5
"""Frames that one call computes: short enough to look at the clock between calls, long enough not to be the clock."""


def loaded(path: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location("mjx_laws", path)
    if spec is None or spec.loader is None:
        raise FileNotFoundError(path)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


def _of(model: Any, name: str) -> Any:
    """What a model has by that name, as `opt.gravity`; None where it has none."""
    for part in name.split("."):
        model = getattr(model, part, None)
    return model


class Case:
    """A scene with rollouts that were prepared: numbers of the model, of the laws, starts and controls of each."""

    def __init__(self, folder: Path, name: str, laws: ModuleType) -> None:
        with np.load(folder / f"{name}.npz") as given:
            self.given = {key: given[key] for key in given.files}
        self.name, self.laws = name, laws
        self.every, self.frames = int(self.given["every"]), int(self.given["frames"])
        self.kinds = json.loads(str(self.given["kinds"]))
        scene = laws.prepare(mujoco.MjModel.from_xml_path(str(folder / f"{name}.xml")))
        for option, most in SOLVER.items():
            setattr(scene.opt, option, most)
        self.model = mjx.put_model(scene)
        named = {key.removeprefix("field_"): key for key in self.given if key.startswith("field_")}
        known = {name for name in named if isinstance(_of(self.model, name), jax.Array)}
        self.unknown = sorted(set(named) - known)
        self.fields = {name: named[name] for name in sorted(known)}
        self.axes = jax.tree_util.tree_map(lambda _: None, self.model).tree_replace(dict.fromkeys(self.fields, 0))
        self.chunk = min(CHUNK, self.frames)
        self.rollouts = len(self.given["row"])

    def ready(self, batch: int) -> tuple[tuple[Any, ...], Any, float]:
        """Arguments for a batch of this size, the function, and the seconds that it took to trace and to compile."""
        arguments = self.arguments(batch)
        return arguments, *self.compiled(arguments)

    def arguments(self, batch: int) -> tuple[Any, ...]:
        """Of `batch` rollouts: the prepared ones, over and over."""
        which = np.arange(batch) % self.rollouts
        row = self.given["row"][which]
        real = jnp.zeros(0).dtype
        fields = {name: jnp.asarray(self.given[key][row], real) for name, key in self.fields.items()}
        numbers = jnp.asarray(self.given["numbers"][row], real)
        blank = mjx.make_data(self.model)
        begin = jax.jit(jax.vmap(lambda q, v: blank.replace(qpos=q, qvel=v)))
        data = begin(jnp.asarray(self.given["qpos"][which], real), jnp.asarray(self.given["qvel"][which], real))
        table, of = jnp.asarray(self.given["controls"], real), jnp.asarray(self.given["control"][which])
        return data, jnp.asarray(0), fields, numbers, table, of

    def compiled(self, arguments: tuple[Any, ...]) -> tuple[Any, float]:
        """The function for a batch of this size, and the seconds that it took to trace and to compile."""
        columns, terms = self.given["columns"], self.kinds

        def one(model: Any, numbers: Any, data: Any) -> Any:
            laws = [self.laws.Term(k, on, tuple(names), numbers[i]) for i, (k, on, names) in enumerate(terms)]
            return self.laws.step(model, data, laws)

        together = jax.vmap(one, in_axes=(self.axes, 0, 0))

        def step(_: Any, carry: Any, fields: Any, numbers: Any, table: Any, of: Any) -> Any:
            data, t = carry
            told = data.replace(ctrl=table[of, t])
            return together(self.model.tree_replace(fields), numbers, told), t + 1

        def chunk(data: Any, t: Any, fields: Any, numbers: Any, table: Any, of: Any) -> Any:
            def frame(carry: Any, _: Any) -> Any:
                carry = jax.lax.fori_loop(0, self.every, lambda i, c: step(i, c, fields, numbers, table, of), carry)
                return carry, carry[0].qpos[:, columns]

            (data, t), seen = jax.lax.scan(frame, (data, t), None, length=self.chunk)
            return data, t, seen

        began = time.perf_counter()
        function = jax.jit(chunk).lower(*arguments).compile()
        return function, time.perf_counter() - began


def say(**row: object) -> None:
    print(json.dumps(row), flush=True)


def play(case: Case, function: Any, arguments: tuple[Any, ...], until: float, wanted_s: float) -> tuple[Any, float]:
    """(f, B, C) frames until the window or the time ends; seconds of a step."""
    data, t, *rest = arguments
    seen, spent = [], []
    for _ in range(case.frames // case.chunk):
        began = time.perf_counter()
        data, t, some = function(data, t, *rest)
        seen.append(np.asarray(some))
        spent.append(time.perf_counter() - began)
        if time.monotonic() > until or (len(spent) > 2 and sum(spent[1:]) > wanted_s):
            break
    later = spent[1:] or spent  # the first call also loads the program
    return np.concatenate(seen), float(np.sum(later)) / (len(later) * case.chunk * case.every)


def main() -> None:
    folder, label, seconds, *sizes = sys.argv[1:]
    until = time.monotonic() + float(seconds)
    device, real = jax.devices()[0], str(jnp.zeros(0).dtype)
    precision = str(jax.config.jax_default_matmul_precision)
    say(
        label=label,
        device=device.device_kind,
        jax=jax.__version__,
        mujoco=mujoco.__version__,
        dtype=real,
        matmul=precision,
    )
    laws = loaded(LAWS)
    cases = [Case(Path(folder), path.stem, laws) for path in sorted(Path(folder).glob("*.xml"))]
    asked = [(case, -(-case.rollouts // 64) * 64, True) for case in cases]
    asked += [(case, size, False) for size in map(int, sizes) for case in cases]
    threads = ThreadPoolExecutor(4)
    coming = [threads.submit(case.ready, batch) for case, batch, _ in asked]
    for (case, batch, whole), soon in zip(asked, coming, strict=True):
        named = {"label": label, "case": case.name, "batch": batch}
        if wait([soon], max(until - time.monotonic(), 0)).not_done:
            say(**named, missing="no time left to compile it")
            continue
        if (failed := soon.exception()) is not None:
            say(**named, missing=f"{type(failed).__name__}: {failed}"[:400])
            continue
        arguments, function, compile_s = soon.result()
        with (Path(folder) / "lock").open("w", encoding="utf-8") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            if time.monotonic() > until:
                say(**named, compile_s=compile_s, missing="no time left to run it")
                continue
            try:
                seen, per_step = play(case, function, arguments, until, WINDOW_S if whole else TIMED_S)
            except jax.errors.JaxRuntimeError as error:
                say(**named, compile_s=compile_s, missing=str(error)[:400])
                continue
        if whole:
            np.savez(Path(folder) / f"{label}-{case.name}.npz", seen=seen[:, : case.rollouts].transpose(1, 0, 2))
        say(**named, compared=whole, compile_s=round(compile_s, 2), step_ms=1e3 * per_step, frames=len(seen),
            rollouts_s=batch / (per_step * case.frames * case.every), lost=int(np.isnan(seen[-1]).any(axis=-1).sum()),
            without=case.unknown)  # fmt: skip
    sys.stdout.flush()
    os._exit(0)  # what still compiles in a thread is not waited for


if __name__ == "__main__":
    main()

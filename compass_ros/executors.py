"""Everything that is many: worlds of a campaign, cases of a benchmark, recordings of a league. One interface, two ways.

    for index, answer in executor.each(task, items): ...

yields an answer as soon as it is there, with the place of its item, each item once. The caller keeps answers as they
come, so that whatever ends the caller loses none that was kept. An exception of the task is the caller's; a worker that
dies (killed, out of memory, its machine gone) is not: its item is begun again on another one.

`task` and `items` go to other processes: functions of a module, partial() of them, plain data.
"""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, ThreadPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar

from compass_ros.errors import ConfigError, DataError

Item = TypeVar("Item")
Answer = TypeVar("Answer")
ATTEMPTS = 3
"""Times that an item is begun, where its worker dies, before it is given up: what kills three kills the next one."""


class Executor(Protocol):
    """Runs a task on many items."""

    @property
    def jobs(self) -> int:
        """Items at a time."""
        ...

    def each(self, task: Callable[[Item], Answer], items: Sequence[Item]) -> Iterator[tuple[int, Answer]]:
        """(place among the items, answer), in the order in which they end."""
        ...


@dataclass(frozen=True)
class Threads:
    """For tasks that start a process of their own and wait for it: worlds of a campaign, recordings of a league."""

    jobs: int = 1

    def each(self, task: Callable[[Item], Answer], items: Sequence[Item]) -> Iterator[tuple[int, Answer]]:
        with ThreadPoolExecutor(self.jobs) as pool:
            running: dict[Future[Answer], int] = {pool.submit(task, item): i for i, item in enumerate(items)}
            try:
                for future in as_completed(running):
                    yield running[future], future.result()
            finally:
                pool.shutdown(wait=True, cancel_futures=True)


@dataclass(frozen=True)
class Processes:
    """Processes of this machine, for tasks that compute themselves. A process that dies costs what ran then."""

    jobs: int = 1

    def each(self, task: Callable[[Item], Answer], items: Sequence[Item]) -> Iterator[tuple[int, Answer]]:
        left = dict(enumerate(items))
        attempts = dict.fromkeys(left, 0)
        while left:
            dead = False
            with ProcessPoolExecutor(self.jobs, multiprocessing.get_context("spawn"), _one_thread) as pool:
                running: dict[Future[Answer], int] = {pool.submit(task, item): i for i, item in left.items()}
                try:
                    for future in as_completed(running):
                        try:
                            answer = future.result()
                        except BrokenProcessPool:
                            dead = True
                            continue
                        i = running[future]
                        del left[i]
                        yield i, answer
                finally:
                    pool.shutdown(wait=True, cancel_futures=True)
            if dead:
                _count(attempts, list(left)[: self.jobs])


@dataclass(frozen=True)
class Ray:
    """A cluster: `auto` is the one that this machine belongs to, `local` one of its own, else ray's address of a head.

    Every node has this version of the package. Items of a node that is lost go to others. Raises ConfigError where
    there is no cluster.
    """

    address: str = "auto"
    cores: float = 1
    """That an item takes."""

    @property
    def jobs(self) -> int:
        return max(int(self._connected().cluster_resources().get("CPU", 1) / self.cores), 1)

    def _connected(self) -> Any:
        import ray

        if not ray.is_initialized():
            try:
                where = None if self.address == "local" else self.address
                ray.init(where, log_to_driver=False, include_dashboard=False if where is None else None)
            except (ConnectionError, ValueError) as error:
                raise ConfigError(f"--ray {self.address}: no cluster there: {str(error).splitlines()[0]}") from error
        return ray

    def each(self, task: Callable[[Item], Answer], items: Sequence[Item]) -> Iterator[tuple[int, Answer]]:
        ray = self._connected()
        remote = ray.remote(num_cpus=self.cores, max_retries=ATTEMPTS - 1)(task_of)
        held = ray.put(task)
        running = {remote.remote(held, item): i for i, item in enumerate(items)}
        try:
            while running:
                (ended,), _ = ray.wait(list(running), num_returns=1)
                i = running.pop(ended)
                try:
                    yield i, ray.get(ended)
                except (ray.exceptions.WorkerCrashedError, ray.exceptions.OutOfMemoryError) as error:
                    raise _given_up(i) from error
        finally:
            for reference in running:
                ray.cancel(reference)


def task_of(task: Callable[[Item], Answer], item: Item) -> Answer:
    """What a worker of a cluster does."""
    return task(item)


def executor(jobs: int, ray: str, cores: float, computes: bool) -> Executor:
    """By the options of a command line; `computes`: the task itself does, it starts no process of its own."""
    if ray:
        return Ray(ray, cores)
    return Processes(jobs) if computes else Threads(jobs)


def _one_thread() -> None:
    """Linear algebra of a worker keeps to one core, as in the command line."""
    os.environ["OMP_NUM_THREADS"] = os.environ["OPENBLAS_NUM_THREADS"] = "1"
    from threadpoolctl import threadpool_limits

    threadpool_limits(1, "blas")


def _count(attempts: dict[int, int], ran: Sequence[int]) -> None:
    """Those that may have run when a process died: the first that are left, for they are begun in order."""
    for i in ran:
        attempts[i] += 1
        if attempts[i] >= ATTEMPTS:
            raise _given_up(i)


def _given_up(place: int) -> DataError:
    return DataError(f"item {place + 1}: its worker died {ATTEMPTS} times; what else had ended is kept")

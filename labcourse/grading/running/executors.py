"""Where submissions are run: on this machine, or on a cluster of dask.distributed. Both are executors."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

from labcourse.errors import GradingError

_CONNECT = 15  # s to find a scheduler and a worker; a scheduler answers within one
_TRIES = 3  # for a submission whose worker is lost, be it by no fault of its own


@dataclass(frozen=True)
class Pool:
    """An executor, how many submissions it takes at a time, and how to stop what is running."""

    executor: Executor
    capacity: int
    stop: Callable[[], None]


class _LocalExecutor(ThreadPoolExecutor):
    """Threads are enough: the work is done in the sandboxes that they wait for."""

    def __init__(self, jobs: int) -> None:
        super().__init__(jobs, thread_name_prefix="labcourse-run")
        self._cancelled = threading.Event()

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        return super().submit(fn, *args, **kwargs, cancelled=self._cancelled)

    def stop(self) -> None:
        """End what is running."""
        self._cancelled.set()


@contextlib.contextmanager
def local(jobs: int) -> Iterator[Pool]:
    """This machine, so many submissions at a time."""
    executor = _LocalExecutor(jobs)
    try:
        yield Pool(executor, jobs, executor.stop)
    finally:
        executor.stop()
        executor.shutdown(cancel_futures=True)


@contextlib.contextmanager
def cluster(scheduler: str) -> Iterator[Pool]:
    """The workers of a dask.distributed scheduler, such as ``tcp://host:8786``.

    Raises
    ------
    GradingError
        If dask is not installed, or if there is no scheduler at the address, or no worker.
    """
    try:
        from distributed import Client
    except ImportError:
        raise GradingError("A cluster needs dask: pip install 'labcourse[cluster]'.") from None
    try:
        client = Client(scheduler, timeout=_CONNECT, set_as_default=False)
    except (OSError, ValueError) as error:
        raise GradingError(f"There is no scheduler at {scheduler}: {error}") from None
    try:
        client.wait_for_workers(1, timeout=_CONNECT)
        threads = sum(client.nthreads().values())
        # Not pure: equal work for two students is done for each. Lost with its worker, it is done again elsewhere.
        executor = client.get_executor(pure=False, retries=_TRIES)
        yield Pool(executor, threads, lambda: executor.shutdown(wait=False))
    except TimeoutError:
        raise GradingError(f"The scheduler at {scheduler} has no workers.") from None
    finally:
        client.close()

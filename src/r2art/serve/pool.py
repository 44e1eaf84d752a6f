"""How many predictions run at a time, and how many requests may wait for that."""

import asyncio
import math
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from typing import TypeVar

from r2art.serve.limits import Limits
from r2art.serve.problems import Kind, ProblemError

Result = TypeVar("Result")

FIRST_GUESS = 0.1  # s, for the time of one prediction


class Pool:
    """Threads that share one model, and a bounded number of places for requests.

    A request takes a place before its body is read, and gives it back when it is answered or given
    up. A prediction that was given up goes on in its thread and keeps its photo, so the server
    holds at most as many bodies as there are places and threads together. It is used from one
    event loop, so nothing here needs a lock.
    """

    def __init__(self, limits: Limits) -> None:
        self._limits = limits
        self._taken = 0
        self._seconds = FIRST_GUESS
        self._threads = asyncio.Semaphore(limits.workers)
        self._executor = ThreadPoolExecutor(limits.workers, thread_name_prefix="predict")

    @property
    def taken(self) -> int:
        """Places taken now."""
        return self._taken

    @contextmanager
    def place(self) -> Iterator[None]:
        """Hold a place for a request.

        Raises:
            ProblemError: All are taken.
        """
        if self._taken >= self._limits.places:
            wait = self.wait()
            raise ProblemError(
                Kind.BUSY,
                f"all {self._limits.places} places are taken",
                f"try again in {wait} s",
                {"Retry-After": str(wait)},
            )
        self._taken += 1
        try:
            yield
        finally:
            self._taken -= 1

    def wait(self) -> int:
        """In how many seconds a place should be free: the time of a prediction, times those due."""
        return math.ceil(self._seconds * (self._taken + 1) / self._limits.workers)

    async def run(self, work: Callable[[], Result]) -> Result:
        """The result of ``work``, done in a thread as soon as one is free.

        Cancelled before, the work is never begun. Cancelled later, it goes on in its thread,
        which counts as busy until it has ended, for threads cannot be stopped.
        """
        await self._threads.acquire()
        loop = asyncio.get_running_loop()
        start = time.perf_counter()
        try:
            future = self._executor.submit(work)
        except BaseException:
            self._threads.release()
            raise

        def free() -> None:
            self._threads.release()
            self._seconds += 0.1 * (time.perf_counter() - start - self._seconds)

        def ended(_: Future[Result]) -> None:
            loop.call_soon_threadsafe(free)

        future.add_done_callback(ended)
        return await asyncio.wrap_future(future)

    def close(self) -> None:
        """Wait for the threads and end them."""
        self._executor.shutdown()

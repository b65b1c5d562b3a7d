# SPDX-License-Identifier: MIT OR Apache-2.0
"""The thread that registers windows while others feed and read."""

from __future__ import annotations

from collections import deque
from threading import Condition, Thread, current_thread
from typing import TYPE_CHECKING

from bentwing.base.errors import UsageError
from bentwing.base.log import get_logger
from bentwing.flight.live.state import REST, Published

if TYPE_CHECKING:
    from collections.abc import Callable

    from bentwing.flight.live.live_map import LiveMap
    from bentwing.flight.live.state import LiveState
    from bentwing.flight.live.watchdog import Watchdog
    from bentwing.odometry.interface import Estimator
    from bentwing.recording.batches import Batch
    from bentwing.recording.preprocess import Preprocessing

_log = get_logger(__name__)

# The search for the start looks at all that was fed; new data is worth it this often, s.
START_INTERVAL = 0.25


class Worker:
    """Takes batches from a queue, registers windows as they become complete, and publishes them.

    Parameters
    ----------
    engine, preprocessing : owned by the thread from now on
    state : where windows are published
    watchdog : ends the estimate if it is certainly wrong
    new_map : makes the map of a pass
    """

    def __init__(
        self,
        engine: Estimator,
        preprocessing: Preprocessing,
        state: LiveState,
        watchdog: Watchdog,
        new_map: Callable[[], LiveMap],
    ) -> None:
        self._engine = engine
        self._preprocessing = preprocessing
        self._state = state
        self._watchdog = watchdog
        self._new_map = new_map
        # The pass that is mapped, by its number; of none there is nothing to publish yet.
        self._mapped = 0
        self._is_waiting = True
        self._cloud = new_map()
        self._searched = -float("inf")
        self._queue: deque[Batch] = deque()
        self._changed = Condition()
        self._idle = False
        self._finishing = self._stopping = False
        self.error: BaseException | None = None
        self._thread = Thread(target=self._run, name="bentwing-odometry", daemon=True)
        self._thread.start()

    def put(self, batch: Batch) -> None:
        """Hand over a batch; what is wrong with the thread is raised here."""
        with self._changed:
            self._require_open()
            self._queue.append(batch)
            self._idle = False
            self._changed.notify_all()

    def wait(self, timeout: float | None) -> bool:
        """Wait until all that can be registered is; returns whether it is."""
        with self._changed:
            reached = self._changed.wait_for(lambda: self._idle, timeout)
            self.require_health()
            return reached

    def finish(self) -> None:
        """Register also the last, shorter window, and end the thread."""
        with self._changed:
            self._require_open()
            self._finishing = True
            self._changed.notify_all()
        self._thread.join()
        self.require_health()

    def stop(self) -> None:
        """End the thread after the window it is at; the rest of the queue is left."""
        with self._changed:
            self._stopping = True
            self._changed.notify_all()
        if current_thread() is not self._thread:  # which may collect the owner's garbage
            self._thread.join()

    def require_health(self) -> None:
        """Raise what the thread has ended with."""
        if self.error is not None:
            raise self.error

    def _require_open(self) -> None:
        self.require_health()
        if self._stopping or self._finishing:
            msg = "the odometry is closed; make a new one"
            raise UsageError(msg)

    def _run(self) -> None:
        try:
            while (batches := self._next()) is not None:
                self._take(batches)
                self._register()
            if self._finishing and not self._stopping:
                for batch in self._preprocessing.finish():
                    self._engine.take(batch)
                self._register(finishing=True)
        except BaseException as error:  # raised in the threads that feed and read
            self.error = error
            _log.error("live odometry has failed", exc_info=error)
        finally:
            with self._changed:
                self._idle = True
                self._changed.notify_all()

    def _next(self) -> deque[Batch] | None:
        with self._changed:
            while not self._queue and not self._stopping and not self._finishing:
                self._idle = True
                self._changed.notify_all()
                self._changed.wait()
            if self._stopping or not self._queue:
                return None
            return self._taken()

    def _taken(self) -> deque[Batch]:
        batches, self._queue = self._queue, deque()
        return batches

    def _take(self, batches: deque[Batch]) -> None:
        for batch in batches:
            for usable in self._preprocessing.add(batch):
                self._watchdog.add(usable)
                self._engine.take(usable)

    def _register(self, *, finishing: bool = False) -> None:
        self._watchdog.require_health(lambda: self._engine.current)
        if not finishing and self._is_waiting and not self._search():
            return
        while not self._stopping and self._engine.advance(finishing=finishing):
            self._publish()
            with self._changed:
                batches = self._taken()
            self._take(batches)

    def _search(self) -> bool:
        """Forget most of a long rest; returns whether enough is new to look for its end."""
        span = self._engine.buffer.lidar_span
        if span is None or span[1] < self._searched + START_INTERVAL:
            return False
        self._searched = span[1]
        self._engine.buffer.forget(span[1] - REST)
        return True

    def _publish(self) -> None:
        now = self._engine.current
        self._is_waiting = now is None
        if now is None:
            return
        if self._mapped != now.n_passes:
            self._mapped, self._cloud = now.n_passes, self._new_map()
        self._cloud.add(now.registered, self._engine.buffer)
        self._state.publish(Published(now, self._cloud))

# SPDX-License-Identifier: MIT OR Apache-2.0
"""Read what comes next while what has come is worked on."""

from __future__ import annotations

from queue import Full, Queue
from threading import Event, Thread
from typing import TYPE_CHECKING, Generic, TypeVar

if TYPE_CHECKING:
    from collections.abc import Generator

_Item = TypeVar("_Item")

# A reader whose consumer has gone notices within this time, s.
_PATIENCE = 0.1


def read_ahead(items: Generator[_Item, None, None], most: int) -> Generator[_Item, None, None]:
    """Pass on what another thread takes from `items`, in its order, at most `most` of them ahead.

    What `items` raises is raised here, behind the items before it. When the consumer stops, the
    thread has ended and `items` is closed.
    """
    reader = _Reader(items, most)
    reader.start()
    try:
        yield from iter(reader.queue.get, None)
        if reader.error is not None:
            raise reader.error
    finally:
        reader.unwanted.set()
        reader.join()


class _Reader(Thread, Generic[_Item]):
    def __init__(self, items: Generator[_Item, None, None], most: int) -> None:
        super().__init__(name="bentwing-reader", daemon=True)
        self.queue: Queue[_Item | None] = Queue(most)
        self.unwanted = Event()
        self.error: BaseException | None = None
        self._items = items

    def run(self) -> None:
        try:
            for item in self._items:
                if not self._put(item):
                    break
        except BaseException as error:  # raised where the items are taken
            self.error = error
        finally:
            self._items.close()
            self._put(None)

    def _put(self, item: _Item | None) -> bool:
        """Wait for room; returns whether the item is still wanted."""
        while not self.unwanted.is_set():
            try:
                self.queue.put(item, timeout=_PATIENCE)
            except Full:
                continue
            return True
        return False

# SPDX-License-Identifier: MIT OR Apache-2.0
"""Reading ahead: the same items, errors in their place, and no thread left behind."""

from __future__ import annotations

import threading
import time

import pytest

from bentwing.recording.preprocess.read_ahead import read_ahead

MOST = 4


class Source:
    """Numbers, and what becomes of their generator."""

    def __init__(self, n, error=None):
        self.n, self.error = n, error
        self.n_given, self.is_closed = 0, False

    def items(self):
        try:
            for i in range(self.n):
                self.n_given += 1
                yield i
            if self.error is not None:
                raise self.error
        finally:
            self.is_closed = True


def reading_threads():
    return [t for t in threading.enumerate() if t.name == "bentwing-reader"]


@pytest.mark.parametrize("n", [0, 1, MOST, 100])
def test_all_items_come_in_order(n):
    source = Source(n)
    assert list(read_ahead(source.items(), MOST)) == list(range(n))
    assert source.is_closed
    assert not reading_threads()


def test_an_error_comes_behind_the_items_before_it():
    stream, taken = read_ahead(Source(10, OSError("torn")).items(), MOST), []
    taken += [next(stream) for _ in range(10)]
    with pytest.raises(OSError, match="torn"):
        next(stream)
    assert taken == list(range(10))


def test_it_reads_no_further_ahead_than_asked():
    source = Source(100)
    stream = read_ahead(source.items(), MOST)
    assert next(stream) == 0
    time.sleep(0.3)
    # The one taken, those waiting, and the one that finds no room.
    assert source.n_given == 1 + MOST + 1
    stream.close()


def test_a_consumer_that_stops_ends_the_thread_and_closes_the_source():
    source = Source(100)
    for item in read_ahead(source.items(), MOST):
        if item == 3:
            break
    assert not reading_threads()
    assert source.is_closed

# SPDX-License-Identifier: MIT OR Apache-2.0
"""Interrupts that wait."""

from __future__ import annotations

import signal
from concurrent.futures import ThreadPoolExecutor

import pytest

from bentwing.base.interrupts import postponed


@pytest.fixture
def interruptible():
    """Let an interrupt raise, also where whoever started the tests ignores it."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("interruptible")
def test_an_interrupt_waits_for_the_end_of_the_block():
    done = []

    def interrupted():
        with postponed():
            signal.raise_signal(signal.SIGINT)
            done.append("what must not be left half done")

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert done
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_an_interrupt_that_is_ignored_stays_so():
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        with postponed():
            signal.raise_signal(signal.SIGINT)
        assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGINT, before)


def test_other_threads_have_nothing_to_put_off():
    def run():
        with postponed():
            return signal.getsignal(signal.SIGINT)

    before = signal.getsignal(signal.SIGINT)
    with ThreadPoolExecutor(1) as threads:
        assert threads.submit(run).result() is before

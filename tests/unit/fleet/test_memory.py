# SPDX-License-Identifier: MIT OR Apache-2.0
"""The memory that is planned, and what follows from it."""

from __future__ import annotations

import os

import pytest

from bentwing.closing.global_registration import GlobalSettings
from bentwing.fleet import memory
from bentwing.fleet.memory import available_mb, megabytes_of, n_side_by_side
from bentwing.fleet.pool import threads_among


def test_larger_recordings_take_more_up_to_a_limit_that_the_settings_move():
    few, many = GlobalSettings(memory_mb=1000), GlobalSettings(memory_mb=4000)
    sizes = [0, 10**7, 10**8, 10**12]
    planned = [megabytes_of(size, few) for size in sizes]
    assert planned == sorted(planned)
    assert planned[0] > 0
    assert megabytes_of(10**12, many) - planned[-1] == pytest.approx(3000)


@pytest.mark.parametrize(
    ("free", "n_jobs", "wanted", "n"),
    [(8000, 9, 4, 4), (2500, 9, 4, 2), (100, 9, 4, 1), (8000, 1, 4, 1), (8000, 0, None, 1)],
)
def test_as_much_runs_at_the_same_time_as_memory_allows(monkeypatch, free, n_jobs, wanted, n):
    monkeypatch.setattr(memory, "available_mb", lambda: free)
    assert n_side_by_side(1000.0, n_jobs, wanted) == n


def test_two_run_at_the_same_time_unless_more_are_asked_for(monkeypatch):
    monkeypatch.setattr(memory, "available_mb", lambda: 1e6)
    monkeypatch.setattr(os, "cpu_count", lambda: 64)
    assert n_side_by_side(1000.0, 9, None) == 2


def test_the_limit_of_a_container_counts(monkeypatch):
    monkeypatch.setattr(memory, "_free_of_group", lambda: 5e8)
    assert available_mb() == pytest.approx(500)


@pytest.mark.parametrize(
    ("n_workers", "n_jobs", "asked", "threads"),
    [(2, 9, None, 4), (2, 1, None, 8), (16, 16, None, 1), (2, 9, 3, 3)],
)
def test_what_runs_at_the_same_time_shares_the_cores(
    monkeypatch, n_workers, n_jobs, asked, threads
):
    monkeypatch.setattr(os, "cpu_count", lambda: 8)
    assert threads_among(n_workers, n_jobs, asked) == threads

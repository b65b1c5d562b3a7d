# SPDX-License-Identifier: MIT OR Apache-2.0
"""Whatever the stamps, a clock keeps their order, invents none and stays with what it says."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from support.host_stamps import NS, START_NS, host_stamps, steadied

shared = settings(deadline=None, max_examples=40)
hosts = st.fixed_dictionaries(
    {
        "jitter": st.floats(0.0, 5e-3),
        "late": st.floats(0.0, 0.3),
        "latest": st.floats(0.0, 0.2),
        "step": st.sampled_from([0.0, 1e-6, 1e-3, 4e-3]),
        "drift": st.floats(-5e-4, 5e-4),
        "lost": st.floats(0.0, 0.3),
        "gap": st.none() | st.tuples(st.floats(2.0, 6.0), st.floats(6.0, 8.0)),
    }
)


@shared
@given(st.integers(0, 2**32), st.sampled_from([0.004, 0.01, 0.05, 0.13]), hosts)
def test_stamps_of_any_host_keep_their_order_and_move_by_no_more_than_is_said(seed, period, host):
    _, stamps_ns = host_stamps(np.random.default_rng(seed), period, 12.0, **host)
    found_ns, clock = steadied(stamps_ns)
    found = clock.findings
    assert np.all((np.diff(found_ns) > 0) | (found_ns[1:] == stamps_ns[1:]))
    moved = (stamps_ns - found_ns) / NS
    assert np.count_nonzero(moved) <= found.n_corrected + 1
    assert moved.max(initial=0.0) <= found.latest + 1e-8
    assert found.n == len(stamps_ns)


@shared
@given(
    st.lists(
        st.one_of(
            st.integers(0, 3), st.integers(0, 10**6), st.integers(0, 10**8), st.integers(0, 10**11)
        ),
        max_size=300,
    )
)
def test_any_stamps_keep_their_order_and_number(steps):
    stamps_ns = START_NS + np.cumsum(np.array(steps, dtype=np.int64))
    found_ns, clock = steadied(stamps_ns)
    assert len(found_ns) == len(stamps_ns)
    assert np.all(np.diff(found_ns) >= 0)
    assert clock.findings.n_corrected <= len(stamps_ns)


@shared
@given(st.integers(10**6, 10**9), st.integers(40, 400), st.floats(0.0, 0.05), st.integers(0, 2**32))
def test_stamps_of_a_perfect_clock_stay_whatever_is_lost(period_ns, n, lost, seed):
    numbers = np.flatnonzero(np.random.default_rng(seed).random(n) >= lost)
    stamps_ns = START_NS + period_ns * numbers
    assert np.array_equal(steadied(stamps_ns)[0], stamps_ns)

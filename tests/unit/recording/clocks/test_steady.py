# SPDX-License-Identifier: MIT OR Apache-2.0
from __future__ import annotations

import numpy as np
import pytest

from support.host_stamps import NS, START_NS, errors, host_stamps, steadied

BAD = {"jitter": 1.2e-3, "late": 0.03, "latest": 0.024}


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


@pytest.mark.parametrize(
    ("period", "more"),
    [
        (0.005, {"lost": 0.0015}),  # an IMU: lateness of five periods
        (0.01, {"lost": 0.01, "step": 7.5e-4, "drift": 1e-4}),
        (0.025, {"lost": 0.01, "step": 1e-3, "drift": -9e-5}),
        (0.1, {"lost": 0.01, "drift": 5e-5}),
    ],
)
def test_a_bad_host_leaves_a_tenth_of_its_jitter(period, more):
    times, stamps_ns = host_stamps(
        np.random.default_rng(5), period, 40.0, **BAD, **more, gap=(13.0, 13.08)
    )
    found_ns, clock = steadied(stamps_ns)
    before, after = errors(times, stamps_ns), errors(times, found_ns)
    # A line through N stamps is known to jitter/√N, at its end to twice that: N is 50 and more.
    usual = np.abs(after) < 1e-3
    assert rms(before) > 2.5e-3
    assert (
        usual.mean() > 0.99
    )  # what is late and followed by a loss cannot be told from the next one
    assert rms(after[usual]) < 2.0 * 1.2e-3 / np.sqrt(min(50.0 / (10 * period), 1000))
    assert clock.findings.jitter == pytest.approx(1.2e-3, rel=0.15)
    assert 0.02 < clock.findings.n_late / len(times) < 0.1


@pytest.mark.parametrize("jitter", [0.0, 2e-5, 1e-4])
@pytest.mark.parametrize("period", [0.005, 0.025, 0.1])
def test_good_stamps_stay_as_they_are_to_the_bit(period, jitter):
    _, stamps_ns = host_stamps(np.random.default_rng(2), period, 30.0, jitter=jitter, lost=0.003)
    assert np.array_equal(steadied(stamps_ns)[0], stamps_ns)


def test_two_tenths_of_a_millisecond_are_jitter_that_is_removed():
    times, stamps_ns = host_stamps(np.random.default_rng(3), 0.1, 60.0, jitter=2e-4)
    found_ns, _ = steadied(stamps_ns)
    assert rms(errors(times, stamps_ns)) > 1.8e-4
    assert rms(errors(times, found_ns)) < 4e-5


def test_a_rotor_that_is_fast_and_slow_keeps_its_stamps():
    rng = np.random.default_rng(4)
    # Its phase walks; the stamps are right.
    steps = 0.1 + np.convolve(rng.normal(0.0, 4e-4, 400), np.ones(8) / 8, "same")
    stamps_ns = START_NS + np.rint(np.cumsum(steps) * NS).astype(np.int64)
    assert np.array_equal(steadied(stamps_ns)[0], stamps_ns)


def test_sweeps_cut_between_packets_keep_the_stamps_that_their_points_confirm():
    packet, n = 1.327e-3, 400
    starts = np.ceil(np.arange(n) * 0.1 / packet) * packet  # up to a packet off the period
    stamps_ns = START_NS + np.rint(starts * NS).astype(np.int64)
    spans = np.append(np.diff(starts), 0.1) - 5e-5
    assert np.array_equal(steadied(stamps_ns, spans=spans)[0], stamps_ns)
    unknown, _ = steadied(stamps_ns)
    assert not np.array_equal(unknown, stamps_ns)  # the same stamps are taken for jitter without


def test_stamps_without_a_rule_stay_as_they_are():
    steps = np.random.default_rng(6).uniform(0.01, 0.2, 500)
    stamps_ns = START_NS + np.rint(np.cumsum(steps) * NS).astype(np.int64)
    found_ns, clock = steadied(stamps_ns)
    assert np.array_equal(found_ns, stamps_ns)
    assert str(clock.findings) == "not periodic, every stamp as it is"


@pytest.mark.parametrize("step", [0.004, -0.002, 0.3])
def test_a_step_of_the_clock_is_kept(step):
    times, stamps_ns = host_stamps(np.random.default_rng(7), 0.025, 30.0, jitter=4e-4)
    after = times > 15.0
    stamps_ns[after] += round(step * NS)
    found_ns, _ = steadied(stamps_ns)
    off = errors(times, found_ns)
    assert np.median(off[after]) - np.median(off[~after]) == pytest.approx(step, abs=1e-4)
    # Nothing is drawn across the step: around it stamps are at worst what they were.
    assert np.abs(found_ns - stamps_ns).max() < 4e-3 * NS


def test_a_change_of_the_rate_is_followed():
    rng = np.random.default_rng(8)
    steps = np.repeat([0.05, 0.1], [400, 200])
    times = np.cumsum(steps)
    stamps_ns = START_NS + np.rint((times + 6e-4 * rng.gamma(4.0, 0.5, 600)) * NS).astype(np.int64)
    found_ns, _ = steadied(stamps_ns)
    assert rms(errors(times, found_ns)) < rms(errors(times, stamps_ns))
    far = np.abs(times - times[400]) > 3.0
    assert rms(errors(times, found_ns)[far]) < 2e-4


def test_messages_that_overtook_each_other_are_put_in_order():
    _, stamps_ns = host_stamps(np.random.default_rng(9), 0.005, 20.0, jitter=1.2e-3)
    arrived = stamps_ns.copy()
    arrived[[1001, 1000]] = stamps_ns[[1000, 1001]]
    _, clock = steadied(stamps_ns)
    from bentwing.recording.clocks.steady import SteadyClock

    other = SteadyClock()
    backs = [other.foresee(int(stamp_ns)) for stamp_ns in arrived]
    assert backs[1001] == 1
    assert sum(backs) == 1
    assert [other.steadied(int(s)) for s in stamps_ns][:1000]
    assert clock.findings.n == len(stamps_ns)

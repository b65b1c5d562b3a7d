# SPDX-License-Identifier: MIT OR Apache-2.0
"""Clouds without times get them from where the rotor was, whatever their order and their cut."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from bentwing.recording.sweep_stamps import SweepStamps
from bentwing.recording.turn_finding import Sweep, find_turn

PERIOD, N_STAMPS = 0.1, 100
N_RINGS, N_FIRINGS = 16, 600
ELEVATIONS = np.radians(np.linspace(-15, 15, N_RINGS))
NS = 1_000_000_000
RESOLVED = 2e-4  # s, a firing and a bit


@dataclass
class Lidar:
    """A turning lidar in a room: which way, where its clouds begin, and how they are ordered."""

    sense: int = -1
    cut: float = 0.7
    drift: float = 0.0
    span: float = 2 * np.pi
    aside: float = 0.0
    order: str = "firing"
    has_rings: bool = True
    blind: tuple[float, float] = (0.0, 0.0)

    def cloud(self, number):
        """Return a sweep and the true times of its points after its beginning, s."""
        turned = np.linspace(0.0, self.advance, N_FIRINGS, endpoint=False)
        begin = self.cut + number * self.advance
        firing, ring = (each.ravel() for each in np.indices((N_FIRINGS, N_RINGS)))
        aside = self.aside * np.where(ring % 2, 1.0, -1.0)
        azimuth = self.sense * (begin + turned[firing] + aside)
        ranges = 4.0 / np.maximum(np.abs(np.cos(azimuth)), np.abs(np.sin(azimuth)))
        flat = ranges * np.cos(ELEVATIONS[ring])
        points = np.column_stack(
            [flat * np.cos(azimuth), flat * np.sin(azimuth), ranges * np.sin(ELEVATIONS[ring])]
        )
        low, high = self.blind
        seen = ~((turned[firing] >= low) & (turned[firing] < high))
        times = PERIOD * turned[firing] / self.advance
        index = np.flatnonzero(seen)
        if self.order == "rings":
            index = index[np.argsort(ring[index], kind="stable")]
        if self.order == "shuffled":
            index = np.random.default_rng(number).permutation(index)
        groups = ring[index].astype(np.uint16) if self.has_rings else None
        return Sweep(points[index], groups), times[index]

    @property
    def advance(self):
        return self.span + self.drift


def stamps_of(delay=0.105, jitter=0.001, *, reference=None, period=PERIOD, seed=0):
    rng = np.random.default_rng(seed)
    headers = (np.arange(N_STAMPS) * period * NS).astype(np.int64) + NS
    arrivals = headers + ((delay + rng.exponential(jitter, N_STAMPS)) * NS).astype(np.int64)
    return SweepStamps.of(headers.tolist(), arrivals.tolist(), reference)


def off(lidar, stamps=None, n=8):
    """Return the reading and what its times are off, s, relative to the cloud's first point."""
    clouds = [lidar.cloud(k) for k in range(n)]
    reading = find_turn([sweep for sweep, _ in clouds], stamps or stamps_of())
    assert not isinstance(reading, str), reading
    made = [reading.offsets(*sweep) - reading.first for sweep, _ in clouds]
    return reading, np.concatenate(made) - np.concatenate([true for _, true in clouds])


LIDARS = {
    "clockwise": Lidar(),
    "counter-clockwise": Lidar(sense=1, cut=-2.9),
    "cut at the seam of the azimuth": Lidar(cut=np.pi),
    "cut by packets, so that it drifts": Lidar(drift=0.02),
    "drifting backwards": Lidar(drift=-0.015, sense=1),
    "thirds of a turn": Lidar(span=2 * np.pi / 3),
    "ring by ring": Lidar(order="rings"),
    "ring by ring, drifting": Lidar(order="rings", drift=0.02),
    "without rings": Lidar(has_rings=False),
    "without rings, drifting": Lidar(has_rings=False, drift=0.02),
    "ring by ring without their numbers": Lidar(order="rings", has_rings=False),
    "beams that look aside": Lidar(aside=np.radians(3.0)),
    "a blind third amid the cloud": Lidar(blind=(2.0, 4.1)),
}


@pytest.mark.parametrize("lidar", LIDARS.values(), ids=LIDARS)
def test_times_follow_the_rotor(lidar):
    reading, error = off(lidar)
    assert reading.sense == lidar.sense
    assert np.abs(error).max() < 2 * RESOLVED
    assert reading.turn == pytest.approx(PERIOD * 2 * np.pi / lidar.advance, rel=2e-3)


def test_where_the_order_does_not_tell_how_beams_look_aside_the_error_says_so():
    reading, error = off(Lidar(aside=np.radians(3.0), order="rings"))
    assert 0.25 * reading.error < np.std(error) < 3 * reading.error
    assert off(Lidar(aside=np.radians(3.0)))[0].error < 0.2 * reading.error


def test_where_nothing_returns_at_the_cut_all_are_off_at_most_by_that():
    reading, error = off(Lidar(blind=(0.0, 0.5)))
    assert np.ptp(error) < RESOLVED
    assert reading.unseen == pytest.approx(0.5, abs=0.02)
    assert abs(error.mean()) < reading.unseen * PERIOD / (2 * np.pi)
    assert "all may be off by up to 8 ms" in str(reading)


@pytest.mark.parametrize("blind", [(0.0, 0.5), (5.8, 6.4)])
def test_where_nothing_returns_at_the_cut_it_is_at_a_quarter_of_the_turn_if_it_can(blind):
    _, error = off(Lidar(cut=0.5 * np.pi, blind=blind))
    assert abs(error).max() < 2 * RESOLVED


def test_a_cloud_whose_beginning_does_not_return_keeps_its_times():
    """As above a flyer of which one cloud looks into the sky where it is cut."""
    lidar = Lidar()
    reading, _ = off(lidar)
    sweep, times = lidar.cloud(3)
    late = times > 0.02
    made = reading.offsets(sweep.points[late], sweep.groups[late]) - reading.first
    assert np.abs(made - times[late]).max() < RESOLVED


def moved(sweep):
    """Return a cloud in the frame of a carrier on which the lidar is tilted."""
    c, s = np.cos(0.3), np.sin(0.3)
    return Sweep(sweep.points @ np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]).T, sweep.groups)


def camera(sweep):
    """Return what a camera of depth gives, row by row."""
    azimuth = np.arctan2(sweep.points[:, 1], sweep.points[:, 0])
    seen = np.abs(azimuth) < 0.6
    return Sweep(sweep.points[seen], sweep.groups[seen])


@pytest.mark.parametrize(
    ("lidar", "change", "reason"),
    [
        (Lidar(order="shuffled"), None, "order of the points"),
        (Lidar(order="shuffled", has_rings=False), None, "order of the points"),
        (Lidar(), moved, "own frame"),
        (Lidar(order="rings"), camera, "of a turn only"),
    ],
)
def test_clouds_that_do_not_show_a_turn_get_no_times(lidar, change, reason):
    sweeps = [lidar.cloud(k)[0] for k in range(8)]
    found = find_turn([change(sweep) for sweep in sweeps] if change else sweeps, stamps_of())
    assert isinstance(found, str)
    assert reason in found


def test_one_cloud_alone_gets_no_times():
    found = find_turn([Lidar().cloud(0)[0]], SweepStamps((0.0,), (0.1,)))
    assert "too few" in found


@pytest.mark.parametrize("order", ["shuffled", "rings", "firing"])
def test_clouds_that_begin_anywhere_get_no_times(order):
    rng = np.random.default_rng(3)
    sweeps = [Lidar(cut=cut, order=order).cloud(0)[0] for cut in rng.uniform(0, 2 * np.pi, 8)]
    assert isinstance(find_turn(sweeps, stamps_of()), str)


@pytest.mark.parametrize("seed", range(20))
def test_any_points_get_finite_times_or_a_reason(seed):
    rng = np.random.default_rng(seed)
    sweeps = []
    for _ in range(rng.integers(1, 9)):
        n = int(rng.integers(0, 600))
        points = rng.normal(0.0, 1.0, (n, 3)) * 10.0 ** rng.integers(-6, 6)
        points[: n // 4] = points[:1]
        rings = rng.integers(0, rng.integers(1, 60_000), n).astype(np.uint16)
        sweeps.append(Sweep(points, rings if seed % 2 else None))
    found = find_turn(sweeps, stamps_of(seed=seed))
    if isinstance(found, str):
        assert found
    else:
        assert all(np.isfinite(found.offsets(*sweep)).all() for sweep in sweeps)


def test_an_empty_cloud_has_no_times():
    reading, _ = off(Lidar())
    assert len(reading.offsets(np.zeros((0, 3)), np.zeros(0, np.uint16))) == 0


@pytest.mark.parametrize(
    ("stamps", "reference", "evidence"),
    [
        (stamps_of(0.102), "start", "recorder"),
        (stamps_of(0.002), "end", "recorder"),
        (stamps_of(0.0, 0.0), "start", "assumed"),
        (stamps_of(-0.01), "start", "assumed"),
        (stamps_of(4e6), "start", "assumed"),
        (stamps_of(0.002, reference="middle"), "middle", "payload"),
    ],
)
def test_the_recorder_tells_which_moment_the_stamp_is(stamps, reference, evidence):
    reading, _ = off(Lidar(), stamps)
    assert (reading.reference, reading.evidence) == (reference, evidence)
    share = {"start": 0.0, "middle": 0.5, "end": 1.0}[reference]
    assert reading.first == pytest.approx(-share * PERIOD, abs=1e-4)


def test_the_stamps_of_a_recorder_are_those_of_the_end():
    stamps = SweepStamps.of([0] * 4, [NS * k for k in range(1, 5)], None)
    assert stamps.meaning(1.0) == ("end", "recorder")


def test_a_period_is_found_through_jitter_and_lost_clouds():
    rng = np.random.default_rng(1)
    kept = np.sort(rng.choice(np.arange(120), 100, replace=False))
    headers = (kept * PERIOD + rng.gamma(2.0, 0.001, 100)) * NS
    stamps = SweepStamps.of(headers.astype(np.int64).tolist(), [1] * 100, None)
    assert stamps.period == pytest.approx(PERIOD, rel=2e-4)


def test_the_sentence_says_what_was_found_and_what_is_assumed():
    reading, _ = off(Lidar(), stamps_of(0.0, 0.0))
    assert str(reading) == (
        "time per point made from the azimuth, as the clouds have none: the lidar turns clockwise "
        "seen from above, once in 100.00 ms; the stamp is taken for that of a cloud's first point "
        "(assumed; if it is another moment, lidar.time_reference in the payload says so); likely "
        "error 0.05 ms"
    )

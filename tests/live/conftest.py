# SPDX-License-Identifier: MIT OR Apache-2.0
"""The first seconds of a flight through an office, as the sensors deliver them."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from bentwing import Odometry
from bentwing.base.trajectory import read_tum
from bentwing.odometry.continuous.settings import ContinuousSettings
from bentwing.recording import (
    Encoder,
    EncoderBatch,
    ImuBatch,
    LidarBatch,
    Payload,
    Recording,
    Transform,
)
from bentwing.simulate import Scenario, simulate
from support.live import offline

LENGTH = 12.0  # s; the rest at the start is over after four
THINNING = 3  # every third point, for speed
SCAN = 0.025  # s
# The first four seconds of motion are run twice.
QUICK = ContinuousSettings(window=3.0, registration={"max_outer": 2})


def read_flight(folder, length=LENGTH, thinning=THINNING):
    """The payload, the batches and the truth of a simulated recording, and their pieces."""
    payload = Payload.load(folder / "payload.yaml")
    with Recording(folder / "recording.bag", payload) as recording:
        batches = [
            b.where(slice(None, None, thinning)) if isinstance(b, LidarBatch) else b
            for b in recording.batches(0.0, length)
        ]
        truth, _ = read_tum(folder / "truth_trajectory.txt", recording.clock.start_ns)
    pieces = sorted((piece for batch in batches for piece in cut(batch)), key=lambda b: b.times[-1])
    return SimpleNamespace(payload=payload, batches=batches, pieces=pieces, truth=truth)


def cut(batch):
    """A batch as the drivers deliver it: single inertial samples, scans."""
    if isinstance(batch, LidarBatch):
        rows = np.searchsorted(batch.times, np.arange(batch.times[0], batch.times[-1], SCAN)[1:])
    else:
        rows = np.arange(1, len(batch.times))
    ends = [*rows.tolist(), len(batch.times)]
    return [part(batch, slice(a, b)) for a, b in zip([0, *ends[:-1]], ends, strict=True) if b > a]


def part(batch, rows):
    """Some rows of a batch."""
    if isinstance(batch, LidarBatch):
        return batch.where(rows)
    if isinstance(batch, ImuBatch):
        return ImuBatch(batch.times[rows], batch.gyro[rows], batch.accel[rows])
    return EncoderBatch(batch.times[rows], batch.angles[rows])


def estimated(flight, settings=QUICK):
    """What the continuous estimator says of a flight."""
    return offline(flight, "continuous", settings)


def bytes_of(estimate):
    """What must not depend on how the data came."""
    t = estimate.trajectory
    return [a.tobytes() for a in (t.times, t.positions, t.quats_xyzw)] + [estimate.windows]


@pytest.fixture(scope="session", name="read_flight")
def read_flight_fixture():
    """Return the reader of simulated recordings."""
    return read_flight


@pytest.fixture(scope="session", name="offline")
def offline_fixture():
    """Return the offline estimate of a flight."""
    return estimated


@pytest.fixture(scope="session")
def all_bytes():
    """Return what must not depend on how the data of an estimate came."""
    return bytes_of


@pytest.fixture(scope="session")
def quick():
    """Settings of all flights."""
    return QUICK


@pytest.fixture(scope="session")
def flight(simulated):
    """Twelve seconds of a flight."""
    return read_flight(simulated("office", 22.0))


@pytest.fixture(scope="session")
def turning(made_once):
    """The first seconds of a flight with a 3D lidar that turns once a second."""
    scenario = Scenario(scene="office", head="vlp16-motor", motor_rate=6.2832, duration=22.0)
    folder = made_once("live-turning", lambda out: simulate(scenario, out))
    return read_flight(folder, length=9.0, thinning=1)


@pytest.fixture(scope="session")
def turned_payload(flight):
    """The same lidar on a motor, with the inertial sensor on the body."""
    encoder = Encoder(T_imu_motor=Transform(), T_motor_lidar=Transform())
    return flight.payload.model_copy(update={"encoder": encoder, "T_imu_lidar": None})


@pytest.fixture(scope="session")
def estimate(flight):
    """What the estimator says of it when all of it is there."""
    return estimated(flight)


@pytest.fixture
def new(flight):
    """Return a maker of odometries that are closed after the test."""
    made = []

    def make(payload=None, **options):
        options = {"settings": QUICK, "threads": 1, "max_lag": np.inf} | options
        made.append(Odometry(payload or flight.payload, **options))
        return made[-1]

    yield make
    for odometry in made:
        odometry.close()


@pytest.fixture(scope="session")
def flown(flight):
    """An odometry that was fed the flight in pieces, each registered before the next, and its poses."""
    seen = []
    with Odometry(flight.payload, settings=QUICK, threads=1) as odometry:
        for piece in flight.pieces:
            odometry.feed(piece)
            assert odometry.wait(60.0)
            if odometry.status != "waiting" and isinstance(piece, ImuBatch):
                seen.append((odometry.pose(), odometry.status))
        final = odometry.finish()
    return SimpleNamespace(odometry=odometry, poses=seen, final=final)

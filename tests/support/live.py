# SPDX-License-Identifier: MIT OR Apache-2.0
"""A flight through an estimator: at once, and as the sensors deliver it."""

from __future__ import annotations

from collections import Counter
from types import SimpleNamespace

from bentwing import Odometry
from bentwing.odometry import create
from bentwing.recording import ImuBatch
from bentwing.recording.preprocess import preprocess


def offline(flight, name, settings, payload=None):
    """What an estimator says of a flight."""
    payload = payload or flight.payload
    engine = create(name, payload, settings, 1)
    for batch in preprocess(flight.batches, payload, Counter()):
        engine.feed(batch)
    return engine.result()


def fly(flight, name, settings):
    """What an odometry that was fed in pieces said meanwhile, halfway to its result, and in the end."""
    said = []
    with Odometry(flight.payload, estimator=name, settings=settings) as odometry:
        for i, piece in enumerate(flight.pieces):
            odometry.feed(piece)
            if isinstance(piece, ImuBatch) and i % 10 == 0:
                assert odometry.wait(60.0)
                if odometry.status != "waiting":
                    said.append((odometry.pose(), odometry.status))
        cloud, halfway = odometry.map_points(), odometry.estimate()
        return SimpleNamespace(said=said, cloud=cloud, halfway=halfway, final=odometry.finish())

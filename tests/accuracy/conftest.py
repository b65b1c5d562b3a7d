# SPDX-License-Identifier: MIT OR Apache-2.0
"""Simulated flights, mapped as a user does it and compared with the truth once per session."""

from __future__ import annotations

import functools
import json
import pickle
from types import SimpleNamespace

import pytest

from bentwing.evaluate.simulated import score
from bentwing.run.pipeline import map_recording


@pytest.fixture(scope="session")
def flown(simulated, made_once):
    """Simulate, map and compare a flight: its score, the record of its run, and both folders."""

    @functools.cache
    def fly(scene, duration, **options):
        recording = simulated(scene, duration, **options)

        def fill(folder):
            payload = recording / "payload.yaml"
            map_recording(recording / "recording.bag", payload, folder, threads=2)
            (folder / "score.pickle").write_bytes(pickle.dumps(score(recording, folder)))

        out = made_once(f"run-{recording.name}", fill)
        return SimpleNamespace(
            score=pickle.loads((out / "score.pickle").read_bytes()),
            record=json.loads((out / "run.json").read_text()),
            recording=recording,
            out=out,
        )

    return fly

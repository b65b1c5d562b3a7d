# SPDX-License-Identifier: MIT OR Apache-2.0
"""A recording is decoded once; later passes yield the same from what was kept."""

from collections import Counter
from itertools import islice

import numpy as np
import pytest

from bentwing.base.progress import Progress
from bentwing.recording import EncoderBatch, ImuBatch, LidarBatch, Payload
from bentwing.recording.preprocess import KeptBatches, RecordingPart, kept

PAYLOAD = Payload.model_validate({"lidar": {"min_range": 0.5}, "T_imu_lidar": {}})


class Counted:
    """A recording of five seconds that counts how often it is decoded."""

    duration = 5.0
    n_passes = 0

    def batches(self, *_):
        self.n_passes += 1
        random = np.random.default_rng(0)
        for k in range(50):
            times = 0.1 * k + np.linspace(0.0, 0.099, 40)
            yield ImuBatch(times, random.normal(size=(40, 3)), random.normal(size=(40, 3)))
            yield EncoderBatch(times, random.normal(size=40))
            points = random.normal(size=(40, 3)) * 3.0
            ring = np.arange(40, dtype=np.uint16) if k % 2 else None
            yield LidarBatch(points, times, random.random(40).astype(np.float32), ring)


@pytest.fixture
def recording():
    return Counted()


def passed(part, *, until=None):
    counts = Counter()
    with Progress().stage("", 1.0) as shown:
        batches = part.batches(shown, counts)
        found = list(islice(batches, until))
        batches.close()
    return found, counts


@pytest.fixture(params=[0, 20_000, 10**9])
def part(request, recording, tmp_path, monkeypatch):
    monkeypatch.setattr(kept, "HELD", request.param)
    keeper = KeptBatches(tmp_path)
    yield RecordingPart(recording, PAYLOAD, kept=keeper)
    keeper.close()
    assert not list(tmp_path.iterdir())


def test_later_passes_yield_and_count_the_same_without_decoding(part, recording):
    expected, counts = passed(RecordingPart(recording, PAYLOAD))
    assert counts["preprocess.range"] > 0
    recording.n_passes = 0
    for _ in range(3):
        assert passed(part) == (expected, counts)
    assert recording.n_passes == 1


def test_a_pass_that_stops_early_keeps_nothing_and_disturbs_none(part, recording):
    expected, _ = passed(RecordingPart(recording, PAYLOAD))
    assert passed(part, until=10)[0] == expected[:10]
    assert not part.kept.is_whole
    assert passed(part)[0] == expected
    assert part.kept.is_whole
    assert passed(part, until=7)[0] == expected[:7]
    assert passed(part)[0] == expected


def test_a_pass_that_fails_keeps_nothing(part, recording, monkeypatch):
    def broken(*_):
        yield ImuBatch(np.zeros(1), np.zeros((1, 3)), np.zeros((1, 3)))
        raise OSError(5, "the disk fails")

    with monkeypatch.context() as patched:
        patched.setattr(recording, "batches", broken)
        with pytest.raises(OSError, match="the disk fails"):
            passed(part)
    assert not part.kept.is_whole
    assert len(passed(part)[0]) > 100


def test_where_the_disk_is_full_the_recording_is_decoded_again(recording, tmp_path, monkeypatch):
    usage = type("Usage", (), {"free": 40_000})
    monkeypatch.setattr("shutil.disk_usage", lambda _: usage)
    monkeypatch.setattr(kept, "HELD", 0)
    part = RecordingPart(recording, PAYLOAD, kept=KeptBatches(tmp_path))
    expected, _ = passed(RecordingPart(recording, PAYLOAD))
    for _ in range(2):
        assert passed(part)[0] == expected
        assert not part.kept.is_whole
    assert recording.n_passes == 3
    assert not list(tmp_path.iterdir())

# SPDX-License-Identifier: MIT OR Apache-2.0
"""Captures and packets of any content either give batches or one of our errors."""

from __future__ import annotations

import struct
from collections import Counter

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from bentwing.base.errors import InputError
from bentwing.recording import LidarBatch, Recording

pytest.importorskip("velodyne_decoder", reason='needs pip install "bentwing[packets]"')

SENSOR = "0.0.0.0:2368"
HEAD = struct.pack("<IHHiIII", 0xA1B2C3D4, 2, 4, 0, 0, 65535, 1)
models = st.sampled_from([0x21, 0x22, 0x24, 0x28, 0xA1])
shared_tmp_path = settings(
    suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None
)


def capture(path, payloads):
    content = HEAD
    for i, payload in enumerate(payloads):
        size = len(payload)
        udp = struct.pack(">HHHH", 2368, 2368, 8 + size, 0) + payload
        ip = struct.pack(">BBHHHBBH", 0x45, 0, 28 + size, i, 0, 64, 17, 0) + bytes(8)
        frame = bytes(12) + b"\x08\x00" + ip + udp
        seconds, microseconds = divmod(1327 * i, 10**6)
        size = len(frame)
        content += struct.pack("<IIII", 1_700_000_000 + seconds, microseconds, size, size) + frame
    path.write_bytes(content)
    return path


def read(path):
    """Batches and counts of a capture, or the sentence of its error."""
    try:
        with Recording(path) as recording:
            return list(recording.batches()), recording.counts, ""
    except InputError as error:
        return [], Counter(), str(error)


@given(content=st.binary(max_size=400), has_head=st.booleans())
@settings(shared_tmp_path, max_examples=200)
def test_any_bytes_give_no_point_or_an_error_that_names_the_file(tmp_path, content, has_head):
    path = tmp_path / "a.pcap"
    path.write_bytes(HEAD + content if has_head else content)
    batches, _, error = read(path)
    assert batches == []
    assert path.name in error


@given(
    seed=st.integers(0, 2**32 - 1),
    model=models,
    returns=st.sampled_from([0x37, 0x38, 0x39, 0x00]),
    stamps=st.lists(st.integers(0, 2**32 - 1), min_size=1, max_size=5),
)
@settings(shared_tmp_path, max_examples=100)
def test_packets_of_any_content_give_finite_points_in_order(tmp_path, seed, model, returns, stamps):
    noise = np.random.default_rng(seed)
    payloads = []
    for stamp in stamps:
        blocks = np.frombuffer(noise.bytes(1200), np.uint8).copy()
        blocks[:2] = 0xFF, 0xEE
        payloads.append(blocks.tobytes() + struct.pack("<IBB", stamp, returns, model))
    batches, counts, error = read(capture(tmp_path / "a.pcap", payloads))
    assert batches or SENSOR in error
    assert sum(len(b.times) for b in batches) <= counts["lidar.returns"] - counts["lidar.zero"]
    for batch in batches:
        assert isinstance(batch, LidarBatch)
        assert np.isfinite(batch.points).all()
        assert np.all(np.diff(batch.times) >= 0)

# SPDX-License-Identifier: MIT OR Apache-2.0
"""Captures of every lidar whose packets are read: with any bytes changed, points are clean or there are none.

Changes of packets reach what their decoders believe, which those of a whole capture seldom do.
"""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from bentwing.base.errors import BentwingError
from bentwing.recording import Payload, Recording
from support.block_lidars import LIDARS, device_packet, packets_of
from support.captures import ethernet, udp, vlp16_turns, write_pcap
from support.changed_bytes import EDITS, SHARED, changed
from support.ouster_packets import METADATA, imu_packets, lidar_packets

pytest.importorskip("velodyne_decoder", reason='needs pip install "bentwing[packets]"')

START_US = 1_700_000_000 * 10**6
N = 24  # packets
ROBOSENSE = ("rs16", "rs32", "helios", "airy")
MODELS = ("vlp16", "vlp16 dual", "ouster", *LIDARS)


def datagrams(model):
    """(port, µs since the start, datagram) of a sound capture."""
    if model.startswith("vlp16"):
        turns = vlp16_turns(0.04, first_us=START_US % (3600 * 10**6))
        found = [(2368, t, packet) for t, packet in turns[:N]]
        if model.endswith("dual"):
            return [(port, t, packet[:-2] + b"\x39\x22") for port, t, packet in found]
        return found
    if model == "ouster":
        lidar = [(7502, t / 1000, packet) for t, packet in lidar_packets(0.04)]
        imu = [(7503, t / 1000, packet) for t, packet in imu_packets(0.04)]
        return sorted(lidar + imu, key=lambda one: one[1])
    found = [(2368, t, packet) for t, packet in packets_of(LIDARS[model], START_US, N)]
    if model in ROBOSENSE:
        found.insert(3, (7788, found[2][1], device_packet(model)))
    return found


def write(path, sent):
    frames = [
        (START_US * 1000 + round(t * 1000) + 10**6, ethernet(part))
        for i, (port, t, data) in enumerate(sent)
        for part in udp(data, port=port, identity=i)
    ]
    return write_pcap(path, frames)


def read(path, payload):
    """The number of points of a capture, all clean, or 0 where it is refused."""
    n = 0
    try:
        with Recording(path, payload) as recording:
            for batch in recording.batches():
                assert np.isfinite(batch.times).all()
                assert np.all(np.diff(batch.times) >= 0)
                for name in ("points", "gyro", "accel"):
                    values = getattr(batch, name, None)
                    if values is not None:
                        assert np.isfinite(values).all()
                        assert len(values) == len(batch.times)
                n += len(getattr(batch, "points", ()))
    except BentwingError:
        return 0
    return n


@pytest.fixture(scope="module")
def sound(tmp_path_factory):
    """For each model its payload and its datagrams, which are read."""
    folder, found = tmp_path_factory.mktemp("sound"), {}
    (folder / "os1.json").write_text(METADATA)
    for model in MODELS:
        lidar = {"metadata": str(folder / "os1.json")} if model == "ouster" else {}
        lidar |= {"model": model} if model in {"rs16", "rs32"} else {}
        payload = Payload.model_validate({"lidar": lidar, "imu": None})
        sent = datagrams(model)
        assert read(write(folder / f"{model}.pcap", sent), payload) > 100, model
        found[model] = payload, sent
    return found


@pytest.mark.parametrize("model", MODELS)
@SHARED
@given(hurt=st.lists(st.tuples(st.integers(0, N), EDITS), max_size=6), edits=st.just([]) | EDITS)
@example(hurt=[(0, [("cut", 0.0, 0)])], edits=[])
@example(hurt=[(i, [("cut", 0.5, 0)]) for i in range(N + 1)], edits=[])
@example(hurt=[], edits=[("cut", 0.5, 0)])
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_a_capture_with_changed_bytes_gives_clean_points_or_none(
    tmp_path, sound, model, hurt, edits
):
    payload, sent = sound[model]
    sent = list(sent)
    for at, changes in hurt:
        port, t, data = sent[at % len(sent)]
        sent[at % len(sent)] = port, t, changed(data, changes)
    path = write(tmp_path / "a.pcap", sent)
    path.write_bytes(changed(path.read_bytes(), edits))
    read(path, payload)

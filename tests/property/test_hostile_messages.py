# SPDX-License-Identifier: MIT OR Apache-2.0
"""Whatever the bytes, what comes out is clean data or an error of ours."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from bentwing.base.clock import Clock
from bentwing.base.errors import BentwingError
from bentwing.recording import LidarBatch, Payload, Recording
from bentwing.recording.clock_steps import ClockSteps
from bentwing.recording.lidar_stream import LidarStream
from bentwing.recording.messages import wire_clouds
from bentwing.recording.messages.lidar_messages import LIDAR_MESSAGES
from bentwing.recording.messages.point_cloud2 import columns
from bentwing.recording.point_times import TimeReading
from bentwing.recording.readings import EncoderReading, ImuReading, LidarReading
from bentwing.recording.streams import EncoderStream, ImuStream

CLOCK = Clock(1_700_000_000 * 10**9)
NOW_NS = CLOCK.start_ns + 250_000_000
READING = TimeReading("time", "float32", "s", "header")

relaxed = settings(
    max_examples=60,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
formats = st.sampled_from(["i1", "u1", "i2", "u2", "i4", "u4", "f4", "f8"])


@st.composite
def tables(draw):
    """Structured arrays with x, y, z and more fields, anywhere in the point, either endianness."""
    names = ["x", "y", "z", *draw(st.sets(st.sampled_from(["intensity", "ring", "time", "odd"])))]
    names = draw(st.permutations(names))
    order = draw(st.sampled_from("<>"))
    offsets, chosen, position = [], [], draw(st.integers(0, 5))
    for name in names:
        kind = draw(st.sampled_from(["f4", "f8"])) if name in "xyz" else draw(formats)
        chosen.append(order + kind)
        offsets.append(position)
        position += np.dtype(kind).itemsize + draw(st.integers(0, 3))
    dtype = np.dtype({"names": names, "formats": chosen, "offsets": offsets, "itemsize": position})
    table = np.zeros(draw(st.integers(0, 12)), dtype)
    for axis in "xyz":
        table[axis] = np.arange(1, len(table) + 1)
    return table


@given(table=tables())
@relaxed
def test_any_field_layout_is_read(ros, table):
    raw = ros.serialize(ros.cloud(0.25, table))
    cols = columns(wire_clouds.point_cloud(raw, cdr=not ros.ros1), Counter())
    expected = np.repeat(np.arange(1, len(table) + 1)[:, None], 3, axis=1)
    np.testing.assert_array_equal(cols.points, expected)


def lidar_stream(kind, *, cdr):
    return LidarStream(
        "/lidar", kind, CLOCK, LidarReading(), cdr=cdr, use_recorder_time=False, times=READING,
        needs_beam_times=False, steps=ClockSteps(0, []),
    )  # fmt: skip


def streams_and_messages(ros):
    cdr = not ros.ros1
    table = np.zeros(5, [("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("time", "<f4"), ("ring", "u1")])
    table["x"], table["time"] = np.arange(1, 6), np.linspace(0, 0.1, 5)
    read = {"cdr": cdr, "use_recorder_time": False}
    imu = ImuStream("/imu", CLOCK, ImuReading(), **read, steps=ClockSteps(0, []))
    encoder = EncoderStream(
        "/encoder", CLOCK, EncoderReading("motor"), **read, steps=ClockSteps(0, [])
    )
    lidars = [
        ros.cloud(0.25, table),
        ros.scan(0.25, [1, 2, 3]),
        ros.multi_echo(0.25, [[1], [2, 3]], []),
        ros.livox(0.25, [0, 9], np.ones((2, 3))),
    ]
    # The two drivers of Livox share one layout.
    assert {one.__msgtype__ for one in lidars} == {*LIDAR_MESSAGES} - {
        "livox_ros_driver/msg/CustomMsg"
    }
    return [
        *((lidar_stream(one.__msgtype__, cdr=cdr), ros.serialize(one)) for one in lidars),
        (imu, ros.serialize(ros.imu(0.25))),
        (encoder, ros.serialize(ros.joint(0.25, 1.0))),
    ]


def assert_clean(batch):
    if batch is None:
        return
    assert np.isfinite(batch.times).all()
    assert np.all(np.diff(batch.times) >= 0)
    for name in ("points", "gyro", "accel", "angles"):
        values = getattr(batch, name, None)
        if values is not None:
            assert np.isfinite(values).all()
            assert len(values) == len(batch.times)


@given(data=st.data())
@relaxed
def test_flipped_and_cut_messages_give_clean_data_or_are_counted(ros, data):
    with np.errstate(all="raise"):
        for stream, raw in streams_and_messages(ros):
            hurt = bytearray(raw)
            for bit in data.draw(st.lists(st.integers(0, 8 * len(raw) - 1), max_size=4)):
                hurt[bit // 8] ^= 1 << bit % 8
            cut = data.draw(st.integers(0, len(raw)) | st.just(len(raw)))
            for message in (bytes(hurt), bytes(hurt[:cut])):
                before = stream.counts.total()
                assert_clean(stream.decode([(NOW_NS, message)]))
                assert stream.counts.total() > before
            assert_clean(stream.finish())


@pytest.fixture(scope="module")
def small_files(tmp_path_factory, ros1, ros2, head_entries):
    """Bytes of a short head recording in every container that is one file."""
    folder = tmp_path_factory.mktemp("hostile")
    bag = ros1.write(folder / "head.bag", head_entries(ros1, 0.2, encoder=True))
    files = {".bag": bag.read_bytes()}
    for kind in ("mcap", "db3"):
        path = ros2.write(folder / kind, head_entries(ros2, 0.2, encoder=True), kind=kind)
        files[f".{kind}"] = next(path.glob(f"*.{kind}")).read_bytes()
    return files


@pytest.mark.parametrize("suffix", [".bag", ".mcap", ".db3"])
@given(data=st.data())
@settings(relaxed, max_examples=25)
def test_damaged_files_give_clean_data_or_our_error(tmp_path, small_files, suffix, data):
    raw = bytearray(small_files[suffix])
    for at in data.draw(st.lists(st.integers(0, len(raw) - 1), max_size=8)):
        raw[at] = data.draw(st.integers(0, 255))
    cut = data.draw(st.integers(0, len(raw)) | st.just(len(raw)))
    path = tmp_path / f"hurt{suffix}"
    path.write_bytes(raw[:cut])
    payload = Payload(encoder={"topic": "/encoder"})
    try:
        with Recording(path, payload) as recording:
            for batch in recording.batches():
                assert_clean(batch)
                assert isinstance(batch, LidarBatch) or len(batch.times)
    except BentwingError:
        return

# SPDX-License-Identifier: MIT OR Apache-2.0
import numpy as np
import pytest
from rosbags.typesys import Stores, get_typestore

from bentwing.base.clock import Clock
from bentwing.recording.fixes import UNKNOWN_SIGMAS, read_fixes

START_NS = 1_700_000_000_000_000_000


def message(
    i, *, cdr, stamp=None, frame="gps", status=0, place=(47.1, 11.2, 600.0), cov=None, kind=2
):
    store = get_typestore(Stores.ROS2_HUMBLE if cdr else Stores.ROS1_NOETIC)
    types = store.types
    ns = START_NS + i * 200_000_000 if stamp is None else stamp
    time = types["builtin_interfaces/msg/Time"](*divmod(ns, 10**9))
    header = types["std_msgs/msg/Header"]
    made = types["sensor_msgs/msg/NavSatFix"](
        header=header(time, frame) if cdr else header(i, time, frame),
        status=types["sensor_msgs/msg/NavSatStatus"](status=status, service=1),
        latitude=place[0], longitude=place[1], altitude=place[2],
        position_covariance=np.diag([0.04, 0.09, 0.16]).ravel() if cov is None else cov,
        position_covariance_type=kind,
    )  # fmt: skip
    encode = store.serialize_cdr if cdr else store.serialize_ros1
    return "/fix", START_NS + i * 200_000_000 + 1_000_000, bytes(encode(made, made.__msgtype__))


def read(messages, *, cdr=True, **part):
    return read_fixes(messages, Clock(START_NS), cdr=cdr, **part)


@pytest.mark.parametrize("cdr", [False, True])
@pytest.mark.parametrize("frame", ["", "g", "gp", "gps", "antenna"])
def test_fixes_are_read_from_both_encodings_at_any_alignment(cdr, frame):
    found = read([message(i, cdr=cdr, frame=frame) for i in range(3)], cdr=cdr)
    assert np.allclose(found.times, [0.0, 0.2, 0.4])
    assert found.places.tolist() == [[11.2, 47.1, 600.0]] * 3
    assert np.allclose(found.covariances, np.diag([0.04, 0.09, 0.16]))
    assert found.counts["fixes"] == 3


def test_a_part_of_the_recording_is_read():
    found = read([message(i, cdr=True) for i in range(20)], begin=1.0, end=2.0)
    assert np.allclose(found.times, [1.0, 1.2, 1.4, 1.6, 1.8])


@pytest.mark.parametrize(
    "wrong",
    [{"status": -1}, {"place": (np.nan, 11.2, 600.0)}, {"place": (147.1, 11.2, 600.0)}],
)
def test_what_is_no_fix_is_dropped_and_counted(wrong):
    found = read([message(0, cdr=True), message(1, cdr=True, **wrong), message(2, cdr=True)])
    assert len(found.times) == 2
    assert found.counts["no_fix"] == 1


@pytest.mark.parametrize(
    "unknown", [{"kind": 0}, {"cov": np.zeros(9)}, {"cov": np.full(9, np.nan)}, {"kind": 9}]
)
def test_an_unknown_covariance_is_filled_in_and_counted(unknown):
    found = read([message(0, cdr=True, **unknown)])
    assert np.allclose(found.covariances[0], np.diag(np.square(UNKNOWN_SIGMAS)))
    assert found.counts["unknown_covariance"] == 1


def test_covariances_are_always_covariances():
    found = read([message(0, cdr=True, cov=np.array([0.04, 9, 9, 9, 0.04, 9, 9, 9, 0.04]))])
    assert np.linalg.eigvalsh(found.covariances[0]).min() > 0


def test_truncated_messages_are_counted():
    good = message(0, cdr=True)
    parts = [("/fix", good[1] + n, good[2][:n]) for n in range(len(good[2]))]
    found = read([*parts, good])
    assert found.counts["broken_messages"] >= len(parts) - 8
    assert found.counts["fixes"] >= 1


def test_stamps_that_go_back_are_dropped():
    found = read([message(1, cdr=True), message(0, cdr=True), message(2, cdr=True)])
    assert found.times.tolist() == pytest.approx([0.2, 0.4])

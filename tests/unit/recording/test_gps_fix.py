# SPDX-License-Identifier: MIT OR Apache-2.0
"""gps_common/GPSFix against a serializer that was not written for it."""

import numpy as np
import pytest
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from bentwing.base.clock import Clock
from bentwing.recording.fixes import UNKNOWN_SIGMAS, read_fixes
from bentwing.recording.messages.gps_fix import gps_fix
from bentwing.recording.messages.wire import BrokenMessageError

START_NS = 1_700_000_000 * 10**9
STATUS = """std_msgs/Header header
uint16 satellites_used
int32[] satellite_used_prn
uint16 satellites_visible
int32[] satellite_visible_prn
int32[] satellite_visible_z
int32[] satellite_visible_azimuth
int32[] satellite_visible_snr
int16 status
uint16 motion_source
uint16 orientation_source
uint16 position_source
"""
NUMBERS = [
    "latitude",
    "longitude",
    "altitude",
    "track",
    "speed",
    "climb",
    "pitch",
    "roll",
    "dip",
    "time",
    "gdop",
    "pdop",
    "hdop",
    "vdop",
    "tdop",
    "err",
    "err_horz",
    "err_vert",
    "err_track",
    "err_speed",
    "err_climb",
    "err_time",
    "err_pitch",
    "err_roll",
    "err_dip",
]
FIX = (
    "std_msgs/Header header\ngps_common/GPSStatus status\n"
    + "".join(f"float64 {name}\n" for name in NUMBERS)
    + "float64[9] position_covariance\nuint8 position_covariance_type\n"
)


def message(
    *, cdr, frame="gps", status=0, satellites=(3, 5, 7), cov=None, kind=2, errors=(0.0, 0.0)
):
    store = get_typestore(Stores.ROS2_HUMBLE if cdr else Stores.ROS1_NOETIC)
    store.register(get_types_from_msg(STATUS, "gps_common/msg/GPSStatus"))
    store.register(get_types_from_msg(FIX, "gps_common/msg/GPSFix"))
    types = store.types
    time = types["builtin_interfaces/msg/Time"](*divmod(START_NS + 10**9, 10**9))
    header = types["std_msgs/msg/Header"]
    head = header(time, frame) if cdr else header(1, time, frame)
    prn = np.array(satellites, np.int32)
    numbers = dict.fromkeys(NUMBERS, 0.5)
    numbers.update(latitude=47.1, longitude=11.2, altitude=600.0)
    numbers.update(err_horz=errors[0], err_vert=errors[1])
    made = types["gps_common/msg/GPSFix"](
        header=head,
        status=types["gps_common/msg/GPSStatus"](
            header=head, satellites_used=3, satellite_used_prn=prn, satellites_visible=3,
            satellite_visible_prn=prn, satellite_visible_z=prn, satellite_visible_azimuth=prn,
            satellite_visible_snr=prn[:1], status=status, motion_source=1, orientation_source=2,
            position_source=3,
        ),
        position_covariance=np.diag([0.04, 0.09, 0.16]).ravel() if cov is None else cov,
        position_covariance_type=kind,
        **numbers,
    )  # fmt: skip
    encode = store.serialize_cdr if cdr else store.serialize_ros1
    return bytes(encode(made, made.__msgtype__))


def read(raw, *, cdr):
    messages = [("/fix", START_NS + 10**9 + 10**6, raw)]
    return read_fixes(messages, Clock(START_NS), cdr=cdr, parse=gps_fix)


@pytest.mark.parametrize("cdr", [False, True])
@pytest.mark.parametrize("frame", ["", "g", "gp", "gps", "antenna"])
@pytest.mark.parametrize("satellites", [(), (1,), (1, 2, 3)])
def test_it_is_read_from_both_encodings_at_any_alignment(cdr, frame, satellites):
    found = read(message(cdr=cdr, frame=frame, satellites=satellites), cdr=cdr)
    assert found.times.tolist() == [1.0]
    assert found.places.tolist() == [[11.2, 47.1, 600.0]]
    assert np.allclose(found.covariances, np.diag([0.04, 0.09, 0.16]))


@pytest.mark.parametrize(
    ("status", "errors", "level"),
    [(19, (0, 0), 0.02), (20, (0, 0), 0.3), (18, (0, 0), 0.7), (0, (4.9, 7.84), 2.0), (0, (0, 0), UNKNOWN_SIGMAS[0])],
)  # fmt: skip
def test_without_a_covariance_the_stated_errors_or_the_status_count(status, errors, level):
    raw = message(cdr=True, status=status, kind=0, errors=errors)
    found = read(raw, cdr=True)
    assert np.sqrt(found.covariances[0, 0, 0]) == pytest.approx(level, rel=1e-6)


def test_a_status_below_zero_is_no_fix():
    assert read(message(cdr=True, status=-1), cdr=True).counts["no_fix"] == 1


@pytest.mark.parametrize("cdr", [False, True])
def test_a_message_that_ends_early_is_broken(cdr):
    raw = message(cdr=cdr)
    for end in range(len(raw)):
        with pytest.raises(BrokenMessageError):
            gps_fix(raw[:end], cdr=cdr)

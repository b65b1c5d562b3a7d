# SPDX-License-Identifier: MIT OR Apache-2.0
from __future__ import annotations

from typing import get_args

import numpy as np
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from bentwing.base.errors import PayloadError
from bentwing.recording.payload import Payload
from bentwing.recording.sections.imu import AccelUnit, GyroUnit

length = st.floats(-5, 5)
vector = st.tuples(length, length, length)
positive = st.floats(1e-9, 1e3)
quaternion = (
    st.tuples(*[st.floats(-1, 1)] * 4)
    .filter(lambda q: np.linalg.norm(q) > 0.1)
    .map(lambda q: (np.array(q) / np.linalg.norm(q)).tolist())
)
transform = st.fixed_dictionaries({"translation": vector, "quaternion": quaternion})
box = st.tuples(vector, st.tuples(*[st.floats(0.1, 5)] * 3)).map(
    lambda pair: {"min": pair[0], "max": tuple(np.add(*pair).tolist())}
)
words = st.text(st.characters(exclude_categories=["Cs"], exclude_characters="\0"), max_size=20)
topic = words.filter(bool)
axes = st.permutations("xyz").flatmap(
    lambda order: st.tuples(*[st.sampled_from([axis, f"-{axis}"]) for axis in order])
)
payloads = st.fixed_dictionaries(
    {},
    optional={
        "name": words,
        "lidar": st.fixed_dictionaries(
            {
                "kind": st.sampled_from(
                    ["hokuyo-utm30lx", "vlp16", "ouster", "livox", "hesai", "robosense"]
                )
            },
            optional={
                "topic": topic,
                "range_sigma": positive,
                "latency": st.floats(-1.5, 1.5),
                "mirrored": st.booleans(),
                "range_scale": positive,
            },
        ),
        "imu": st.none()
        | st.fixed_dictionaries(
            {},
            optional={
                "gyro_noise": positive,
                "axes": axes,
                "gyro_axes": axes,
                "units": st.fixed_dictionaries(
                    {},
                    optional={
                        "accel": st.sampled_from(get_args(AccelUnit)),
                        "gyro": st.sampled_from(get_args(GyroUnit)),
                    },
                ),
                "clock_offset": st.floats(-4e9, 4e9),
            },
        ),
        "T_imu_lidar": st.none() | transform,
        "self_hits": st.lists(st.fixed_dictionaries({"box": box}), max_size=3),
        "encoder": st.none()
        | st.fixed_dictionaries(
            {},
            optional={
                "T_imu_motor": transform,
                "delay": st.floats(-1.5, 1.5),
                "joint": topic,
                "unit": st.sampled_from(["rad", "deg"]),
                "sign": st.sampled_from([1, -1]),
                "clock_offset": st.floats(-4e9, 4e9),
            },
        ),
        "calibration": st.none()
        | st.fixed_dictionaries(
            {"std": st.dictionaries(topic, st.lists(positive, max_size=3), max_size=3)}
        ),
        "gnss": st.none() | st.fixed_dictionaries({"topic": topic}),
    },
)

shared_tmp_path = settings(suppress_health_check=[HealthCheck.function_scoped_fixture])


@given(data=payloads)
@settings(shared_tmp_path, max_examples=60)
def test_a_payload_written_and_read_again_is_the_same(tmp_path, data):
    payload = Payload.model_validate(data)
    path = tmp_path / "payload.yaml"
    path.write_text(yaml.safe_dump(payload.model_dump(mode="json")), encoding="utf-8")
    assert Payload.load(path) == payload
    payload.save(path)
    read = Payload.load(path)
    assert read == payload
    assert read.describes_imu == payload.describes_imu
    assert read.to_yaml() == payload.to_yaml()


@given(content=st.binary(max_size=200) | st.text(max_size=200).map(str.encode))
@settings(shared_tmp_path, max_examples=100)
def test_any_file_is_a_payload_or_a_payload_error(tmp_path, content):
    path = tmp_path / "payload.yaml"
    path.write_bytes(content)
    try:
        assert isinstance(Payload.load(path), Payload)
    except PayloadError:
        return

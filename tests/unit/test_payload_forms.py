# SPDX-License-Identifier: MIT OR Apache-2.0
"""Wherever a payload goes, its path, a `Payload` or None is taken, and anything else is named."""

import pytest

import bentwing
from bentwing.base.errors import PayloadError
from bentwing.calibrate import calibrate, inspect
from bentwing.flight import plan_flight
from bentwing.recording.payload import as_payload

TAKERS = {
    "recording": lambda payload: bentwing.Recording("none.bag", payload),
    "odometry": lambda payload: bentwing.Odometry(payload).close(),
    "plan": lambda payload: plan_flight(payload),
    "inspect": lambda payload: inspect("none.bag", payload),
    "calibrate": lambda payload: calibrate("none.bag", payload),
}


@pytest.fixture
def path(tmp_path):
    file = tmp_path / "payload.yaml"
    file.write_text("name: head\nlidar: {kind: vlp16}\n", encoding="utf-8")
    return file


def test_a_path_a_payload_and_none_are_a_payload(path):
    described = bentwing.Payload.load(path)
    assert described.name == "head"
    assert as_payload(path) == as_payload(str(path)) == described
    assert as_payload(described) is described
    assert as_payload(None) == bentwing.Payload.default()


@pytest.mark.parametrize("take", TAKERS.values(), ids=TAKERS.keys())
def test_another_type_is_named(take):
    with pytest.raises(
        TypeError, match="payload: expected a Payload, got dict; give the path of a"
    ):
        take({"lidar": {}})


@pytest.mark.parametrize("take", TAKERS.values(), ids=TAKERS.keys())
def test_a_missing_file_is_named(take, tmp_path):
    with pytest.raises(PayloadError, match=r"none.yaml: no such file"):
        take(tmp_path / "none.yaml")


def test_a_flight_is_planned_by_the_file_as_by_the_value(path):
    assert repr(plan_flight(path)) == repr(plan_flight(bentwing.Payload.load(path)))

# SPDX-License-Identifier: MIT OR Apache-2.0
from typing import get_args

import pytest

from bentwing import Odometry, odometry
from bentwing.base.errors import UsageError
from bentwing.odometry.kalman import KalmanSettings
from bentwing.odometry.ndt import NdtSettings
from bentwing.recording import Payload

HEAD = Payload.default()


@pytest.mark.parametrize(
    ("settings", "sentence"),
    [
        ({}, "settings: expected a KalmanSettings, got dict; the estimator 'kalman' has"),
        (NdtSettings(), "settings: expected a KalmanSettings, got NdtSettings"),
        (0.1, "settings: expected a KalmanSettings, got float"),
    ],
)
def test_settings_of_another_type_are_refused_by_name(settings, sentence):
    with pytest.raises(TypeError, match=sentence):
        odometry.create("kalman", HEAD, settings)


def test_a_payload_of_another_type_is_refused_by_name():
    with pytest.raises(TypeError, match="payload: expected a Payload, got dict"):
        odometry.create("ndt", {})


@pytest.mark.parametrize("name", odometry.ESTIMATORS)
def test_every_estimator_is_made_with_its_defaults_and_with_its_settings(name):
    engine, model = odometry.ESTIMATORS[name]
    made = odometry.create(name, HEAD, model())
    assert isinstance(made, engine)
    assert made.settings == odometry.create(name, HEAD).settings == model()
    assert made.current is None
    assert not made.advance()


def test_every_name_has_an_estimator():
    assert tuple(odometry.ESTIMATORS) == get_args(odometry.EstimatorName)


def test_live_odometry_takes_the_same_names_and_settings():
    with pytest.raises(UsageError, match="'slam' is not known; choose continuous, kalman"):
        Odometry(HEAD, estimator="slam")
    with pytest.raises(TypeError, match="settings: expected a ContinuousSettings"):
        Odometry(HEAD, settings=KalmanSettings())

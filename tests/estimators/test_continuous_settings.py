# SPDX-License-Identifier: MIT OR Apache-2.0
"""Settings of the continuous estimator: frozen, validated, and obeyed."""

from __future__ import annotations

import math

import numpy as np
import pytest
from pydantic import ValidationError

from bentwing.odometry.continuous.settings import (
    ContinuousSettings,
    RegistrationSettings,
    SurfelSettings,
)
from bentwing.odometry.continuous.slow_states import UNIT_STATES

QUICK = {"window": 3.0, "registration": {"max_outer": 2}}
MODELS = [ContinuousSettings, RegistrationSettings, SurfelSettings]
NUMBERS = [
    (model, field)
    for model in MODELS
    for field, info in model.model_fields.items()
    if info.annotation in (int, float)
]


@pytest.fixture
def head(heads):
    return heads("continuous")


@pytest.mark.parametrize("model", MODELS)
def test_settings_cannot_be_changed(model):
    settings = model()
    name = next(iter(model.model_fields))
    with pytest.raises(ValidationError, match="frozen"):
        setattr(settings, name, 1)


@pytest.mark.parametrize("model", MODELS)
def test_a_misspelt_setting_is_refused(model):
    with pytest.raises(ValidationError, match="Extra inputs are not permitted"):
        model(voxelsize=0.3)


@pytest.mark.parametrize(("model", "field"), NUMBERS)
@pytest.mark.parametrize("value", [-1, math.nan, math.inf, "much"])
def test_a_number_outside_its_range_is_refused(model, field, value):
    with pytest.raises(ValidationError, match=field):
        model(**{field: value})


def test_an_unknown_slow_state_is_refused_at_once():
    with pytest.raises(ValidationError, match=r"speed.*latency"):
        ContinuousSettings(frozen=("speed",))


def test_settings_survive_their_own_dump():
    settings = ContinuousSettings(window=4.0, frozen=("latency",))
    assert ContinuousSettings.model_validate(settings.model_dump()) == settings
    assert ContinuousSettings.model_validate_json(settings.model_dump_json()) == settings


def test_frozen_states_stay_exactly_at_their_start(run, head):
    names = (
        "latency",
        "extrinsic_rotation",
        "extrinsic_translation",
        "gyro_bias",
        "accel_bias",
        "gravity",
        *UNIT_STATES,
    )
    estimate = run("continuous", settings=ContinuousSettings(**QUICK, frozen=names))
    mount, found = head.payload.T_imu_lidar, estimate.calibration
    assert found.latency == 0.0
    assert tuple(found.mount.T_imu_lidar.translation) == mount.translation
    assert found.mount.T_imu_lidar.quaternion == pytest.approx(mount.quaternion, abs=1e-15)
    for key in ("latency", "gyro_bias", "accel_bias", "gravity", "extrinsic_quat_xyzw"):
        values = np.array([getattr(w, key) for w in estimate.windows])
        assert (values == values[0]).all(), key
    assert found.std == {}


def test_one_frozen_state_leaves_the_others_free(run, plain_run):
    estimate = run("continuous", settings=ContinuousSettings(**QUICK, frozen=("latency",)))
    assert estimate.calibration.latency == 0.0
    assert plain_run("continuous").calibration.latency != 0.0
    assert "latency" not in estimate.calibration.std
    assert "gyro_bias" in estimate.calibration.std

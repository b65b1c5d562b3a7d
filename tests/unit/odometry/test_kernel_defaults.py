# SPDX-License-Identifier: MIT OR Apache-2.0
"""The benches of the core measure the settings that ship."""

import json
from pathlib import Path

from bentwing.base.trajectory import DT
from bentwing.odometry.continuous.core_settings import CoreSettings
from bentwing.odometry.continuous.settings import RegistrationSettings, SurfelSettings
from bentwing.recording import Payload

DEFAULTS = Path(__file__).parents[3] / "benches" / "kernels" / "defaults.json"


def test_the_benches_of_the_core_take_the_defaults_of_the_package():
    settings = CoreSettings.of(RegistrationSettings(), Payload.default(), DT)
    # The benches' scanners have noises of their own.
    registration = settings.model_dump(exclude={"range_sigma"})
    assert json.loads(DEFAULTS.read_text(encoding="utf-8")) == {
        "registration": registration,
        "surfels": SurfelSettings().model_dump(),
    }

# SPDX-License-Identifier: MIT OR Apache-2.0
"""The IMU of another flight in the same world."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import yaml

from bentwing.base.errors import UsageError
from bentwing.simulate.imu import RATE_HZ
from bentwing.simulate.scenario import Scenario
from bentwing.simulate.simulation import prepare
from bentwing.simulate.stream import CHUNK, ticks

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from numpy.typing import NDArray


def another_imu(folder: Path) -> Iterator[NDArray[np.float64]]:
    """Yield gyro and accel (6,) of another flight than the simulated one in a folder.

    Raises
    ------
    UsageError
        If the recording in the folder was not simulated.
    """
    path = folder / "scenario.yaml"
    if not path.exists():
        msg = f"{path} is missing: this fault needs a simulated recording"
        raise UsageError(msg)
    known = Scenario.model_validate(yaml.safe_load(path.read_text(encoding="utf-8")))
    seed = known.seed if known.flight_seed is None else known.flight_seed
    setup = prepare(known.model_copy(update={"flight_seed": seed + 1}))
    for start in np.arange(setup.first, setup.last, CHUNK).tolist():
        times = ticks(start, min(start + CHUNK, setup.last), RATE_HZ)
        yield from np.hstack(setup.sensors.imu.sample(times, setup.rig.imu(times)))

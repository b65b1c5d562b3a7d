# SPDX-License-Identifier: MIT OR Apache-2.0
"""What decides a run, defaults included: the estimator's settings and the sensor head."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import yaml

from bentwing import odometry
from bentwing.base.plain import plain
from bentwing.recording import Payload

if TYPE_CHECKING:
    from pathlib import Path

    from bentwing.odometry.interface import Estimator


def load_payload(payload: Payload | Path | str | None) -> Payload:
    """Return the sensor head, from its file if need be; None stands for the default."""
    if isinstance(payload, Payload):
        return payload
    return Payload.default() if payload is None else Payload.load(payload)


def described_settings(estimator: str, engine: Estimator, payload: Payload) -> dict[str, Any]:
    """Return the settings of an estimator, and the payload, in plain JSON types."""
    return {estimator: plain(getattr(engine, "settings", None)), "payload": plain(payload)}


def settings_text(estimator: str, payload: Payload | Path | str | None) -> str:
    """Return what a run with this payload would use, as YAML."""
    odometry.require_estimator(estimator)
    head = load_payload(payload)
    engine = odometry.create(estimator, head, None, None)
    return yaml.safe_dump(described_settings(estimator, engine, head), sort_keys=False)

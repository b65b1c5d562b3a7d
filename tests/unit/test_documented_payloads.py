# SPDX-License-Identifier: MIT OR Apache-2.0
"""The payload.yaml examples of README and docs are accepted as they stand."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from bentwing.recording import Payload

ROOT = Path(__file__).parents[2]
FENCE = re.compile(r"^```yaml\n(.*?)^```", re.MULTILINE | re.DOTALL)
EXAMPLES = [
    pytest.param(block, id=f"{page}-{number}")
    for page in ("README.md", "docs/sensors.md")
    for number, block in enumerate(FENCE.findall((ROOT / page).read_text(encoding="utf-8")))
]


@pytest.mark.parametrize("example", EXAMPLES)
def test_a_documented_payload_is_accepted(example: str, tmp_path: Path) -> None:
    path = tmp_path / "payload.yaml"
    path.write_text(example, encoding="utf-8")
    assert Payload.load(path).places_lidar_on_imu

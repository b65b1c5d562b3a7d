# SPDX-License-Identifier: MIT OR Apache-2.0
"""The ways to put a map on the Earth by name, apart so that a help page shows them at once."""

from __future__ import annotations

from typing import Literal, TypeAlias

GeoreferenceMode: TypeAlias = Literal["rigid", "constraints", "off"]

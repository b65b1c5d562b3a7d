# SPDX-License-Identifier: MIT OR Apache-2.0
"""What the colours of a mesh may show, apart so that a help page shows it at once."""

from __future__ import annotations

from typing import Literal, TypeAlias

Viewer: TypeAlias = Literal["rerun", "open3d"]
MeshColour: TypeAlias = Literal["height", "intensity"]

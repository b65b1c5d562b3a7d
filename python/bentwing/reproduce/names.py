# SPDX-License-Identifier: MIT OR Apache-2.0
"""The papers and their parts by name, apart so that a help page shows them at once."""

from __future__ import annotations

from typing import Literal, TypeAlias

PaperName: TypeAlias = Literal["kaul2015", "fu2023", "tazir2020"]
PartName: TypeAlias = Literal["mapping", "flight"]

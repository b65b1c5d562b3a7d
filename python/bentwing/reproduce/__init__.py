# SPDX-License-Identifier: MIT OR Apache-2.0
"""The papers' figures and tables, made again."""

from bentwing.reproduce.parts import PARTS, Reproduced, reproduce

__all__ = ["PARTS", "Reproduced", "reproduce"]

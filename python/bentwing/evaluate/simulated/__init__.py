# SPDX-License-Identifier: MIT OR Apache-2.0
"""Runs of simulated recordings against the truth that the simulation left."""

from __future__ import annotations

from bentwing.evaluate.simulated.in_world import WorldError, world_error
from bentwing.evaluate.simulated.localized import LocalizedScore, localized_score
from bentwing.evaluate.simulated.merged import MergedScore, merged_score
from bentwing.evaluate.simulated.score import Score, score
from bentwing.evaluate.simulated.truth import (
    Truth,
    in_flight,
    mapped_points,
    true_calibration,
)

__all__ = [
    "LocalizedScore",
    "MergedScore",
    "Score",
    "Truth",
    "WorldError",
    "in_flight",
    "localized_score",
    "mapped_points",
    "merged_score",
    "score",
    "true_calibration",
    "world_error",
]

# SPDX-License-Identifier: MIT OR Apache-2.0
"""Why a set-up is not found."""

from __future__ import annotations

from bentwing.base.errors import EstimationError


class NotFoundError(EstimationError):
    """The set-up does not show; the sentence says why and what to do."""


class DefectError(NotFoundError):
    """A sensor is certainly wrong in a way that no description puts right; the sentence names it."""

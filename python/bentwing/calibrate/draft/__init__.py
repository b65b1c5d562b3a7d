# SPDX-License-Identifier: MIT OR Apache-2.0
"""A payload.yaml to start from, as far as a recording tells the sensor head."""

from bentwing.calibrate.draft.draft import Draft, draft_payload

__all__ = ["Draft", "draft_payload"]

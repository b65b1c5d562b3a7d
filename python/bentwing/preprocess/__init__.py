# SPDX-License-Identifier: MIT OR Apache-2.0
"""From the recording's batches to batches an estimator can use, and the start of the estimate."""

from bentwing.preprocess.chain import Preprocessing, preprocess
from bentwing.preprocess.part import RecordingPart
from bentwing.preprocess.static_init import StaticStart, find_static_start

__all__ = ["Preprocessing", "RecordingPart", "StaticStart", "find_static_start", "preprocess"]

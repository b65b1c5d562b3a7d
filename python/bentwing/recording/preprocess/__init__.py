# SPDX-License-Identifier: MIT OR Apache-2.0
"""From the recording's batches to batches an estimator can use, and the start of the estimate."""

from bentwing.recording.preprocess.chain import Preprocessing, preprocess
from bentwing.recording.preprocess.kept import KeptBatches
from bentwing.recording.preprocess.part import RecordingPart
from bentwing.recording.preprocess.static_init import StaticStart, find_static_start

__all__ = [
    "KeptBatches",
    "Preprocessing",
    "RecordingPart",
    "StaticStart",
    "find_static_start",
    "preprocess",
]

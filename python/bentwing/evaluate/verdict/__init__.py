# SPDX-License-Identifier: MIT OR Apache-2.0
"""Whether a result can be used, by evidence and without any truth."""

from __future__ import annotations

from bentwing.evaluate.verdict.closing import (
    judge_closing,
    judge_joins,
    judge_marks,
    judge_revisits,
)
from bentwing.evaluate.verdict.early import EarlyJudge
from bentwing.evaluate.verdict.evidence import Evidence
from bentwing.evaluate.verdict.judge import judge_estimate, judge_so_far
from bentwing.evaluate.verdict.kinds import KINDS
from bentwing.evaluate.verdict.path import judge_breaks
from bentwing.evaluate.verdict.verdict import Reason, Verdict, verdict_of
from bentwing.evaluate.verdict.watch import Watch

__all__ = [
    "KINDS",
    "EarlyJudge",
    "Evidence",
    "Reason",
    "Verdict",
    "Watch",
    "judge_breaks",
    "judge_closing",
    "judge_estimate",
    "judge_joins",
    "judge_marks",
    "judge_revisits",
    "judge_so_far",
    "verdict_of",
]

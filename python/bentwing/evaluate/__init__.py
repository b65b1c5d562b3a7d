# SPDX-License-Identifier: MIT OR Apache-2.0
"""Measures of trajectories and maps: errors, drift, spacing and consistency."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bentwing.evaluate.evaluation import Evaluation, Question, evaluate
    from bentwing.evaluate.subject import Subject, find_subject
    from bentwing.evaluate.trajectory import AbsoluteError, Drift, absolute_error, drift
    from bentwing.evaluate.verdict.verdict import Reason, Verdict
else:
    from bentwing.base.lazy import lazy

    __getattr__, __dir__ = lazy(
        __name__,
        {
            "evaluate.evaluation": ["Evaluation", "Question", "evaluate"],
            "evaluate.subject": ["Subject", "find_subject"],
            "evaluate.trajectory": ["AbsoluteError", "Drift", "absolute_error", "drift"],
            "evaluate.verdict.verdict": ["Reason", "Verdict"],
        },
    )

__all__ = [
    "AbsoluteError",
    "Drift",
    "Evaluation",
    "Question",
    "Reason",
    "Subject",
    "Verdict",
    "absolute_error",
    "drift",
    "evaluate",
    "find_subject",
]

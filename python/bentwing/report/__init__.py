# SPDX-License-Identifier: MIT OR Apache-2.0
"""The report: what a run found, as one page that opens anywhere, and figures of evaluations."""

from bentwing.report.of_evaluation import draw_evaluation, evaluation_drawings
from bentwing.report.page import write_report
from bentwing.report.wall import draw_wall

__all__ = ["draw_evaluation", "draw_wall", "evaluation_drawings", "write_report"]

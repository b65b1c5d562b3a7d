# SPDX-License-Identifier: MIT OR Apache-2.0
"""Say at the end of a run what was skipped and why; in the continuous integration refuse other skips.

A test that is skipped everywhere checks nothing, and nobody sees it.
"""

from __future__ import annotations

import os
import re
from collections import Counter
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    Report = pytest.TestReport | pytest.CollectReport

ALLOWED = {
    r"real recordings are not at": "recordings of others, which this repository may not carry",
    r"public pose graphs are not at": "likewise",
    r"Python 3.10 has no tomllib": "newer versions check the same files",
    r"PDAL is not installed": "large; the weekly workflow has it",
    r"Open3D is not installed": "a gigabyte; the weekly workflow has it",
    r"Open3D finds no driver": "likewise, with the package",
}
"""Patterns of reasons that may skip a test in the continuous integration, and why each may."""


def skipped(reporter: pytest.TerminalReporter) -> Counter[str]:
    """How often each reason was given; every worker of xdist reports what it could not collect."""
    reports: list[Report] = reporter.stats.get("skipped", [])
    reasons = {(report.nodeid, reason(report)) for report in reports}
    return Counter(text for _, text in sorted(reasons))


def reason(report: Report) -> str:
    """What the skip says."""
    where = report.longrepr
    return str(where[2] if isinstance(where, tuple) else where).removeprefix("Skipped: ")


def allowance(text: str) -> str | None:
    """Why a reason may skip a test, None where it may not."""
    return next((why for pattern, why in ALLOWED.items() if re.search(pattern, text)), None)


def refused(config: pytest.Config) -> list[str]:
    """Reasons that fail this run: none on a developer's machine, and none in a worker of xdist."""
    reporter = config.pluginmanager.get_plugin("terminalreporter")
    if reporter is None or "CI" not in os.environ:
        return []
    return [text for text in skipped(reporter) if allowance(text) is None]


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Fail the run that skipped what it may not skip."""
    if session.exitstatus == pytest.ExitCode.OK and refused(session.config):
        session.exitstatus = pytest.ExitCode.TESTS_FAILED


def pytest_terminal_summary(
    terminalreporter: pytest.TerminalReporter, config: pytest.Config
) -> None:
    """List the reasons, each once."""
    found = skipped(terminalreporter)
    if not found:
        return
    terminalreporter.section("skipped")
    for text, n in found.items():
        terminalreporter.line(f"{n:4}  {text} ({allowance(text) or 'on no list'})")
    if bad := refused(config):
        terminalreporter.line(
            f"FAILED: {len(bad)} reason(s) on no list: install what is missing, or add the reason to "
            "tests/support/skips.py",
            red=True,
        )

# SPDX-License-Identifier: MIT OR Apache-2.0
"""The languages of reports."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from bentwing.recording.sections.project import project_in
from bentwing.report.german import GERMAN
from bentwing.report.texts import ENGLISH

if TYPE_CHECKING:
    from collections.abc import Mapping

    from bentwing.report.texts import Texts

LANGUAGES: dict[str, Texts] = {"en": ENGLISH, "de": GERMAN}


def texts_of(record: Mapping[str, Any]) -> Texts:
    """Return the words of the language that the project of a run names."""
    project = project_in(record)
    return ENGLISH if project is None else LANGUAGES[project.language]

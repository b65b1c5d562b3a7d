# SPDX-License-Identifier: MIT OR Apache-2.0
"""Tells griffe that what follows a name's colon in our docstrings is a description, not a type.

The types are in the signatures.
"""

from __future__ import annotations

import re
from typing import Any

from griffe import Extension, Object

_SECTION = re.compile(
    r"^(Parameters|Attributes)\n-+\n(?:(?!^\w[^\n]*\n-{3,}$).*\n?)*", re.MULTILINE
)
_ENTRY = re.compile(r"^(\S[^:\n]*) : (.+)$", re.MULTILINE)


class Descriptions(Extension):
    """Puts each description on a line of its own, as numpydoc wants it."""

    def on_object(self, *, obj: Object, **_: Any) -> None:  # noqa: ANN401 - griffe passes its own types
        """Reword the docstring of one object."""
        if obj.docstring is not None:
            obj.docstring.value = reworded(obj.docstring.value)


def reworded(text: str) -> str:
    """Turn `name : what it is` into a name and an indented line, in the sections that list names."""
    return _SECTION.sub(lambda section: _ENTRY.sub(r"\1\n    \2", section[0]), text)

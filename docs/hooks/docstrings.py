# SPDX-License-Identifier: MIT OR Apache-2.0
"""Tells griffe what the project's docstrings and settings mean.

What follows a name's colon in a docstring is a description, not a type: the types are in the signatures.
The fields of a settings model are its attributes.
"""

from __future__ import annotations

import ast
import re
from typing import TYPE_CHECKING, Any

from griffe import Attribute, Class, ExprCall, ExprKeyword, Extension, Object

if TYPE_CHECKING:
    from collections.abc import Iterator

_SECTION = re.compile(
    r"^(Parameters|Attributes)\n-+\n(?:(?!^\w[^\n]*\n-{3,}$).*\n?)*", re.MULTILINE
)
_ENTRY = re.compile(r"^(\S[^:\n]*) : (.+)$", re.MULTILINE)


class Descriptions(Extension):
    """Puts each description on a line of its own, as numpydoc wants it."""

    def on_object(self, *, obj: Object, **_: Any) -> None:  # noqa: ANN401 - griffe passes its own types
        """Reword the docstring of one object."""
        if obj.docstring is None:
            return
        text = obj.docstring.value
        if isinstance(obj, Class) and (lines := list(fields_of(obj))):
            text = "\n".join([text.strip(), "", "Attributes", "----------", *lines])
        obj.docstring.value = reworded(text)


def fields_of(model: Class) -> Iterator[str]:
    """Yield a line for each field of a settings model that has a description."""
    for name, member in model.members.items():
        if isinstance(member, Attribute) and isinstance(member.value, ExprCall):
            field = _arguments(member.value)
            if "description" in field:
                description = ast.literal_eval(field["description"])
                yield f"{name} : {description}{_default(field.get('default', 'None'))}"


def reworded(text: str) -> str:
    """Turn `name : what it is` into a name and an indented line, in the sections that list names."""
    return _SECTION.sub(lambda section: _ENTRY.sub(r"\1\n    \2", section[0]), text)


def _arguments(call: ExprCall) -> dict[str, str]:
    """Return the arguments of `Field(…)` by name, as they are written."""
    return {one.name: str(one.value) for one in call.arguments if isinstance(one, ExprKeyword)}


def _default(written: str) -> str:
    return "" if written == "None" or "(" in written else f"; default: `{written}`"

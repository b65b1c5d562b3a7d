# SPDX-License-Identifier: MIT OR Apache-2.0
"""Names and messages of files, so that a terminal shows them and does not obey them."""

from __future__ import annotations


def printable(text: str, *, keep: str = "") -> str:
    r"""Return a text with all that is not printable written with a backslash, as `\x1b`.

    Parameters
    ----------
    keep : characters that stay as they are, such as the ends of lines
    """
    if text.isprintable():
        return text
    return "".join(c if c in keep or c.isprintable() else _escaped(c) for c in text)


def _escaped(character: str) -> str:
    return character.encode("unicode_escape").decode("ascii")

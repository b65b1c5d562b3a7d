# SPDX-License-Identifier: MIT OR Apache-2.0
"""Turns formulas into MathML while the pages are built, so that no script has to be loaded."""

from __future__ import annotations

import re
from html import unescape
from typing import TYPE_CHECKING, Any

from latex2mathml.converter import convert

if TYPE_CHECKING:
    from collections.abc import Callable

# What the arithmatex extension leaves of `$…$` and `$$…$$`.
INLINE = re.compile(r'<span class="arithmatex">\\\((.+?)\\\)</span>', re.DOTALL)
BLOCK = re.compile(r'<div class="arithmatex">\s*\\\[(.+?)\\\]\s*</div>', re.DOTALL)


def _mathml(display: str) -> Callable[[re.Match[str]], str]:
    return lambda match: convert(unescape(match[1].strip()), display=display)


def on_page_content(html: str, **_: Any) -> str:  # noqa: ANN401 - mkdocs passes its own types
    """Replace the formulas of one page."""
    return BLOCK.sub(_mathml("block"), INLINE.sub(_mathml("inline"), html))

# SPDX-License-Identifier: MIT OR Apache-2.0
"""A page of HTML in one file that opens anywhere, without a network."""

from __future__ import annotations

from html import escape
from importlib.resources import files


def html_page(title: str, body: str, language: str = "en") -> str:
    """Put a body into a page with the style of all reports."""
    style = files("bentwing.report").joinpath("style.css").read_text(encoding="utf-8")
    return (
        f'<!doctype html>\n<html lang="{language}"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{escape(title)}</title><style>{style}</style></head>"
        f"<body><main>{body}</main></body></html>\n"
    )

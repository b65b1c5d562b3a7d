# SPDX-License-Identifier: MIT OR Apache-2.0
"""A mistake on the command line as one sentence: what it is, what was meant, where help is."""

from __future__ import annotations

import re
from difflib import get_close_matches
from typing import TYPE_CHECKING, Any

import typer

if TYPE_CHECKING:
    from collections.abc import Iterable


# typer hides the click it carries; the base of its errors is found through the one class it shows.
Mistake: type[Exception] = next(
    base for base in typer.BadParameter.__mro__ if base.__name__ == "ClickException"
)


def did_you_mean(given: str, known: Iterable[str]) -> str:
    """Return ` (did you mean …?)` where something known is similar, else nothing."""
    near = get_close_matches(given, list(known), n=1)
    return f" (did you mean {near[0]}?)" if near else ""


def explain(error: Any) -> str:  # noqa: ANN401 - typer hides the click it carries
    """Return the sentence for an error of typer's parser."""
    context = getattr(error, "ctx", None)
    command = "bentwing" if context is None else context.command_path
    message = " ".join(error.format_message().replace("Value error, ", "").split()).rstrip(".")
    if hasattr(error, "possibilities"):  # no such option
        parameters = [] if context is None else context.command.get_params(context)
        known = [n for parameter in parameters for n in parameter.opts if n.startswith("-")]
        message = error.message + did_you_mean(error.option_name, known)
    elif " is not one of " in message:
        # The choice that was made stands before those that can be made, all in quotes.
        given, *choices = re.findall(r"'([^']*)'", error.message)
        message += did_you_mean(given, choices)
    return f"{message}; see `{command} --help`"

# SPDX-License-Identifier: MIT OR Apache-2.0
"""The help page of a command: groups of options, examples and exit codes.

Plain text, drawn without rich, which takes longer to import than everything else on the way to it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from typer.core import TyperCommand

from bentwing.cli.mistakes import Mistake
from bentwing.cli.options import GROUPS

if TYPE_CHECKING:
    from collections.abc import Iterable

PRINT_SETTINGS = "--print-settings"
CONTEXT = {"help_option_names": ["-h", "--help"]}
_HELP = "Help"
_COLUMN = 24  # width of names, the same in all groups
_EXIT_CODES = """\
  0    done
  1    the disk is full, or memory or a right is missing
  2    the call is wrong, or its output cannot be written
  3    an input cannot be used, or a recording is unfit for mapping
  4    the estimation failed, or the map is wrong; what was computed is kept
  5    some recordings are mapped, others are not
  70   a bug in bentwing
  130  interrupted; what was computed is kept"""


def closing(examples: Iterable[str]) -> str:
    """Return what stands below the options."""
    lines = "\n".join(f"  {example}" for example in examples)
    return f"\nExamples:\n{lines}\n\nExit codes:\n{_EXIT_CODES}\n"


class Command(TyperCommand):
    """A command whose help page groups the options."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:  # noqa: ANN401 - typer's signature
        """Parse the arguments; where the settings are only shown, no input is required."""
        if PRINT_SETTINGS in args:
            for parameter in self.params:
                parameter.required = False
        try:
            return super().parse_args(ctx, args)
        except Mistake as error:
            # The parser does not say of every mistake in which command it was made.
            mistake: Any = error
            if getattr(error, "ctx", ctx) is None:
                mistake.ctx = ctx
            raise

    def format_options(self, ctx: Any, formatter: Any) -> None:  # noqa: ANN401 - typer's signature
        """Write the options group by group."""
        groups: dict[str, list[tuple[str, str]]] = {}
        for parameter in self.get_params(ctx):
            names, text = parameter.get_help_record(ctx) or ("", "")
            if parameter.param_type_name == "argument":
                names = str(parameter.metavar)
            group = getattr(parameter, "rich_help_panel", None) or _HELP
            groups.setdefault(group, []).append((names.ljust(_COLUMN), text))
        for group in sorted(groups, key=rank):
            with formatter.section(group):
                formatter.write_dl(groups[group], col_max=_COLUMN)

    def format_epilog(self, ctx: Any, formatter: Any) -> None:  # noqa: ANN401, ARG002
        """Write examples and exit codes, line by line."""
        formatter.write(self.epilog)


def rank(group: str) -> int:
    """Return where a group stands; those of one command alone come first."""
    return GROUPS.index(group) if group in GROUPS else len(GROUPS) if group == _HELP else -1

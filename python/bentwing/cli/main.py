# SPDX-License-Identifier: MIT OR Apache-2.0
"""The command `bentwing`: options, commands, and one place where errors become exit codes."""

from __future__ import annotations

import errno
import io
import os
import signal
import sys
import traceback
import unicodedata
import warnings
from typing import TYPE_CHECKING, Annotated

import typer

from bentwing.base.errors import BentwingError, InputError, UsageError
from bentwing.base.printable import printable
from bentwing.cli.command import CONTEXT, closing
from bentwing.cli.commands import LazyCommands
from bentwing.cli.mistakes import Mistake, explain

if TYPE_CHECKING:
    from types import FrameType

INTERRUPTED = 130
UNEXPECTED = 70  # EX_SOFTWARE of sysexits.h
# Matrices here are small: the threads of a BLAS would wait for each other most of the time, beside ours.
_BLAS_THREADS = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
_DEBUG = "BENTWING_DEBUG"

_NO_ROOM = "; make room there, or name another folder"
_NO_NAME = "; no file can have this name, so give that of one that is there"
_REMEDIES = {
    errno.ENOSPC: _NO_ROOM, errno.EDQUOT: _NO_ROOM, errno.EFBIG: _NO_ROOM,
    errno.ENAMETOOLONG: _NO_NAME, errno.ELOOP: _NO_NAME,
}  # fmt: skip

_EXAMPLES = (
    "bentwing simulate courtyard -o recording --duration 30",
    "bentwing map recording/recording.bag -p recording/payload.yaml -o run",
    "bentwing map --help",
)

app = typer.Typer(
    name="bentwing",
    cls=LazyCommands,
    help="Accurate trajectories and 3D maps from lidars that move on their carrier, without GNSS.",
    context_settings=CONTEXT,
    epilog=closing(_EXAMPLES),
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)


def _print_version(wanted: bool) -> None:  # noqa: FBT001 - typer calls it so
    if wanted:
        from bentwing.base.provenance import bentwing_version

        typer.echo(f"bentwing {bentwing_version()}")
        raise typer.Exit


@app.callback()
def _options(
    *,
    version: Annotated[
        bool,
        typer.Option("--version", callback=_print_version, is_eager=True, help="Show the version."),
    ] = False,
    debug: Annotated[
        bool, typer.Option("--debug", help="Show tracebacks of unexpected errors.")
    ] = False,
) -> None:
    del version
    if debug:
        os.environ[_DEBUG] = "1"


def run() -> None:
    """Run the command line and end the process with its exit code."""
    for name in _BLAS_THREADS:  # read when numpy is imported
        os.environ.setdefault(name, "1")
    # Whoever ends the process finds the reason in the record, as after Ctrl-C.
    for name in ("SIGTERM", "SIGHUP"):
        number = getattr(signal, name, None)  # Windows has no SIGHUP
        if number is not None and signal.getsignal(number) is signal.SIG_DFL:
            signal.signal(number, _interrupt)
    if isinstance(sys.stdout, io.TextIOWrapper):  # the name of a folder need not be UTF-8
        sys.stdout.reconfigure(errors="backslashreplace")
    if not (sys.warnoptions or os.environ.get(_DEBUG)):  # they speak of code, to programmers
        warnings.simplefilter("ignore")
    sys.exit(run_command(sys.argv[1:]))


def _interrupt(number: int, frame: FrameType | None) -> None:
    del frame
    msg = f"ended by {signal.Signals(number).name}"
    raise KeyboardInterrupt(msg)


def run_command(arguments: list[str]) -> int:
    """Run one command; return its exit code, having said in one sentence what went wrong."""
    if not arguments:
        run_command(["--help"])
        return UsageError.exit_code
    try:
        _require_plain(arguments)
        result = app(arguments, prog_name="bentwing", standalone_mode=False)
    except BentwingError as error:
        return _fail(str(error), error.exit_code)
    except Mistake as error:
        return _fail(explain(error), UsageError.exit_code)
    except (KeyboardInterrupt, typer.Abort) as error:
        return _fail(str(error) or "interrupted", INTERRUPTED)
    except BrokenPipeError:
        # the reader of our output has gone; nothing more can be said
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except OSError as error:
        where = f"{error.filename}: " if error.filename else ""
        remedy = _REMEDIES.get(error.errno or 0, "")
        code = InputError.exit_code if remedy is _NO_NAME else BentwingError.exit_code
        return _fail(f"{where}{error.strerror or error}{remedy}", code)
    except MemoryError:
        return _fail(
            "not enough memory; give --duration, or a machine with more", BentwingError.exit_code
        )
    except Exception as error:
        return _unexpected(error)
    if result == INTERRUPTED:  # some versions of typer turn the interrupt into its exit code
        return _fail("interrupted", INTERRUPTED)
    return result if isinstance(result, int) else 0


def _require_plain(arguments: list[str]) -> None:
    """Refuse names that neither a report nor a terminal can show, before any work.

    Raises
    ------
    UsageError
    """
    for argument in arguments:
        if any(unicodedata.category(character) in {"Cc", "Cs"} for character in argument):
            msg = (
                f"{printable(argument)}: holds a control character or bytes that are no UTF-8; rename "
                "the file or folder"
            )
            raise UsageError(msg)


def _fail(message: str, code: int) -> int:
    print("bentwing: error:", printable(message, keep="\n"), file=sys.stderr)
    return code


def _unexpected(error: Exception) -> int:
    if os.environ.get(_DEBUG):
        traceback.print_exception(error)
    _fail(
        f"unexpected {type(error).__name__}: {error}; this is a bug in bentwing, please report it "
        f"with the output of the same command under {_DEBUG}=1",
        UNEXPECTED,
    )
    return UNEXPECTED

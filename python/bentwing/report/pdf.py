# SPDX-License-Identifier: MIT OR Apache-2.0
"""A page as PDF, printed by a browser that is on the machine."""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
from typing import TYPE_CHECKING

from bentwing.base.atomic import atomic_path
from bentwing.base.errors import BentwingError, UsageError

if TYPE_CHECKING:
    from pathlib import Path

BROWSER = "BENTWING_BROWSER"
"""Names the browser where it is not found by itself."""
_NAMES = (
    "chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome", "microsoft-edge", "msedge",
)  # fmt: skip
_PLACES = (
    "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
    "/Applications/Chromium.app/Contents/MacOS/Chromium",
    "/Applications/Microsoft Edge.app/Contents/MacOS/Microsoft Edge",
)
_LONGEST = 120.0  # s


def find_browser() -> str:
    """Return the browser that prints.

    Raises
    ------
    UsageError
        If there is none.
    """
    named = os.environ.get(BROWSER)
    found = next(filter(None, map(shutil.which, [named] if named else [*_NAMES, *_PLACES])), None)
    if found is None:
        where = f"{named} of {BROWSER} is no program" if named else "none was found here"
        msg = (
            f"--pdf needs Chromium, Chrome or Edge, and {where}: install one (apt install chromium), "
            f"name it in {BROWSER}, or print report.html from any browser"
        )
        raise UsageError(msg)
    return found


def write_pdf(page: Path, path: Path, browser: str) -> None:
    """Print a page into a file, atomically.

    Parameters
    ----------
    page : HTML
    path : file to write
    browser : as of `find_browser`

    Raises
    ------
    BentwingError
        If the browser makes no PDF.
    """
    with atomic_path(path) as temporary, tempfile.TemporaryDirectory() as profile:
        options = [
            "--headless=new", "--disable-gpu", "--no-first-run", "--no-pdf-header-footer",
            f"--user-data-dir={profile}", f"--print-to-pdf={temporary.resolve()}",
        ]  # fmt: skip
        if hasattr(os, "geteuid") and os.geteuid() == 0:  # it refuses to shield itself from root
            options.append("--no-sandbox")
        said = _run([browser, *options, page.resolve().as_uri()])
        if not temporary.exists() or not temporary.read_bytes().startswith(b"%PDF"):
            msg = f"{browser} printed no PDF ({said}); print {page} from a browser window"
            raise BentwingError(msg)


def _run(command: list[str]) -> str:
    """Run the browser; return what it said last."""
    try:
        done = subprocess.run(command, capture_output=True, check=False, timeout=_LONGEST)
    except (OSError, subprocess.TimeoutExpired) as error:
        return str(error)
    lines = done.stderr.decode("utf-8", "replace").strip().splitlines()
    return lines[-1] if lines else f"exit code {done.returncode}"

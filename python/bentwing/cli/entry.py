# SPDX-License-Identifier: MIT OR Apache-2.0
"""Where the process begins: whoever interrupts it while it still imports sees a sentence, too."""

import sys

_INTERRUPTED = 130


def run() -> None:
    """Run the command line and end the process with its exit code."""
    try:
        from bentwing.cli import main
    except KeyboardInterrupt:
        print("bentwing: error: interrupted", file=sys.stderr)
        sys.exit(_INTERRUPTED)
    try:
        main.run()
    except KeyboardInterrupt:  # a second time, while the first one was being told
        sys.exit(_INTERRUPTED)

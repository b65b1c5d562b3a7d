# SPDX-License-Identifier: MIT OR Apache-2.0
"""`python -m bentwing`: the command line where its script is not on the path."""

from bentwing.cli.entry import run

if __name__ == "__main__":
    run()

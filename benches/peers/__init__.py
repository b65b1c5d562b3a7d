# SPDX-License-Identifier: MIT OR Apache-2.0
"""Other engines on the same recordings as bentwing: `python -m benches peers --help`."""

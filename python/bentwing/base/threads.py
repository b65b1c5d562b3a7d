# SPDX-License-Identifier: MIT OR Apache-2.0
"""How many threads can be asked for."""

MOST_THREADS = 1024
"""More than machines have cores; each thread takes memory of its own."""

# SPDX-License-Identifier: MIT OR Apache-2.0
"""Parts of runs that saw the same places, put together: matches, a pose graph, registration."""

# SPDX-License-Identifier: MIT OR Apache-2.0
"""Many recordings: each mapped in a process of its own, then merged where they belong together."""

# SPDX-License-Identifier: MIT OR Apache-2.0
"""Time and memory, and how they grow."""

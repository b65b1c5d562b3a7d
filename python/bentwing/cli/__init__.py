# SPDX-License-Identifier: MIT OR Apache-2.0
"""The commands: each parses its arguments, makes one call and ends with an exit code."""

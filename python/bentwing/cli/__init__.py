# SPDX-License-Identifier: MIT OR Apache-2.0
"""Commands: parse, call, exit code."""

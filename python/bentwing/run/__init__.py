# SPDX-License-Identifier: MIT OR Apache-2.0
"""Runs: from recordings to run folders, stage by stage."""

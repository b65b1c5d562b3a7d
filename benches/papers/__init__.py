# SPDX-License-Identifier: MIT OR Apache-2.0
"""Experiments of papers on several seeds."""

# SPDX-License-Identifier: MIT OR Apache-2.0
"""Batches in, usable batches and the state at the start out."""

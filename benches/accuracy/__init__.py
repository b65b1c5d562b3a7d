# SPDX-License-Identifier: MIT OR Apache-2.0
"""Errors against a truth."""

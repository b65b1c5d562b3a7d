# SPDX-License-Identifier: MIT OR Apache-2.0
"""A run and the truth in, numbers out."""

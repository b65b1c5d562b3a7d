# SPDX-License-Identifier: MIT OR Apache-2.0
"""The numbers of a run in, one self-contained page out."""

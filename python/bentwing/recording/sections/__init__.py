# SPDX-License-Identifier: MIT OR Apache-2.0
"""The sections of payload.yaml, one file each."""

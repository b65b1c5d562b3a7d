# SPDX-License-Identifier: MIT OR Apache-2.0
"""Messages: samples and points out of the bytes of each message type."""

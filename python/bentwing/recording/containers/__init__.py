# SPDX-License-Identifier: MIT OR Apache-2.0
"""Files of recordings: raw messages out of bags, MCAP and pcap, also out of damaged ones."""

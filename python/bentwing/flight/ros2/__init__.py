# SPDX-License-Identifier: MIT OR Apache-2.0
"""Live odometry among the topics of ROS 2, without ROS: through DDS alone."""

// SPDX-License-Identifier: MIT OR Apache-2.0
//! trajectory
#![forbid(unsafe_code)]

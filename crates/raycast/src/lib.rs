// SPDX-License-Identifier: MIT OR Apache-2.0
//! raycast
#![forbid(unsafe_code)]

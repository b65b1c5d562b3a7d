// SPDX-License-Identifier: MIT OR Apache-2.0
//! Arrays as `NumPy` reads them from a file (format 1.0).

use std::fs;
use std::io;
use std::path::Path;

/// A number that `NumPy` knows.
pub trait Number: Copy {
    /// Its name in the header.
    const DESCRIPTION: &'static str;
    /// Appends its bytes, the lowest first.
    fn append(self, bytes: &mut Vec<u8>);
}

macro_rules! number {
    ($type:ty, $description:literal) => {
        impl Number for $type {
            const DESCRIPTION: &'static str = $description;
            fn append(self, bytes: &mut Vec<u8>) {
                bytes.extend(self.to_le_bytes());
            }
        }
    };
}

number!(f32, "<f4");
number!(f64, "<f8");
number!(i32, "<i4");
number!(u32, "<u4");

/// Writes `values` as rows of `width` numbers, or as one dimension where `width` is zero.
///
/// # Errors
/// When the file cannot be written.
pub fn write<T: Number>(path: &Path, values: &[T], width: usize) -> io::Result<()> {
    let shape = match values.len().checked_div(width) {
        Some(rows) => format!("({rows}, {width})"),
        None => format!("({},)", values.len()),
    };
    let mut header = format!(
        "{{'descr': '{}', 'fortran_order': False, 'shape': {shape}, }}",
        T::DESCRIPTION
    );
    // Ten bytes come before the header; together they end at a multiple of 64.
    while (header.len() + 11) % 64 != 0 {
        header.push(' ');
    }
    header.push('\n');
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    for &value in values {
        value.append(&mut bytes);
    }
    fs::write(path, bytes)
}

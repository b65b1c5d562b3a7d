// SPDX-License-Identifier: MIT OR Apache-2.0
//! `_core.LazCompressor`: LAZ points without the GIL, which the wheels of `lazrs` hold all the while.

use std::fs::{File, OpenOptions};
use std::io::{Seek, SeekFrom};
use std::path::PathBuf;

use ::laz::LasZipError;
use bentwing_las::{Appended, Chunks};
use numpy::PyReadonlyArray1;
use pyo3::exceptions::{PyOSError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::errors::in_pool;

/// LAZ chunks that are compressed at a time.
const TOGETHER: usize = 4;

/// Appends compressed points to a file whose header is written already.
#[pyclass(module = "bentwing._core")]
pub(crate) struct LazCompressor {
    chunks: Chunks,
    /// Points that do not fill their chunks yet.
    waiting: Vec<u8>,
    file: Option<Appended<File>>,
}

#[pymethods]
impl LazCompressor {
    #[new]
    #[pyo3(signature = (point_format, n_extra_bytes, *, own_chunks=false))]
    fn new(point_format: u8, n_extra_bytes: u16, own_chunks: bool) -> PyResult<Self> {
        if point_format != 6 {
            let message = format!("point_format: expected 6, got {point_format}");
            return Err(PyValueError::new_err(message));
        }
        let chunks = Chunks::new(n_extra_bytes, own_chunks);
        Ok(Self {
            chunks: chunks.map_err(|e| PyValueError::new_err(format!("n_extra_bytes: {e}")))?,
            waiting: Vec::new(),
            file: None,
        })
    }

    /// The record that the header of the file must announce.
    fn record_data<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let data = self.chunks.announced().map_err(os_error)?;
        Ok(PyBytes::new(py, &data))
    }

    /// Begins behind the first `offset` bytes of the file.
    fn begin(&mut self, path: PathBuf, offset: u64) -> PyResult<()> {
        let mut file = OpenOptions::new().write(true).open(path)?;
        file.seek(SeekFrom::Start(offset))?;
        let appended = Appended::new(self.chunks.clone(), file).map_err(io_error)?;
        self.file = Some(appended);
        Ok(())
    }

    /// Appends points, record after record as LAS has them.
    #[pyo3(signature = (points, *, threads=0))]
    fn compress(
        &mut self,
        py: Python<'_>,
        points: PyReadonlyArray1<'_, u8>,
        threads: usize,
    ) -> PyResult<()> {
        let bytes = points.as_slice()?;
        let size = self.chunks.size();
        let Some(n) = self.chunks.fixed() else {
            let message = "the file has chunks of its own sizes, give them to compress_chunks()";
            return Err(PyValueError::new_err(message));
        };
        if !bytes.len().is_multiple_of(size) {
            let message = format!(
                "points: expected a multiple of {size} bytes, got {}",
                bytes.len()
            );
            return Err(PyValueError::new_err(message));
        }
        let (file, waiting) = (begun(&mut self.file)?, &mut self.waiting);
        let whole = TOGETHER * n * size;
        let work = || {
            waiting.extend_from_slice(bytes);
            let end = waiting.len() / whole * whole;
            let parts: Vec<&[u8]> = waiting[..end].chunks(n * size).collect();
            file.append(&parts)?;
            waiting.drain(..end);
            Ok(())
        };
        in_pool(py, threads, work)?.map_err(os_error)
    }

    /// Appends points as one chunk for each of `counts`, beside each other.
    #[pyo3(signature = (points, counts, *, threads=0))]
    fn compress_chunks(
        &mut self,
        py: Python<'_>,
        points: PyReadonlyArray1<'_, u8>,
        counts: Vec<usize>,
        threads: usize,
    ) -> PyResult<()> {
        let bytes = points.as_slice()?;
        if self.chunks.fixed().is_some() {
            let message = "the file has chunks of one size, give the points to compress()";
            return Err(PyValueError::new_err(message));
        }
        let size = self.chunks.size();
        let n_points = bytes.len() / size;
        let announced = counts
            .iter()
            .try_fold(0_usize, |n, count| n.checked_add(*count));
        let is_whole = bytes.len().is_multiple_of(size);
        if counts.contains(&0) || announced != Some(n_points) || !is_whole {
            let message = format!("counts: expected numbers above 0 of {n_points} points in all");
            return Err(PyValueError::new_err(message));
        }
        let mut rest = bytes;
        let mut parts = Vec::with_capacity(counts.len());
        for count in counts {
            let (part, behind) = rest.split_at(count * size);
            parts.push(part);
            rest = behind;
        }
        let file = begun(&mut self.file)?;
        in_pool(py, threads, || file.append(&parts))?.map_err(os_error)
    }

    /// Writes what is held back and the table of chunks.
    #[pyo3(signature = (*, threads=0))]
    fn finish(&mut self, py: Python<'_>, threads: usize) -> PyResult<()> {
        begun(&mut self.file)?;
        let (Some(mut file), waiting) = (self.file.take(), std::mem::take(&mut self.waiting))
        else {
            return Ok(());
        };
        let chunk = self.chunks.fixed().unwrap_or(1) * self.chunks.size();
        let work = || {
            let parts: Vec<&[u8]> = waiting.chunks(chunk).collect();
            file.append(&parts)?;
            file.finish()
        };
        in_pool(py, threads, work)?.map_err(os_error)
    }
}

fn begun(file: &mut Option<Appended<File>>) -> PyResult<&mut Appended<File>> {
    let missing = || PyValueError::new_err("begin() was not called, or finish() was");
    file.as_mut().ok_or_else(missing)
}

/// An `OSError` with its number, by which Python tells a full disk from others.
fn io_error(error: std::io::Error) -> PyErr {
    match error.raw_os_error() {
        Some(number) => PyOSError::new_err((number, error.to_string())),
        None => error.into(),
    }
}

fn os_error(error: LasZipError) -> PyErr {
    match error {
        LasZipError::IoError(e) => io_error(e),
        other => PyOSError::new_err(other.to_string()),
    }
}

// SPDX-License-Identifier: MIT OR Apache-2.0
//! Points as records of point format 6 with extra bytes.

use std::f32::consts::PI;

use rayon::prelude::*;
use thiserror::Error;

/// Records per parallel task.
const CHUNK: usize = 8192;
/// Bytes of a record of point format 6 without extra bytes.
pub(crate) const SIZE: usize = 30;
/// Return number 1 in the lower four bits, number of returns 1 in the upper.
pub(crate) const ONLY_RETURN: u8 = 0x11;
/// Angles are stored in steps of an eighth of a degree, short lengths in steps of 1/8192 m: further
/// digits mean nothing, and would be most of what a compressed point takes.
const STEPS_PER_DEGREE: f32 = 8.0;
const STEPS_PER_METRE: f32 = 8192.0;
/// Numbers so large have no digits behind the point: adding one rounds what is a third of it or less.
const WHOLE_F64: f64 = 1.5 * (1_u64 << 52) as f64;
const WHOLE_F32: f32 = 1.5 * (1_u32 << 23) as f32;

/// Why points cannot be stored.
#[derive(Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum LasError {
    /// A coordinate is beyond the steps that 32 bits count.
    #[error(
        "a map point lies at [{:.1}, {:.1}, {:.1}] m, too far for a LAS file; the trajectory has diverged",
        point[0], point[1], point[2]
    )]
    TooFar {
        /// The first such point, m.
        point: [f64; 3],
    },
}

/// A column that a file may have behind the ranges; without values its records have zeros.
#[derive(Clone, Copy, Debug)]
pub struct Extra<'a, T> {
    /// Whether the file has it.
    pub is_stored: bool,
    /// One value per point.
    pub values: Option<&'a [T]>,
}

/// Points and what is known of them, one value per point.
#[derive(Clone, Copy, Debug)]
pub struct Columns<'a> {
    /// m.
    pub points: &'a [[f64; 3]],
    /// s.
    pub times: &'a [f64],
    /// m, in the extra bytes of every file.
    pub ranges: &'a [f32],
    /// As the sensor reports it.
    pub intensity: Option<&'a [f32]>,
    /// Beam number.
    pub ring: Extra<'a, u16>,
    /// Between beam and normal, rad.
    pub incidence: Extra<'a, f32>,
    /// Standard deviation across the surface, m.
    pub thickness: Extra<'a, f32>,
    /// By which the point was moved along its beam, m.
    pub shift: Extra<'a, f32>,
    /// Standard deviation along the beam, m.
    pub sigma: Extra<'a, f32>,
    /// Number of the run, which is the source of a point, too.
    pub run_id: Extra<'a, u16>,
}

/// How numbers become those of a file.
#[derive(Clone, Copy, Debug)]
pub struct Scaling {
    /// Taken off the coordinates, m.
    pub offsets: [f64; 3],
    /// Step of the coordinates, m.
    pub step: f64,
    /// Added to the times, s.
    pub gps_origin: f64,
    /// By which intensities are multiplied.
    pub intensity: f32,
}

/// The records of all points, one behind the other.
///
/// # Errors
/// Where a point is too far from the offsets.
pub fn records(columns: &Columns<'_>, scaling: &Scaling) -> Result<Vec<u8>, LasError> {
    let stored = [
        (columns.ring.is_stored, 2),
        (columns.incidence.is_stored, 4),
        (columns.thickness.is_stored, 4),
        (columns.shift.is_stored, 4),
        (columns.sigma.is_stored, 4),
        (columns.run_id.is_stored, 2),
    ];
    let extra: usize = stored.iter().map(|&(is, n)| if is { n } else { 0 }).sum();
    let size = SIZE + 4 + extra;
    let mut bytes = vec![0; columns.points.len() * size];
    let chunks = bytes.par_chunks_mut(CHUNK * size).enumerate();
    let found: Vec<Result<(), LasError>> = chunks
        .map(|(c, chunk)| {
            let mut rows = chunk.chunks_exact_mut(size).enumerate();
            rows.try_for_each(|(i, row)| write(columns, scaling, c * CHUNK + i, row))
        })
        .collect();
    found.into_iter().collect::<Result<(), _>>()?;
    Ok(bytes)
}

/// Writes the record of point `i`.
fn write(c: &Columns<'_>, s: &Scaling, i: usize, row: &mut [u8]) -> Result<(), LasError> {
    let mut out = Row { row, at: 0 };
    let point = c.points[i];
    for (value, offset) in point.iter().zip(s.offsets) {
        let steps = (value - offset) / s.step;
        let is_counted = steps.abs() < f64::from(i32::MAX) + 0.5; // which NaN is not either
        if !is_counted {
            return Err(LasError::TooFar { point });
        }
        out.put((((steps + WHOLE_F64) - WHOLE_F64) as i32).to_le_bytes());
    }
    let intensity = c
        .intensity
        .map_or(0, |v| whole_intensity(v[i], s.intensity));
    out.put(intensity.to_le_bytes());
    out.put([ONLY_RETURN]);
    out.at += 5; // flags, class, user data and angle of the scan
    out.put(c.run_id.values.map_or(0, |v| v[i]).to_le_bytes());
    out.put((s.gps_origin + c.times[i]).to_le_bytes());
    out.put(c.ranges[i].to_le_bytes());
    out.put_extra(&c.ring, i, u16::to_le_bytes);
    out.put_extra(&c.incidence, i, |v| {
        let degrees = v * (180.0 / PI);
        (whole(degrees * STEPS_PER_DEGREE) / STEPS_PER_DEGREE).to_le_bytes()
    });
    for lengths in [&c.thickness, &c.shift, &c.sigma] {
        out.put_extra(lengths, i, |v| {
            (whole(v * STEPS_PER_METRE) / STEPS_PER_METRE).to_le_bytes()
        });
    }
    out.put_extra(&c.run_id, i, u16::to_le_bytes);
    Ok(())
}

/// An intensity in 16 bits; what is not a number is none.
fn whole_intensity(value: f32, scale: f32) -> u16 {
    if value.is_nan() {
        return 0;
    }
    whole((value * scale).clamp(0.0, 65_535.0)) as u16
}

/// The nearest whole number, of two the even one. The machine's instruction for it is not on every
/// processor, and the function that stands for it takes longer than all else here.
fn whole(value: f32) -> f32 {
    if value.abs() < WHOLE_F32 / 3.0 {
        return (value + WHOLE_F32) - WHOLE_F32;
    }
    value.round_ties_even()
}

struct Row<'a> {
    row: &'a mut [u8],
    at: usize,
}

impl Row<'_> {
    fn put<const N: usize>(&mut self, bytes: [u8; N]) {
        self.row[self.at..self.at + N].copy_from_slice(&bytes);
        self.at += N;
    }

    fn put_extra<T: Copy, const N: usize>(
        &mut self,
        column: &Extra<'_, T>,
        i: usize,
        bytes: impl Fn(T) -> [u8; N],
    ) {
        if !column.is_stored {
            return;
        }
        match column.values {
            Some(values) => self.put(bytes(values[i])),
            None => self.at += N,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn none<'a, T>() -> Extra<'a, T> {
        Extra {
            is_stored: false,
            values: None,
        }
    }

    const SCALING: Scaling = Scaling {
        offsets: [1000.0, 0.0, 0.0],
        step: 1e-4,
        gps_origin: 100.0,
        intensity: 1.0,
    };

    fn columns<'a>(points: &'a [[f64; 3]], times: &'a [f64], ranges: &'a [f32]) -> Columns<'a> {
        Columns {
            points,
            times,
            ranges,
            intensity: None,
            ring: none(),
            incidence: none(),
            thickness: none(),
            shift: none(),
            sigma: none(),
            run_id: none(),
        }
    }

    #[test]
    fn a_record_has_its_fields_where_the_specification_says() {
        let (points, times, ranges) = ([[1001.0, -2.0, 0.000_05]], [0.5], [3.5]);
        let all = Columns {
            intensity: Some(&[7.5]),
            ring: Extra {
                is_stored: true,
                values: Some(&[9]),
            },
            incidence: Extra {
                is_stored: true,
                values: Some(&[std::f32::consts::FRAC_PI_4]),
            },
            run_id: Extra {
                is_stored: true,
                values: Some(&[3]),
            },
            thickness: Extra {
                is_stored: true,
                values: None,
            },
            shift: Extra {
                is_stored: true,
                values: Some(&[-0.015_625]),
            },
            ..columns(&points, &times, &ranges)
        };
        let row = records(&all, &SCALING).unwrap();
        assert_eq!(row.len(), 30 + 4 + 2 + 4 + 4 + 4 + 2);
        assert_eq!(row[..4], 10_000_i32.to_le_bytes());
        assert_eq!(row[4..8], (-20_000_i32).to_le_bytes());
        assert_eq!(row[8..12], 0_i32.to_le_bytes()); // half a step goes to the even one
        assert_eq!(row[12..14], 8_u16.to_le_bytes());
        assert_eq!(row[14], ONLY_RETURN);
        assert_eq!(row[20..22], 3_u16.to_le_bytes());
        assert_eq!(row[22..30], 100.5_f64.to_le_bytes());
        assert_eq!(row[30..34], 3.5_f32.to_le_bytes());
        assert_eq!(row[34..36], 9_u16.to_le_bytes());
        assert_eq!(row[36..40], 45.0_f32.to_le_bytes());
        assert_eq!(row[40..44], [0; 4]);
        assert_eq!(row[44..48], (-0.015_625_f32).to_le_bytes());
        assert_eq!(row[48..50], 3_u16.to_le_bytes());
    }

    #[test]
    fn intensities_stay_within_their_bits() {
        let found = [f32::NAN, -3.0, f32::INFINITY, 0.5, 1.5].map(|v| whole_intensity(v, 1.0));
        assert_eq!(found, [0, 0, 65_535, 0, 2]);
    }

    #[test]
    fn whole_numbers_are_the_nearest_and_of_two_the_even_ones() {
        for value in [
            0.5,
            1.5,
            2.5,
            -0.75,
            -2.5,
            1_440.124_9,
            4e6,
            4_194_303.5,
            4_194_304.5,
            3e7,
            1e30,
        ] {
            assert_eq!(whole(value), value.round_ties_even());
        }
        assert!(whole(f32::NAN).is_nan());
    }

    #[test]
    fn a_point_too_far_away_is_named() {
        let points: Vec<[f64; 3]> = (0..20_000)
            .map(|i| [f64::from(i) * 100.0, 0.0, 0.0])
            .collect();
        let (times, ranges) = (vec![0.0; points.len()], vec![0.0; points.len()]);
        let error = records(&columns(&points, &times, &ranges), &SCALING).unwrap_err();
        // The offset and 2³¹ steps of 0.1 mm are 215,748.4 m.
        assert_eq!(
            error,
            LasError::TooFar {
                point: [215_800.0, 0.0, 0.0]
            }
        );
    }
}

// SPDX-License-Identifier: MIT OR Apache-2.0
//! How an inertial unit answers: biases, scales, axes askew, and forces that feign rates.

use nalgebra::{Matrix3, Vector3};

use crate::{Increment, NodeForce};

/// What turns the samples of an inertial unit into angular rates ω and specific forces f:
///
/// `ω = (I + D) (ω_m − b_g) − G (f_m − f_r)` and `f = f_m − b_a + A (f_m − f_r)`.
///
/// With the reference force `f_r` the biases are what the unit reads too much at rest in one
/// attitude: that is what a rest shows. Were they those without any force, a rest would only show
/// their sums with `G f_r` and `A f_r`.
#[derive(Clone, Debug)]
pub struct InertialUnit {
    /// `b_g`, rad/s.
    pub gyro_bias: Vector3<f64>,
    /// `b_a`, m/s².
    pub accel_bias: Vector3<f64>,
    /// `D`: scales on the diagonal, beside it how axes lean to others.
    pub gyro: Matrix3<f64>,
    /// `G`, rad/s per m/s².
    pub g_sensitivity: Matrix3<f64>,
    /// `A`, as `D`.
    pub accel: Matrix3<f64>,
    /// `f_r`, m/s².
    pub reference: Vector3<f64>,
    /// The axis that answers purely to turns about itself (0, 1, 2): the others feel nothing of
    /// them. This and a symmetric answer of the others define the frame of the unit, see
    /// [`Self::misalign`].
    pub main_axis: usize,
}

impl InertialUnit {
    /// A unit without errors.
    pub fn ideal() -> Self {
        Self {
            gyro_bias: Vector3::zeros(),
            accel_bias: Vector3::zeros(),
            gyro: Matrix3::zeros(),
            g_sensitivity: Matrix3::zeros(),
            accel: Matrix3::zeros(),
            reference: Vector3::zeros(),
            main_axis: 2,
        }
    }

    /// The rotation vector over `dt` seconds, rad, that the samples stand for.
    pub fn turn(&self, said: &Increment, dt: f64) -> Vector3<f64> {
        let turned = said.turned - self.gyro_bias * dt;
        turned + self.gyro * turned - self.g_sensitivity * (said.pushed - self.reference * dt)
    }

    /// The mean force around a sample of the trajectory, m/s², that the samples stand for.
    pub fn force(&self, said: &NodeForce) -> Vector3<f64> {
        let mut force = -said.gain * (self.accel_bias + self.accel * self.reference);
        for (axis, turned) in said.by_axis.iter().enumerate() {
            force += turned.column(axis) + turned * self.accel.column(axis);
        }
        force
    }

    /// The places in [`Self::gyro`] of its three misalignments; the first one is a pair.
    ///
    /// A rotation of the frame that takes mount, gyro and accelerometer along changes nothing that
    /// is measured. Of the six misalignments of a gyro three are such a rotation. Which three is a
    /// choice; those that a steady turn would show are the ones to leave out, or else a head that
    /// spins would no longer tell how it is mounted.
    pub fn misalignments(&self) -> [[(usize, usize); 2]; 3] {
        let k = self.main_axis;
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        [[(i, j), (j, i)], [(k, i); 2], [(k, j); 2]]
    }

    /// Adds to the misalignments of the gyro.
    pub fn misalign(&mut self, delta: &Vector3<f64>) {
        for (places, d) in self.misalignments().iter().zip(delta.iter()) {
            self.gyro[places[0]] += d;
            if places[0] != places[1] {
                self.gyro[places[1]] += d;
            }
        }
    }
}

// SPDX-License-Identifier: MIT OR Apache-2.0
//! Powell's dog-leg: Gauss–Newton steps within a region that the cost's own behaviour sizes.
//!
//! Against Levenberg–Marquardt a step that is refused costs one evaluation and no factorization
//! (Nocedal and Wright 2006, section 4.1). Lengths are measured in units of the diagonal of `JᵀΩJ`,
//! so that radians and metres compare.

use faer::MatMut;
use nalgebra::{Isometry3, Matrix6};

use crate::GraphError;
use crate::blocks::Structure;
use crate::cholesky::{Cholesky, Inverse};
use crate::equations::{Equations, cost};
use crate::graph::PoseGraph;
use crate::poses::corrected;
use crate::terms::LinkAt;

/// Steps below this, rad and m, change nothing that is known.
const NEGLIGIBLE_STEP: f64 = 1e-9;

/// A region this many times shorter than the first step holds no better poses.
const SMALLEST_REGION: f64 = 1e-12;

/// When to stop.
#[derive(Clone, Copy, Debug)]
pub struct Stop {
    /// Iterations at most.
    pub max_iterations: usize,
    /// Share of the cost that another step must promise to take away.
    pub min_relative_decrease: f64,
}

/// Where the cost is least.
#[derive(Clone, Debug)]
pub struct Minimum {
    /// Poses `T_map_node`.
    pub poses: Vec<Isometry3<f64>>,
    /// Their cost.
    pub cost: f64,
    /// Linearizations.
    pub n_iterations: usize,
    /// Whether the last step promised too little to go on.
    pub converged: bool,
}

/// Minimizes the cost of graphs of one structure.
pub struct Minimizer<'a> {
    graph: &'a PoseGraph,
    numbers: &'a [Option<usize>],
    equations: Equations<'a>,
    cholesky: Cholesky<6>,
}

impl<'a> Minimizer<'a> {
    /// Analyses the structure of `graph`.
    ///
    /// # Errors
    /// When memory or the range of the indices is exceeded.
    pub fn new(
        graph: &'a PoseGraph,
        numbers: &'a [Option<usize>],
        structure: &'a Structure,
    ) -> Result<Self, GraphError> {
        Ok(Self {
            graph,
            numbers,
            equations: Equations::new(structure),
            cholesky: Cholesky::new(structure)?,
        })
    }

    /// Walks from `poses` to the nearest minimum of the cost with `weights` of the links.
    ///
    /// # Errors
    /// When the links do not determine all poses, or the cost is not finite.
    pub fn minimize(
        &mut self,
        poses: Vec<Isometry3<f64>>,
        weights: &[f64],
        stop: Stop,
    ) -> Result<Minimum, GraphError> {
        let mut best = Minimum {
            cost: cost(self.graph, &poses, weights)?,
            poses,
            n_iterations: 0,
            converged: false,
        };
        let mut radius = f64::INFINITY;
        while !best.converged && best.n_iterations < stop.max_iterations {
            let legs = self.legs(&best.poses, weights)?;
            best.n_iterations += 1;
            best.converged = legs.promises_little(best.cost, stop.min_relative_decrease);
            radius = self.advance(&mut best, &legs, weights, radius)?;
            best.converged |= radius < SMALLEST_REGION * legs.full_length;
        }
        Ok(best)
    }

    /// Covariances `J Σ Jᵀ` of the residuals of `links` that the poses' covariance Σ leaves, where
    /// `weights` tells the links that made the poses.
    ///
    /// # Errors
    /// When the links do not determine all poses.
    pub fn uncertainties(
        &mut self,
        poses: &[Isometry3<f64>],
        weights: &[f64],
        links: &[usize],
    ) -> Result<Vec<Matrix6<f64>>, GraphError> {
        self.equations
            .linearize(self.graph, self.numbers, poses, weights);
        self.cholesky.factorize(&self.equations.matrix)?;
        let mut inverse = Inverse::new(&mut self.cholesky);
        let uncertainty = |&index: &usize| {
            let link = &self.graph.links[index];
            let jacobians = LinkAt::new(link, poses).jacobians(link, poses);
            let from = link.from.and_then(|from| self.numbers[from]);
            let ends = [from, self.numbers[link.to]].into_iter().zip(jacobians);
            let blocks: Vec<_> = ends
                .filter_map(|(end, J)| Some((end?, J.transpose())))
                .collect();
            inverse.quadratic(&blocks)
        };
        Ok(links.iter().map(uncertainty).collect())
    }

    /// Linearizes and solves.
    fn legs(&mut self, poses: &[Isometry3<f64>], weights: &[f64]) -> Result<Legs, GraphError> {
        let equations = &mut self.equations;
        equations.linearize(self.graph, self.numbers, poses, weights);
        let mut full: Vec<f64> = equations.gradient.iter().map(|g| -g).collect();
        self.cholesky.factorize(&equations.matrix)?;
        let n = full.len();
        self.cholesky
            .solve(MatMut::from_column_major_slice_mut(&mut full, n, 1));
        Ok(Legs::new(equations, full))
    }

    /// Moves to the first of ever shorter steps that lowers the cost; gives the new radius.
    fn advance(
        &self,
        best: &mut Minimum,
        legs: &Legs,
        weights: &[f64],
        mut radius: f64,
    ) -> Result<f64, GraphError> {
        while radius >= SMALLEST_REGION * legs.full_length {
            let step = legs.within(radius);
            let length = legs.length(&step);
            let promised = self.promised(&step);
            let poses = corrected(&best.poses, self.numbers, &step);
            let reached = cost(self.graph, &poses, weights)?;
            let kept = (best.cost - reached) / promised;
            if kept < 0.25 {
                radius = 0.25 * length;
            } else if kept > 0.75 {
                radius = radius.max(3.0 * length);
            }
            if reached <= best.cost {
                (best.poses, best.cost) = (poses, reached);
                return Ok(radius);
            }
            if best.converged {
                // The step is below what rounding lets the cost tell.
                return Ok(radius);
            }
        }
        Ok(radius)
    }

    /// By how much the linearized cost falls.
    fn promised(&self, step: &[f64]) -> f64 {
        let gradient = self.equations.gradient.iter().zip(step);
        let slope: f64 = gradient.map(|(g, s)| g * s).sum();
        -slope - 0.5 * self.equations.matrix.quadratic(step)
    }
}

/// The two legs of the path of best steps: down the gradient, then to the minimum of the
/// linearized cost.
struct Legs {
    /// Step to the lowest linearized cost down the gradient.
    descent: Vec<f64>,
    /// Step to the lowest linearized cost of all.
    full: Vec<f64>,
    full_length: f64,
    /// What the full step promises to take from the cost.
    promised: f64,
    /// Squared units of lengths.
    scale: Vec<f64>,
}

impl Legs {
    fn new(equations: &Equations, full: Vec<f64>) -> Self {
        let scale = equations.matrix.diagonal();
        let gradient = &equations.gradient;
        let mut descent: Vec<f64> = gradient.iter().zip(&scale).map(|(g, s)| -g / s).collect();
        let slope: f64 = gradient.iter().zip(&descent).map(|(g, d)| g * d).sum();
        let best = -slope / equations.matrix.quadratic(&descent).max(f64::MIN_POSITIVE);
        for d in &mut descent {
            *d *= best;
        }
        let product: f64 = gradient.iter().zip(&full).map(|(g, f)| g * f).sum();
        let full_length = length(&full, &scale);
        Self {
            descent,
            full,
            full_length,
            promised: -0.5 * product,
            scale,
        }
    }

    fn promises_little(&self, cost: f64, min_relative_decrease: f64) -> bool {
        let largest = self.full.iter().fold(0.0_f64, |m, s| m.max(s.abs()));
        self.promised <= min_relative_decrease * cost || largest < NEGLIGIBLE_STEP
    }

    fn length(&self, step: &[f64]) -> f64 {
        length(step, &self.scale)
    }

    /// The point of the path that is `radius` long, or its end.
    fn within(&self, radius: f64) -> Vec<f64> {
        if self.full_length <= radius {
            return self.full.clone();
        }
        let descent_length = self.length(&self.descent);
        if descent_length >= radius {
            let share = radius / descent_length;
            return self.descent.iter().map(|d| share * d).collect();
        }
        let leg: Vec<f64> = self
            .full
            .iter()
            .zip(&self.descent)
            .map(|(f, d)| f - d)
            .collect();
        // ‖descent + β leg‖² = radius², of which the root between 0 and 1 is taken.
        let a = dot(&leg, &leg, &self.scale);
        let b = dot(&self.descent, &leg, &self.scale);
        let c = descent_length * descent_length - radius * radius;
        let beta = -c / (b + (b * b - a * c).sqrt());
        self.descent
            .iter()
            .zip(&leg)
            .map(|(d, l)| d + beta * l)
            .collect()
    }
}

fn dot(a: &[f64], b: &[f64], scale: &[f64]) -> f64 {
    let products = a.iter().zip(b).zip(scale).map(|((a, b), s)| a * b * s);
    products.sum()
}

fn length(step: &[f64], scale: &[f64]) -> f64 {
    dot(step, step, scale).sqrt()
}

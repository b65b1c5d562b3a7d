// SPDX-License-Identifier: MIT OR Apache-2.0

use super::testing::equations;
use super::*;
use crate::RowGroup;

#[test]
fn dense_and_sparse_solutions_agree() {
    let equations = equations(40);
    let mut frozen = [false; N_GLOBALS];
    frozen[5] = true;
    let mut sparse = Solver {
        dense_limit: Some(0),
        ..Solver::default()
    };
    let mut dense = Solver {
        dense_limit: Some(usize::MAX),
        ..Solver::default()
    };
    for _ in 0..2 {
        let a = sparse.factorize(&equations, 3, &frozen).unwrap();
        let b = dense.factorize(&equations, 3, &frozen).unwrap();
        let (covariance, expected) = (a.marginals(&[]).covariance, b.marginals(&[]).covariance);
        assert!((covariance - expected).norm() < 1e-9 * expected.norm());
        for (p, q) in a.solve().knots.iter().zip(&b.solve().knots) {
            assert!(p.iter().zip(q).all(|(p, q)| (p - q).abs() < 1e-9));
        }
        assert_eq!(a.solve().globals[5], 0.0);
        assert_eq!(b.solve().knots[2], [0.0; 6]);
    }
}

/// `H⁻¹ H H⁻¹` is `H⁻¹`, whatever the rows.
#[test]
fn rows_that_err_twice_as_much_double_the_covariance() {
    let equations = equations(12);
    let mut frozen = [false; N_GLOBALS];
    frozen[7] = true;
    let system = Solver::default().factorize(&equations, 0, &frozen).unwrap();
    let n = 6 * 12 + N_GLOBALS;
    let rows = Mat::from_fn(n, 3, |i, j| ((3 * i + 7 * j) as f64).sin());
    let stated = system.covariance_of(&rows, &[]);
    let mut less = equations.clone();
    less.take_away(0.25, &equations);
    for (factor, excess, expected) in [(1.0, &equations, 2.0), (0.5, &less, 1.25)] {
        let found = system.sandwich_of(&rows, factor, excess);
        let difference = found - &stated * expected;
        assert!(difference.norm() < 1e-9 * stated.norm(), "{difference}");
    }
}

#[test]
fn an_unknown_without_information_is_named() {
    let mut equations = NormalEquations::new(1);
    let mut group = RowGroup::new([0]);
    for i in 0..6 {
        group.knots_mut().fill(0.0);
        group.knots_mut()[i] = 1.0;
        group.add(0.0, 1.0);
    }
    group.flush(&mut equations);
    let error = Solver::default().factorize(&equations, 0, &[false; N_GLOBALS]);
    let Err(SolveError::Singular { unknown }) = error else {
        panic!("expected an error")
    };
    assert_eq!(unknown, "the encoder zero");
}

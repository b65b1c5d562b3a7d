// SPDX-License-Identifier: MIT OR Apache-2.0
//! Why a pose graph cannot be solved.

use thiserror::Error;

/// Why a pose graph cannot be solved.
#[derive(Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum GraphError {
    /// There is one flag per pose.
    #[error("{n_nodes} poses but {n_fixed} flags of fixed ones")]
    LengthMismatch {
        /// Number of poses.
        n_nodes: usize,
        /// Number of flags.
        n_fixed: usize,
    },
    /// A link names a node that is not there.
    #[error("link {index} names node {node}, but there are {n_nodes}")]
    LinkWithoutNode {
        /// Index of the link.
        index: usize,
        /// Node it names.
        node: usize,
        /// Number of nodes.
        n_nodes: usize,
    },
    /// A gravity term names a node that is not there.
    #[error("gravity term {index} names node {node}, but there are {n_nodes}")]
    GravityWithoutNode {
        /// Index of the term.
        index: usize,
        /// Node it names.
        node: usize,
        /// Number of nodes.
        n_nodes: usize,
    },
    /// A link says nothing about a node by itself.
    #[error("link {index} leads from node {node} to itself")]
    SelfLink {
        /// Index of the link.
        index: usize,
        /// Its node.
        node: usize,
    },
    /// Nothing holds a node in the map.
    #[error("node {node} has no way over links to a fixed node or a prior")]
    Loose {
        /// The first such node.
        node: usize,
    },
    /// The links do not determine a node in all directions.
    #[error("the links do not determine the pose of node {node}")]
    Singular {
        /// The node.
        node: usize,
    },
    /// A pose, a measurement or a weight is NaN or infinite.
    #[error("the cost of the graph is not finite")]
    NotFinite,
    /// The factorization gave up for a reason of its own (memory, index range).
    #[error("the sparse factorization failed: {0}")]
    Factorization(String),
}

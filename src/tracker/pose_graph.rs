//! Poses from measured motions between them: a pose graph over keyframes, rigid or with scale, for closing loops.
//!
//! Enter: similarities `world_from_body` (rigid poses have scale 1) and edges with their information. Leave: the poses
//! that the edges agree on best, by Levenberg-Marquardt over a sparse block Cholesky factor. Metres, radians,
//! logarithms of scale. The order of nodes and edges fixes every sum, so equal input gives equal bytes.
//!
//! Error of an edge: `log(from_to^-1 world_from^-1 world_to)`; poses move on their right, `world_from_body exp(d)`
//! (Strasdat 2012, section 5).

mod blocks;

use crate::num::index;
use crate::tracker::lie::{Matrix7, Sim3, SimTwist};
use blocks::BlockSystem;
pub use blocks::Vector7;

/// How much an edge may pull that does not fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RobustKernel {
    /// Fully: for edges that cannot be wrong, like odometry.
    Full,
    /// Huber's, linear beyond this many sigmas.
    Huber(f64),
    /// Switchable: beyond `phi` in sigmas squared, an edge's pull fades to nothing (dynamic covariance scaling, Agarwal
    /// et al. 2013, as the kernel that MacTavish and Barfoot 2015 give for it). For loops, of which one may be false.
    Switchable(f64),
}

impl RobustKernel {
    /// Cost of a squared error in sigmas, and its slope: the weight of the edge.
    pub fn at(self, error2: f64) -> (f64, f64) {
        match self {
            Self::Full => (error2, 1.0),
            Self::Huber(sigmas) if error2 <= sigmas * sigmas => (error2, 1.0),
            Self::Huber(sigmas) => (2.0 * sigmas * error2.sqrt() - sigmas * sigmas, sigmas / error2.sqrt()),
            Self::Switchable(phi) if error2 <= phi => (error2, 1.0),
            Self::Switchable(phi) => {
                let share = 2.0 * phi / (phi + error2);
                (2.0 * share * error2 - phi, share * share)
            }
        }
    }
}

/// A measured motion between two nodes.
#[derive(Clone, Copy, Debug)]
pub struct Edge {
    /// Number of the node that measures.
    pub from: u32,
    /// Number of the node that is measured.
    pub to: u32,
    /// `from_body_from_to_body`.
    pub from_to: Sim3,
    /// Inverse covariance of the error: linear in 1/m^2, angular in 1/rad^2, scale. In a rigid graph the last row and
    /// column are not read.
    pub information: Matrix7,
    /// What happens to it where it does not fit.
    pub kernel: RobustKernel,
}

/// Nodes and edges.
#[derive(Clone, Debug, Default)]
pub struct PoseGraph {
    /// `world_from_body` of each node.
    pub nodes: Vec<Sim3>,
    /// Which nodes stay as they are. Where a connected part has none, its first node stays: some node must name the world.
    pub held: Vec<bool>,
    /// Motions between them.
    pub edges: Vec<Edge>,
    /// Whether scale moves (a mono map's drifts).
    pub scale_moves: bool,
}

/// What a solution took.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GraphOutcome {
    /// RobustKernel cost before.
    pub cost_before: f64,
    /// RobustKernel cost after; never above the one before.
    pub cost_after: f64,
    /// Systems solved.
    pub iterations: u32,
    /// Blocks of the factor below its diagonal: the work of one system.
    pub factor_blocks: usize,
    /// Whether the last step was below the wanted change.
    pub converged: bool,
}

/// A diagonal information from standard deviations.
pub fn information(linear_m: f64, angular_rad: f64, log_scale: f64) -> Matrix7 {
    let sigma = |k: usize| [linear_m, angular_rad, log_scale][k / 3];
    Matrix7::from_fn(|row, column| if row == column { 1.0 / (sigma(row) * sigma(row)) } else { 0.0 })
}

impl PoseGraph {
    /// A graph of nodes without edges, all free.
    pub fn new(nodes: Vec<Sim3>, scale_moves: bool) -> Self {
        let held = vec![false; nodes.len()];
        Self { nodes, held, edges: Vec::new(), scale_moves }
    }

    /// Adds the motion between two nodes as their poses have it now: odometry of a map that was good before the loop.
    pub fn add_present_edge(&mut self, from: u32, to: u32, information: Matrix7) {
        let from_to = self.nodes[index(from)].inverse().then(&self.nodes[index(to)]);
        self.edges.push(Edge { from, to, from_to, information, kernel: RobustKernel::Full });
    }

    /// Squared error of each edge in sigmas, before its kernel.
    pub fn errors2(&self) -> Vec<f64> {
        self.edges.iter().map(|edge| squared(&self.error(edge, &self.nodes), &self.information(edge))).collect()
    }

    /// Weight that each edge's kernel leaves it: near 0 for a loop that was switched off.
    pub fn weights(&self) -> Vec<f64> {
        self.edges.iter().zip(self.errors2()).map(|(edge, error2)| edge.kernel.at(error2).1).collect()
    }

    /// Moves the free nodes to the least cost with every switchable edge trusted first and then doubted step by step
    /// (graduated non-convexity, Yang et al. 2020): drift that stands between a true loop and its kernel's threshold is
    /// taken out before the threshold counts. The outcome's cost before is that of the last, full doubt.
    pub fn solve_graduated(&mut self, iterations_max: u32) -> GraphOutcome {
        let wanted: Vec<RobustKernel> = self.edges.iter().map(|edge| edge.kernel).collect();
        let excess = |(edge, error2): (&Edge, f64)| match edge.kernel {
            RobustKernel::Switchable(phi) => error2 / phi,
            RobustKernel::Full | RobustKernel::Huber(_) => 1.0,
        };
        let worst = self.edges.iter().zip(self.errors2()).map(excess).fold(1.0, crate::num::greater);
        // An edge that is off by more than a million sigmas is not worth more rounds.
        let mut factor = crate::num::lesser(worst, 1e12);
        while factor > 1.0 {
            for (edge, kernel) in self.edges.iter_mut().zip(&wanted) {
                if let RobustKernel::Switchable(phi) = kernel {
                    edge.kernel = RobustKernel::Switchable(phi * factor);
                }
            }
            self.solve(iterations_max);
            factor *= 0.5;
        }
        self.edges.iter_mut().zip(wanted).for_each(|(edge, kernel)| edge.kernel = kernel);
        self.solve(iterations_max)
    }

    /// Moves the free nodes to the least cost.
    pub fn solve(&mut self, iterations_max: u32) -> GraphOutcome {
        assert!(self.held.len() == self.nodes.len(), "each node is held or not");
        assert!(self.edges.iter().all(|edge| edge.from != edge.to), "an edge joins two nodes");
        let held = self.held_of_each_part();
        let links: Vec<(usize, usize)> = self.edges.iter().map(|edge| (index(edge.from), index(edge.to))).collect();
        let mut system = BlockSystem::new(&held, &links);
        let mut cost = self.cost(&self.nodes);
        let mut outcome = GraphOutcome { cost_before: cost, cost_after: cost, ..GraphOutcome::default() };
        let mut damping = 1e-6;
        self.linearise(&mut system);
        outcome.factor_blocks = system.factor_blocks();
        while outcome.iterations < iterations_max {
            outcome.iterations += 1;
            let Some(steps) = system.solve(damping) else {
                damping = 1e-6_f64.max(damping) * 10.0;
                if damping > 1e8 {
                    break;
                }
                continue;
            };
            let greatest = steps.iter().fold(0.0, |most, step| crate::num::greater(most, step.amax()));
            let moved = self.moved(&steps);
            let cost_next = self.cost(&moved);
            if cost_next <= cost {
                let gain = cost - cost_next;
                (self.nodes, cost) = (moved, cost_next);
                damping *= 0.1;
                outcome.converged = greatest < 1e-12 || gain <= 1e-14 * cost;
                self.linearise(&mut system);
            } else {
                // The cost is only known to its rounding: a step that moves nothing has arrived.
                outcome.converged = greatest < 1e-9;
                damping *= 10.0;
            }
            if outcome.converged || damping > 1e8 {
                break;
            }
        }
        outcome.cost_after = cost;
        outcome
    }

    /// The nodes that stay, at least one in each connected part.
    fn held_of_each_part(&self) -> Vec<bool> {
        let mut part: Vec<usize> = (0..self.nodes.len()).collect();
        let root = |part: &[usize], mut node: usize| {
            while part[node] != node {
                node = part[node];
            }
            node
        };
        for edge in &self.edges {
            let (a, b) = (root(&part, index(edge.from)), root(&part, index(edge.to)));
            part[a.max(b)] = a.min(b);
        }
        let mut held = self.held.clone();
        let mut named = vec![false; self.nodes.len()];
        for node in (0..self.nodes.len()).filter(|&node| self.held[node]) {
            named[root(&part, node)] = true;
        }
        for node in 0..self.nodes.len() {
            // The root of a part is its first node.
            held[node] |= part[node] == node && !named[node];
        }
        held
    }

    fn error(&self, edge: &Edge, nodes: &[Sim3]) -> SimTwist {
        let now = nodes[index(edge.from)].inverse().then(&nodes[index(edge.to)]);
        edge.from_to.inverse().then(&now).log()
    }

    /// The edge's information over what may move.
    fn information(&self, edge: &Edge) -> Matrix7 {
        let mut information = edge.information;
        if !self.scale_moves {
            information.fill_row(6, 0.0);
            information.fill_column(6, 0.0);
        }
        information
    }

    fn cost(&self, nodes: &[Sim3]) -> f64 {
        let cost = |edge: &Edge| edge.kernel.at(squared(&self.error(edge, nodes), &self.information(edge))).0;
        self.edges.iter().map(cost).sum()
    }

    fn moved(&self, steps: &[Vector7]) -> Vec<Sim3> {
        let step = |step: &Vector7| {
            let mut numbers: [f64; 7] = (*step).into();
            if !self.scale_moves {
                numbers[6] = 0.0;
            }
            Sim3::exp(SimTwist::from_array(numbers))
        };
        self.nodes.iter().zip(steps).map(|(node, by)| node.then(&step(by))).collect()
    }

    fn linearise(&self, system: &mut BlockSystem) {
        system.clear();
        for edge in &self.edges {
            let (from, to) = (index(edge.from), index(edge.to));
            let error = self.error(edge, &self.nodes);
            let information = self.information(edge);
            let (_, weight) = edge.kernel.at(squared(&error, &information));
            // The error is log(from_to^-1 exp(-Ad(to_from) d_from) ... exp(d_to)), so both act on its right.
            let mut by_to = Sim3::right_jacobian_inverse(error);
            let to_from = self.nodes[to].inverse().then(&self.nodes[from]);
            let mut by_from = -(by_to * to_from.adjoint());
            if !self.scale_moves {
                by_to.fill_column(6, 0.0);
                by_from.fill_column(6, 0.0);
            }
            let pull = information * weight;
            let pulled = pull * Vector7::from(error.to_array());
            system.add_rhs(from, &-(by_from.transpose() * pulled));
            system.add_rhs(to, &-(by_to.transpose() * pulled));
            system.add_block(from, from, &(by_from.transpose() * pull * by_from));
            system.add_block(to, to, &(by_to.transpose() * pull * by_to));
            system.add_block(to, from, &(by_to.transpose() * pull * by_from));
        }
        if !self.scale_moves {
            // Scale stands still: a system of its own that answers 0.
            system.rest_scale();
        }
    }
}

fn squared(error: &SimTwist, information: &Matrix7) -> f64 {
    let error = Vector7::from(error.to_array());
    crate::num::greater(error.dot(&(information * error)), 0.0)
}

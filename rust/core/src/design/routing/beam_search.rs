//! Routings built up from disk to disk, the nearest to the wanted places followed.
//!
//! Under given tensions T, the frame of a disk is a product of subsegments that each know their own two holes
//! only. A beginning of a routing has the squared distances of its disks as its cost, which what follows cannot
//! lower, and their slopes by the tensions: it is judged at the tensions within a window about T that suit it
//! best, to first order of its places.

use nalgebra::Vector3;

use super::quadratic_cost::QuadraticCost;
use super::subsegment_table::{Link, SubsegmentTables};
use super::task::{Holes, Task};
use crate::lie::Pose;

/// Beginning of a routing, and its cost.
#[derive(Clone)]
struct Node {
    pose: Pose,
    /// Velocity and angular velocity of its last disk by each tension.
    rates: Vec<(Vector3<f64>, Vector3<f64>)>,
    cost: QuadraticCost,
    /// Its place in the level before, and its choice on its last disk.
    parent: usize,
    choice: usize,
}

/// A whole routing that a search ended with.
pub(super) struct Leaf {
    pub(super) holes: Holes,
    /// Tensions that suit it best, as far as the slopes tell.
    pub(super) tensions: Vec<f64>,
    /// Sum of squared distances there, to first order of the places \[m²\].
    pub(super) value: f64,
    /// Half its slopes at the window's tensions.
    pub(super) slope: Vec<f64>,
}

impl Node {
    fn add(&mut self, link: &Link<'_>, target: &Vector3<f64>, velocity: &mut [Vector3<f64>]) {
        let arm = self.pose.rotation * link.end.translation;
        for ((own, its), v) in self.rates.iter_mut().zip(link.rates).zip(velocity.iter_mut()) {
            own.0 += own.1.cross(&arm) + self.pose.rotation * its.0;
            own.1 += self.pose.rotation * its.1;
            *v = own.0;
        }
        self.pose = self.pose.compose(link.end);
        self.cost.add_pulls(link.pulls, link.pull_slopes);
        self.cost.add(&(self.pose.translation - target), velocity);
    }
}

/// The tensions of a search, and how far from them it looks.
pub(super) struct Window<'w> {
    pub(super) tensions: &'w [f64],
    pub(super) width: &'w [f64],
}

/// Routings of the tables' choices, nearest first, as many as the beam is wide. Nothing when it was stopped.
pub(super) fn beam_search(
    task: &Task<'_>,
    tables: &SubsegmentTables,
    window: &Window<'_>,
) -> Option<Vec<Leaf>> {
    // Window about the tensions T: changes δ from `lower` to `upper`, none of which makes a tension negative.
    let count = task.tendons();
    let upper = window.width;
    let tensions = window.tensions.iter().zip(upper);
    let lower: Vec<f64> = tensions.map(|(t, width)| -width.min(*t)).collect();
    let mut change = vec![0.0; count];
    let mut velocity = vec![Vector3::zeros(); count];
    let root = |choice| Node {
        pose: *task.robot.base(),
        rates: vec![(Vector3::zeros(), Vector3::zeros()); count],
        cost: QuadraticCost::of(task),
        parent: 0,
        choice,
    };
    // Level 0: every choice on the base disk, at G₀ = base.
    let mut levels: Vec<Vec<Node>> = vec![(0..tables.choices[0].len()).map(root).collect()];
    let shares = task.shares();
    let mut child = root(0);
    for (i, target) in task.targets.iter().enumerate() {
        // Children: every beginning goes on by every choice, and is judged at min over δ of |r + D δ|².
        let nodes = levels.last()?;
        let mut found: Vec<(f64, usize, usize)> = Vec::new();
        for (parent, node) in nodes.iter().enumerate() {
            if task.is_stopped() {
                return None;
            }
            for choice in 0..tables.choices[i + 1].len() {
                let Some(link) = tables.link(i, node.choice, choice) else { continue };
                child.clone_from(node);
                child.add(&link, target, &mut velocity);
                child.cost.penalise(task, shares[i]);
                found.push((child.cost.least(&lower, upper, &mut change), parent, choice));
            }
        }
        // Beam: the nearest children stay, ties by their place.
        let order = |a: &(f64, usize, usize), b: &(f64, usize, usize)| {
            a.0.total_cmp(&b.0).then_with(|| (a.1, a.2).cmp(&(b.1, b.2)))
        };
        let width = task.settings.beam_width;
        if found.len() > width {
            found.select_nth_unstable_by(width, order);
            found.truncate(width);
        }
        found.sort_by(order);
        // They are built anew: of the others only the costs were needed.
        let next = found.iter().filter_map(|&(_, parent, choice)| {
            let mut child = nodes[parent].clone();
            let link = tables.link(i, child.choice, choice)?;
            child.add(&link, target, &mut velocity);
            Some(Node { parent, choice, ..child })
        });
        let next = next.collect();
        levels.push(next);
    }
    // Whole routings, each at its own T + δ.
    let mut leaves = Vec::new();
    for (place, node) in levels.last()?.iter().enumerate() {
        let mut cost = node.cost.clone();
        cost.penalise(task, 1.0);
        let value = cost.least(&lower, upper, &mut change);
        let tensions = window.tensions.iter().zip(&change).map(|(t, c)| t + c).collect();
        let holes = trace_holes(tables, &levels, place);
        leaves.push(Leaf { holes, tensions, value, slope: cost.slope });
    }
    Some(leaves)
}

/// The holes that led to a place of the last level.
fn trace_holes(tables: &SubsegmentTables, levels: &[Vec<Node>], mut place: usize) -> Holes {
    let mut holes = vec![Vec::new(); levels.len()];
    for (disk, level) in levels.iter().enumerate().rev() {
        let node = &level[place];
        holes[disk].clone_from(&tables.choices[disk][node.choice]);
        place = node.parent;
    }
    holes
}

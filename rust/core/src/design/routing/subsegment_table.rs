//! Shapes of all subsegments between all holes that neighbouring disks may have, under given tensions.

use nalgebra::Vector3;

use super::task::Task;
use crate::lie::Pose;
use crate::rod::one_subsegment::OneSubsegment;

/// Numbers of the holes of all tendons on one disk.
pub(super) type Choice = Vec<usize>;

/// Equilibrium of a subsegment between two choices: its end, and the velocity and angular velocity of that by each
/// tension, tendon by tendon.
struct Entry {
    end: Pose,
    rates: Vec<(Vector3<f64>, Vector3<f64>)>,
    /// Its share of the displacements, and its rows of slopes; empty where they have no bounds.
    pulls: Vec<f64>,
    pull_slopes: Vec<f64>,
    strains: Vec<f64>,
}

/// Entries of one subsegment, or of several that are alike; rows for the choices of its base disk.
struct Table {
    stage: OneSubsegment,
    disk: usize,
    entries: Vec<Option<Entry>>,
}

/// All subsegments' shapes between the choices of their disks.
pub(super) struct SubsegmentTables {
    /// Choices of every disk.
    pub(super) choices: Vec<Vec<Choice>>,
    count: usize,
    tables: Vec<Table>,
    /// Table of every subsegment.
    which: Vec<usize>,
}

/// An entry as a search sees it.
pub(super) struct Link<'f> {
    pub(super) end: &'f Pose,
    pub(super) rates: &'f [(Vector3<f64>, Vector3<f64>)],
    pub(super) pulls: &'f [f64],
    pub(super) pull_slopes: &'f [f64],
}

impl SubsegmentTables {
    /// For disks with `count` holes of which they may have these.
    pub(super) fn new(task: &Task<'_>, choices: Vec<Vec<Choice>>, count: usize) -> Self {
        let places = |disk: usize| {
            choices[disk].iter().map(move |choice| {
                (0..task.tendons())
                    .filter(|k| task.end(*k) >= disk)
                    .map(|k| task.hole(k, disk, choice[k], count))
                    .collect::<Vec<_>>()
            })
        };
        let (mut tables, mut which): (Vec<Table>, Vec<usize>) = (Vec::new(), Vec::new());
        for i in 0..task.targets.len() {
            let stage = OneSubsegment::new(&task.plan, i);
            let same = tables.iter().position(|table| {
                table.stage.bends_like(&stage)
                    && (0..2).all(|end| places(i + end).eq(places(table.disk + end)))
            });
            which.push(same.unwrap_or(tables.len()));
            if same.is_none() {
                tables.push(Table { stage, disk: i, entries: Vec::new() });
            }
        }
        Self { choices, count, tables, which }
    }

    /// Solves all entries under tensions, from what they were under the last ones. False when it was stopped.
    pub(super) fn fill(&mut self, task: &Task<'_>, tensions: &[f64]) -> bool {
        let Self { choices, count, tables, .. } = self;
        for Table { stage, disk, entries } in tables {
            let (disk, count) = (*disk, *count);
            let (from, to) = (&choices[disk], &choices[disk + 1]);
            let first = entries.is_empty();
            entries.resize_with(from.len() * to.len(), || None);
            for (a, base) in from.iter().enumerate() {
                if task.is_stopped() {
                    return false;
                }
                for (b, next) in to.iter().enumerate() {
                    let entry = &mut entries[a * to.len() + b];
                    let near = entry.as_ref().map_or(&[][..], |entry| &entry.strains);
                    let allowed =
                        stage.tendons().iter().all(|k| task.allows(base[*k], next[*k], count));
                    // What had no shape under less tension has none under more.
                    if !allowed || (!first && near.is_empty()) {
                        *entry = None;
                        continue;
                    }
                    stage.route(|k| {
                        (task.hole(k, disk, base[k], count), task.hole(k, disk + 1, next[k], count))
                    });
                    *entry = stage.solve(tensions, near).then(|| Entry::of(task, stage));
                }
            }
        }
        true
    }

    /// The shape of a subsegment between two choices, if it has one.
    pub(super) fn link(&self, subsegment: usize, from: usize, to: usize) -> Option<Link<'_>> {
        let count = self.choices[subsegment + 1].len();
        let entry = self.tables[self.which[subsegment]].entries[from * count + to].as_ref()?;
        let Entry { end, rates, pulls, pull_slopes, .. } = entry;
        Some(Link { end, rates, pulls, pull_slopes })
    }

    /// Equilibria that were asked for.
    pub(super) fn equilibria(&self) -> usize {
        self.tables.iter().map(|table| table.stage.solved).sum()
    }
}

impl Entry {
    /// Last solution of a subsegment.
    fn of(task: &Task<'_>, stage: &mut OneSubsegment) -> Self {
        let tendons = task.tendons();
        let mut rates = vec![(Vector3::zeros(), Vector3::zeros()); tendons];
        for (k, rate) in stage.tendons().iter().zip(stage.rates().column_iter()) {
            rates[*k] = (rate.fixed_rows::<3>(0).into(), rate.fixed_rows::<3>(3).into());
        }
        let (pulls, pull_slopes) = if task.bounds.is_some() {
            stage.displacements(tendons)
        } else {
            (Vec::new(), Vec::new())
        };
        let strains = stage.strains().to_vec();
        Self { end: stage.end(), rates, pulls, pull_slopes, strains }
    }
}

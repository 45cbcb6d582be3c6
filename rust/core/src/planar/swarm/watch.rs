//! Decisions of the watcher of a search.

/// What whoever watches a search wants.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WatchDecision {
    /// To go on.
    GoOn,
    /// The best that there is by now.
    Finish,
    /// Nothing any more.
    Abandon,
}

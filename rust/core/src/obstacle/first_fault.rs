//! First fault of a caller's distance function, shared by all work that it ends.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use super::Fault;

/// Cell for the first fault of an obstacle's function, with the flag that stops all other work then. Clones share both.
///
/// ```
/// use tdcr::obstacle::FirstFault;
///
/// let cell = FirstFault::default();
/// cell.keep("no map there".into());
/// cell.keep("too late".into());
/// assert_eq!(cell.take().map(|fault| fault.to_string()), Some("no map there".to_owned()));
/// ```
#[derive(Clone, Debug, Default)]
pub struct FirstFault {
    fault: Arc<Mutex<Option<Fault>>>,
    stop: Arc<AtomicBool>,
}

impl FirstFault {
    /// Empty cell that raises a flag of the caller's.
    #[must_use]
    pub fn raising(stop: Arc<AtomicBool>) -> Self {
        Self { fault: Arc::default(), stop }
    }

    /// Flag that is raised with the first fault.
    #[must_use]
    pub fn stop(&self) -> &Arc<AtomicBool> {
        &self.stop
    }

    /// Keeps a fault, unless there was one before, and raises the flag.
    pub fn keep(&self, fault: Fault) {
        self.fault.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(fault);
        // Only now: others fail because of the flag, and their faults come too late.
        self.stop.store(true, Ordering::SeqCst);
    }

    /// Presence of a fault.
    #[must_use]
    pub fn is_set(&self) -> bool {
        self.fault.lock().unwrap_or_else(PoisonError::into_inner).is_some()
    }

    /// Takes the fault out, if there is one. The flag stays as it is.
    #[must_use]
    pub fn take(&self) -> Option<Fault> {
        self.fault.lock().unwrap_or_else(PoisonError::into_inner).take()
    }
}

//! Work that Ctrl-C can stop: it goes on without the GIL while the calling thread listens.

use std::sync::atomic::Ordering;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;

use tdcr::batch::Control;

/// Time from one look at signals, and one report of progress, to the next.
pub(crate) const POLL: Duration = Duration::from_millis(50);

/// Runs `job` with the GIL released. If it may take longer than until the first look at signals, it runs on another
/// thread, as [`run`] does it. The caller estimates the microseconds of a hard case from docs/benchmarks.md.
pub(crate) fn run_if_long<T: Send>(
    py: Python<'_>,
    estimated_microseconds: f64,
    job: impl FnOnce(&Control) -> T + Send,
) -> PyResult<T> {
    if estimated_microseconds < POLL.as_secs_f64() * 1e6 {
        return Ok(py.detach(|| job(&Control::default())));
    }
    run(py, None, job)
}

/// Runs `job` on another thread with the GIL released. Every 50 ms signal handlers run and
/// `progress` (a Python callable) gets the rows finished so far; an exception from either stops the
/// job and propagates.
pub(crate) fn run<T: Send>(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    job: impl FnOnce(&Control) -> T + Send,
) -> PyResult<T> {
    let control = Control::default();
    let progress = progress.map(|callable| callable.clone().unbind());
    let (answer, interrupt) = py.detach(|| {
        thread::scope(|scope| {
            let (finished, waiting) = channel();
            let control = &control;
            let worker = scope.spawn(move || {
                let answer = job(control);
                // The listener may have gone after an interrupt; then nobody waits for this.
                let _ = finished.send(());
                answer
            });
            let mut interrupt = None;
            while let Err(RecvTimeoutError::Timeout) = waiting.recv_timeout(POLL) {
                if let Err(error) = Python::attach(|py| listen(py, progress.as_ref(), control)) {
                    control.stop.store(true, Ordering::Relaxed);
                    interrupt = Some(error);
                    break;
                }
            }
            (worker.join(), interrupt)
        })
    });
    if let Some(error) = interrupt {
        return Err(error);
    }
    let answer = answer.map_err(|_| PyRuntimeError::new_err("a worker thread of tdcr failed"))?;
    if let Some(callable) = progress {
        callable.call1(py, (control.done.load(Ordering::Relaxed),))?;
    }
    Ok(answer)
}

fn listen(py: Python<'_>, progress: Option<&Py<PyAny>>, control: &Control) -> PyResult<()> {
    py.check_signals()?;
    if let Some(callable) = progress {
        callable.call1(py, (control.done.load(Ordering::Relaxed),))?;
    }
    Ok(())
}

//! Thread pools of our own, so that a host program's rayon settings and ours stay apart.

use std::process;
use std::sync::{Arc, Mutex, PoisonError};

use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::error::InvalidInput;

/// A pool and the process and size it was built for. A forked child has the parent's pools but none
/// of their threads, so it must not use (nor drop) them.
struct Entry {
    process: u32,
    threads: usize,
    pool: Arc<ThreadPool>,
}

static POOLS: Mutex<Vec<Entry>> = Mutex::new(Vec::new());

/// Most threads a pool is built with.
const MOST_THREADS: usize = 1024;

/// The pool with `threads` threads, all cores by default; built on first use, then kept.
///
/// # Errors
/// `InvalidInput` for zero threads, more than 1024, or when the system refuses to start them.
pub fn pool(threads: Option<usize>) -> Result<Arc<ThreadPool>, InvalidInput> {
    let threads =
        threads.unwrap_or_else(|| std::thread::available_parallelism().map_or(1, usize::from));
    if threads == 0 || threads > MOST_THREADS {
        let expected = format!("1 to {MOST_THREADS} threads, or none for all cores");
        return Err(InvalidInput::new("threads", expected, threads));
    }
    let process = process::id();
    let mut pools = POOLS.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(entry) = pools.iter().find(|e| e.process == process && e.threads == threads) {
        return Ok(Arc::clone(&entry.pool));
    }
    let pool = ThreadPoolBuilder::new()
        .num_threads(threads)
        .thread_name(|i| format!("tdcr-{i}"))
        .build()
        .map_err(|e| InvalidInput::new("threads", "a number the system can start", e))?;
    let pool = Arc::new(pool);
    pools.push(Entry { process, threads, pool: Arc::clone(&pool) });
    Ok(pool)
}

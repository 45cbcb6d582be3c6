//! Values that higher rooms derive from a robot and keep with it.

use std::any::Any;
use std::fmt;
use std::sync::{Arc, Mutex, PoisonError};

type Value = Arc<dyn Any + Send + Sync>;

/// One value per type, made on first use and shared by all copies of a robot. The robot does not know the types.
#[derive(Clone, Default)]
pub(super) struct Derived(Arc<Mutex<Vec<Value>>>);

impl Derived {
    /// Value of a type, made from its default on first use.
    pub(super) fn get<T: Any + Default + Send + Sync>(&self) -> Arc<T> {
        let mut values = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let known = values.iter().find_map(|value| Arc::clone(value).downcast().ok());
        known.unwrap_or_else(|| {
            let value = Arc::<T>::default();
            values.push(Arc::clone(&value) as Value);
            value
        })
    }
}

impl fmt::Debug for Derived {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Derived")
    }
}

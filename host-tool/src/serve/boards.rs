//! The boards that clients share.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError, Weak};

use crate::board::choose;
use crate::error::ToolError;
use crate::serve::device::Device;

/// The boards that clients speak to, by name.
pub(crate) struct Boards {
    /// The one for clients that choose none.
    default: Option<String>,
    /// A device goes with the last client that speaks to it, and its board is free then.
    open: Mutex<BTreeMap<String, Weak<Device>>>,
}

impl Boards {
    /// `default` is the one for clients that choose none.
    pub(crate) fn new(default: Option<String>) -> Self {
        Self {
            default,
            open: Mutex::default(),
        }
    }

    /// The board called `name`, or the one for those who choose none.
    ///
    /// # Errors
    /// Where there is none.
    pub(crate) fn device(&self, name: Option<&str>) -> Result<Arc<Device>, ToolError> {
        let found = choose(name.or(self.default.as_deref()))?;
        let mut open = self.open.lock().unwrap_or_else(PoisonError::into_inner);
        open.retain(|_, device| device.strong_count() > 0);
        if let Some(device) = open.get(&found.name).and_then(Weak::upgrade) {
            return Ok(device);
        }
        let device = Arc::new(Device::new(found));
        open.insert(device.found().name.clone(), Arc::downgrade(&device));
        Ok(device)
    }

    /// Those that somebody speaks to.
    pub(crate) fn devices(&self) -> Vec<Arc<Device>> {
        let open = self.open.lock().unwrap_or_else(PoisonError::into_inner);
        open.values().filter_map(Weak::upgrade).collect()
    }
}

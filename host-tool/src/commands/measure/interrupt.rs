//! Ctrl-C, heard at any time.

use std::sync::Arc;

use tokio::signal::unix::{SignalKind, signal};
use tokio::sync::Notify;

use crate::error::ToolError;

/// Hears Ctrl-C for as long as the tool runs, and keeps one that comes while nobody waits for it.
#[derive(Clone)]
pub(super) struct Interrupt(Arc<Notify>);

impl Interrupt {
    /// From now on Ctrl-C no longer ends the tool by itself.
    pub(super) fn listen() -> Result<Self, ToolError> {
        let interrupt = Self(Arc::new(Notify::new()));
        let mut signals = signal(SignalKind::interrupt()).map_err(ToolError::Runtime)?;
        let told = interrupt.clone();
        tokio::spawn(async move {
            while signals.recv().await.is_some() {
                told.0.notify_one();
            }
        });
        Ok(interrupt)
    }

    /// Waits for it.
    pub(super) async fn comes(&self) {
        self.0.notified().await;
    }
}

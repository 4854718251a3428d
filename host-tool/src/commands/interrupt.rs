//! Ctrl-C, heard at any time, and the request to end that is no key (SIGTERM): both are called Ctrl-C here.

use std::process;
use std::sync::Arc;

use tokio::sync::Notify;

use crate::error::ToolError;
use crate::system::Interrupts;
use crate::{failure, working};

/// Computes: Ctrl-C ends the tool at any moment, in words.
pub(super) fn computed<T>(
    json: bool,
    work: impl FnOnce() -> Result<T, ToolError>,
) -> Result<T, ToolError> {
    let mut interrupts = Interrupts::listen().map_err(ToolError::Runtime)?;
    let heard = tokio::spawn(async move {
        if interrupts.next().await {
            working::end();
            process::exit(failure::tell(ToolError::WorkInterrupted, json).into());
        }
    });
    let done = work();
    heard.abort();
    done
}

/// Hears Ctrl-C for as long as the tool runs, and keeps one that comes while nobody waits for it.
#[derive(Clone)]
pub(crate) struct Interrupt(Arc<Notify>);

impl Interrupt {
    /// From now on Ctrl-C no longer ends the tool by itself.
    pub(crate) fn listen() -> Result<Self, ToolError> {
        let interrupt = Self(Arc::new(Notify::new()));
        let mut interrupts = Interrupts::listen().map_err(ToolError::Runtime)?;
        let told = interrupt.clone();
        tokio::spawn(async move {
            while interrupts.next().await {
                told.0.notify_one();
            }
        });
        Ok(interrupt)
    }

    /// What comes of `work`.
    ///
    /// # Errors
    /// [`ToolError::Interrupted`] where Ctrl-C comes before `work` is done, which then ends where it is.
    pub(crate) async fn or<T>(
        &self,
        work: impl Future<Output = Result<T, ToolError>>,
    ) -> Result<T, ToolError> {
        self.or_else(work, || ToolError::Interrupted).await
    }

    /// What comes of `work`, or `interrupted` where Ctrl-C comes before it is done, which then ends where it is.
    pub(crate) async fn or_else<T>(
        &self,
        work: impl Future<Output = Result<T, ToolError>>,
        interrupted: impl FnOnce() -> ToolError,
    ) -> Result<T, ToolError> {
        tokio::select! {
            done = work => done,
            () = self.comes() => Err(interrupted()),
        }
    }

    /// Waits for it.
    pub(crate) async fn comes(&self) {
        self.0.notified().await;
    }
}

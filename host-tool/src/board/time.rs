//! The board's own time, which is the count of its control ticks.

use std::time::Duration;

use mirror_protocol::Status;
use quantities::Span;
use tokio::time::sleep;

use super::answer::ANSWER_TIMEOUT;
use super::link::Board;
use crate::error::ToolError;

impl Board {
    /// The board's time from one control tick to a later one.
    pub fn span(&self, from_tick: u32, to_tick: u32) -> Span {
        let ticks = to_tick.wrapping_sub(from_tick);
        Span {
            s: f64::from(ticks) / f64::from(self.identity().tick_hz),
        }
    }

    /// Waits until the board's own time is `span` past the control tick `tick`.
    ///
    /// # Errors
    /// Where the board does not answer, or its time stands still.
    pub async fn wait(&self, tick: u32, span: Span) -> Result<(), ToolError> {
        self.wait_while(tick, span, |_| Ok(())).await
    }

    /// The same, for as long as `look` has nothing against what the board tells of itself now and then.
    ///
    /// # Errors
    /// As of [`Self::wait`], and what `look` has against it.
    pub async fn wait_while(
        &self,
        tick: u32,
        span: Span,
        look: impl Fn(&Status) -> Result<(), ToolError>,
    ) -> Result<(), ToolError> {
        let ticks = (span.s * f64::from(self.identity().tick_hz)).round() as u32;
        let mut passed = 0;
        let mut last_progress = tokio::time::Instant::now();
        while passed < ticks {
            let status = self.status().await?;
            look(&status)?;
            let now = status.telemetry.tick.wrapping_sub(tick);
            if now != passed {
                (passed, last_progress) = (now, tokio::time::Instant::now());
            } else if last_progress.elapsed() > ANSWER_TIMEOUT {
                return Err(ToolError::ControlStopped);
            }
            sleep(Duration::from_millis(20)).await;
        }
        Ok(())
    }
}

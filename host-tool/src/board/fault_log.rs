//! The board's fault log.

use mirror_protocol::{FaultLogEndpoint, LogEntry, LogPage, LogQuery};

use super::view::View;
use crate::error::ToolError;

impl View {
    /// The fault log: what is known besides its entries, and the entries, the newest first.
    ///
    /// # Errors
    /// Where the board does not answer, or refuses.
    pub async fn fault_log(&self) -> Result<(LogPage, Vec<LogEntry>), ToolError> {
        let mut page = self.log_page(u32::MAX).await?;
        let mut entries: Vec<LogEntry> = page.entry.take().into_iter().collect();
        while let Some(most) = entries.last().and_then(|last| last.number.checked_sub(1)) {
            let Some(entry) = self.log_page(most).await?.entry else {
                break;
            };
            entries.push(entry);
        }
        Ok((page, entries))
    }

    async fn log_page(&self, most: u32) -> Result<LogPage, ToolError> {
        let request = "tell its fault log";
        let query = LogQuery { most };
        let reply = self.ask::<FaultLogEndpoint>(request, &query).await?;
        self.granted(request, reply)
    }
}

//! The two calibrations of a board: the mirror's, and the current sense's.

use control_core::Calibration;
use mirror_protocol::{
    CalibrationChunk, CalibrationEndpoint, CalibrationInfo, CalibrationQuery,
    CalibrationReadEndpoint, CalibrationRefusal, CalibrationRevertEndpoint, CalibrationUse,
    CalibrationUseEndpoint, CalibrationWriteEndpoint, Chunk, Sense, SenseEndpoint, SenseInfo,
    SetSenseEndpoint,
};

use super::link::Board;
use super::view::View;
use crate::error::ToolError;

impl View {
    /// The calibration in use.
    ///
    /// # Errors
    /// Where the board does not answer, or refuses.
    pub async fn calibration(&self) -> Result<CalibrationInfo, ToolError> {
        let request = "tell its calibration";
        let reply = self.ask::<CalibrationEndpoint>(request, &()).await?;
        self.granted(request, reply)
    }

    /// The whole calibration that was last put to use for good; `None` where it is of a format that this tool does not know.
    ///
    /// # Errors
    /// Where the board does not answer, or refuses.
    pub async fn settled_calibration(&self) -> Result<Option<Calibration>, ToolError> {
        let request = "read out its calibration";
        let mut bytes = Vec::new();
        loop {
            let query = CalibrationQuery {
                offset: bytes.len() as u16,
            };
            let reply = self.ask::<CalibrationReadEndpoint>(request, &query).await?;
            let piece = self.granted(request, reply)?.bytes;
            if piece.is_empty() {
                return Ok(Calibration::from_bytes(&bytes).ok());
            }
            bytes.extend(piece);
        }
    }

    /// What the current sense is taken to be off by.
    ///
    /// # Errors
    /// Where the board does not answer, or refuses.
    pub async fn sense(&self) -> Result<SenseInfo, ToolError> {
        let request = "tell its current sense";
        let reply = self.ask::<SenseEndpoint>(request, &()).await?;
        self.granted(request, reply)
    }
}

impl Board {
    /// Uploads `calibration` and has the board use it, for good or on trial, which turns all channels off.
    ///
    /// # Errors
    /// Where the board does not answer, or keeps the one that it has.
    pub async fn use_calibration(
        &self,
        calibration: &Calibration,
        usage: CalibrationUse,
    ) -> Result<CalibrationInfo, ToolError> {
        let request = "take a calibration";
        let mut offset = 0;
        for piece in calibration.to_bytes().chunks(Chunk::new().capacity()) {
            let chunk = CalibrationChunk {
                offset,
                bytes: Chunk::from_slice(piece).unwrap_or_default(),
            };
            let reply = self
                .ask::<CalibrationWriteEndpoint>(request, &chunk)
                .await?;
            self.granted(request, reply)?;
            offset += piece.len() as u16;
        }
        let reply = self.ask::<CalibrationUseEndpoint>(request, &usage).await?;
        reply.map_err(|refusal| match refusal {
            CalibrationRefusal::Refused(refusal) => ToolError::Refused { request, refusal },
            CalibrationRefusal::Unusable(reason) => ToolError::CalibrationRefused {
                reason: reason.as_str().to_owned(),
            },
        })
    }

    /// Ends a trial, if there is one: the calibration of before is in use again, and all channels are off.
    ///
    /// # Errors
    /// Where the board does not answer, or refuses.
    pub async fn revert_calibration(&self) -> Result<CalibrationInfo, ToolError> {
        let request = "go back to its calibration";
        let reply = self.ask::<CalibrationRevertEndpoint>(request, &()).await?;
        self.granted(request, reply)
    }

    /// Has the board correct its current sense by `sense`, which turns all channels off.
    ///
    /// # Errors
    /// Where the board does not answer, or refuses.
    pub async fn set_sense(&self, sense: &Sense) -> Result<SenseInfo, ToolError> {
        let request = "correct its current sense";
        let reply = self.ask::<SetSenseEndpoint>(request, sense).await?;
        self.granted(request, reply)
    }
}

//! A calibration on its way from the link to the control loop.

use control_core::calibration::BYTES;
use control_core::{Calibration, CalibrationError};
use mirror_protocol::{CalibrationChunk, CalibrationUse, Chunk, Refusal};

use crate::keeper::Record;
use crate::mailbox::LinkSide;

/// Takes a calibration in pieces, checks the whole, and hands it to the control loop. The one in use
/// stays in use until then; one that is only tried gives way to the one before again.
pub struct Upload {
    record: &'static mut Record,
    received: usize,
    /// Where the next calibration is made. The control loop gives the one before in return.
    spare: Option<&'static mut Calibration>,
    /// The last one that was put to use for good.
    settled: &'static mut Calibration,
    is_on_trial: bool,
}

/// Why a calibration that was uploaded is not used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UploadError {
    /// The control loop did not take it.
    ControlStopped,
    /// It is not one.
    Calibration(CalibrationError),
}

impl Upload {
    /// Uploads go to the start of `record`, and what they make into `spare`. `settled` is in use.
    pub fn new(
        record: &'static mut Record,
        spare: &'static mut Calibration,
        settled: &'static mut Calibration,
    ) -> Self {
        Self {
            record,
            received: 0,
            spare: Some(spare),
            settled,
            is_on_trial: false,
        }
    }

    /// The next piece; one at offset 0 begins anew.
    ///
    /// # Errors
    /// Where it does not follow the piece before, or goes beyond a calibration's length.
    pub fn write(&mut self, chunk: &CalibrationChunk) -> Result<(), Refusal> {
        let start = usize::from(chunk.offset);
        if start != 0 && start != self.received {
            return Err(Refusal::UploadGap {
                expected: self.received as u16,
            });
        }
        let end = start + chunk.bytes.len();
        let room = self.record.get_mut(..BYTES);
        let place = room
            .and_then(|room| room.get_mut(start..end))
            .ok_or(Refusal::UploadTooLong)?;
        place.copy_from_slice(&chunk.bytes);
        self.received = end;
        Ok(())
    }

    /// A piece of the last calibration that was put to use for good.
    pub fn read(&self, offset: u16) -> CalibrationChunk {
        let bytes = self.settled.to_bytes();
        let rest = bytes.get(offset.into()..).unwrap_or_default();
        let piece = rest.chunks(Chunk::new().capacity()).next();
        CalibrationChunk {
            offset,
            // It has room for a piece.
            bytes: Chunk::from_slice(piece.unwrap_or_default()).unwrap_or_default(),
        }
    }

    /// What was uploaded so far.
    fn bytes(&self) -> &[u8] {
        self.record.get(..self.received).unwrap_or_default()
    }

    /// The record at whose start the upload lies.
    pub fn record(&mut self) -> &mut Record {
        self.record
    }

    /// The record for another use; what was uploaded is forgotten.
    pub fn into_buffer(&mut self) -> &mut Record {
        self.received = 0;
        self.record
    }

    /// Checks what was uploaded and has the control loop use it. On return it is in use, and what `of` makes of it is returned: the
    /// calibration itself would be copied on the stack.
    ///
    /// # Errors
    /// Says what is wrong; the calibration in use is kept.
    pub async fn put_to_use<T>(
        &mut self,
        mailbox: LinkSide,
        usage: CalibrationUse,
        of: impl FnOnce(&Calibration) -> T,
    ) -> Result<T, UploadError> {
        let calibration =
            Calibration::from_bytes(self.bytes()).map_err(UploadError::Calibration)?;
        let next = self.spare.take().ok_or(UploadError::ControlStopped)?;
        *next = calibration;
        self.exchange(mailbox, next).await?;
        self.is_on_trial = usage == CalibrationUse::OnTrial;
        if !self.is_on_trial {
            *self.settled = calibration;
        }
        Ok(of(&calibration))
    }

    /// Ends a trial: the control loop uses the last one again that was put to use for good, which is returned. Where none
    /// is on trial nothing happens.
    ///
    /// # Errors
    /// Where the control loop did not take it; the trial goes on.
    pub async fn revert(&mut self, mailbox: LinkSide) -> Result<&Calibration, UploadError> {
        if self.is_on_trial {
            let next = self.spare.take().ok_or(UploadError::ControlStopped)?;
            *next = *self.settled;
            self.exchange(mailbox, next).await?;
            self.is_on_trial = false;
        }
        Ok(self.settled)
    }

    async fn exchange(
        &mut self,
        mailbox: LinkSide,
        next: &'static mut Calibration,
    ) -> Result<(), UploadError> {
        match mailbox.exchange(next).await {
            Ok(before) => {
                self.spare = Some(before);
                Ok(())
            }
            Err(not_taken) => {
                self.spare = not_taken;
                Err(UploadError::ControlStopped)
            }
        }
    }
}

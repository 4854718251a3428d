//! What the endpoints know and remember, and how they order and refuse.

use core::cell::RefCell;

use control_core::Calibration;
use mirror_protocol::{
    CalibrationInfo, CommandReply, Kept, Lever, OptionBytes, PROTOCOL_VERSION, Refusal, Sentence,
    Text,
};
use protection::Denied;

use crate::board::Board;
use crate::calibration::Upload;
use crate::fault_log::FaultLog;
use crate::keeper::Keeper;
use crate::mailbox::{Failure, LinkSide, Order};

/// What the endpoints know and remember.
pub struct Session {
    pub(super) board: &'static str,
    pub(super) is_emulated: bool,
    pub(super) mailbox: LinkSide,
    pub(super) calibration: CalibrationInfo,
    pub(super) upload: Upload,
    pub(super) keeper: Keeper,
    pub(super) fault_log: &'static RefCell<FaultLog>,
    /// Why the firmware stopped before this start.
    pub(super) last_stop: Sentence,
    pub(super) option_bytes: Option<OptionBytes>,
    pub(super) bootloader: Option<fn() -> !>,
    /// Protocol version of the tool that greeted last.
    pub(super) tool: Option<u16>,
    /// Stops that were before that greeting.
    pub(super) stops: u32,
}

impl Session {
    /// A session before any greeting.
    pub fn new<B: Board>(
        mailbox: LinkSide,
        calibration: &Calibration,
        upload: Upload,
        keeper: Keeper,
        fault_log: &'static RefCell<FaultLog>,
    ) -> Self {
        Self {
            board: B::NAME,
            is_emulated: B::IS_EMULATED,
            mailbox,
            calibration: info(calibration, keeper.kept()),
            upload,
            keeper,
            fault_log,
            last_stop: Sentence::new(),
            option_bytes: B::option_bytes(),
            bootloader: B::BOOTLOADER,
            tool: None,
            stops: 0,
        }
    }

    /// Tells with every status why the firmware stopped before this start.
    #[must_use]
    pub fn after(self, last_stop: Sentence) -> Self {
        Self { last_stop, ..self }
    }

    pub(super) fn check_version(&self) -> Result<(), Refusal> {
        match self.tool {
            Some(PROTOCOL_VERSION) => Ok(()),
            Some(tool) => Err(Refusal::ProtocolVersion {
                board: PROTOCOL_VERSION,
                tool,
            }),
            None => Err(Refusal::NoHello),
        }
    }

    /// A tool that drove while somebody stopped the board does not go on: it ends, or greets and begins anew.
    pub(super) fn check_may_drive(&self) -> Result<(), Refusal> {
        self.check_version()?;
        if self.stops == self.mailbox.stops() {
            Ok(())
        } else {
            Err(Refusal::NoHello)
        }
    }

    pub(super) async fn drive(&self, order: Order) -> CommandReply {
        self.check_may_drive()?;
        self.order(order).await
    }

    pub(super) async fn order(&self, order: Order) -> CommandReply {
        self.check_version()?;
        self.mailbox.order(order).await.map_err(refusal)
    }
}

/// What is told of a calibration.
pub(super) fn info(calibration: &Calibration, kept: Kept) -> CalibrationInfo {
    let origin = &calibration.parts().origin;
    CalibrationInfo {
        device: text(origin.device.as_str()),
        date: text(origin.date.as_str()),
        model_hash: origin.model_hash,
        max_position_um: calibration.max_position().0,
        max_drive_v: calibration.max_drive().0,
        cold_resistance_ohm: calibration
            .actuators()
            .each_ref()
            .map(|channel| channel.cold_resistance.0),
        tcr_per_k: calibration
            .actuators()
            .each_ref()
            .map(|channel| channel.tcr.0),
        levers: calibration.parts().plate.levers.map(|lever| Lever {
            x_um: lever.x.0,
            y_um: lever.y.0,
            warp: lever.warp,
        }),
        kept,
    }
}

/// Why the control loop did not carry an order out, as the tool is told.
pub(super) fn refusal(failure: Failure) -> Refusal {
    match failure {
        Failure::ControlStopped => Refusal::ControlStopped,
        Failure::Cooling => Refusal::Cooling,
        Failure::Stopped => Refusal::NoHello,
        Failure::Denied(Denied::NoLease) => Refusal::NoLease,
        Failure::Denied(Denied::Tripped(fault)) => Refusal::Tripped {
            fault: fault.code(),
        },
    }
}

/// `text` as far as it fits.
pub(super) fn text(text: &str) -> Text {
    let mut short = Text::new();
    for character in text.chars() {
        if short.push(character).is_err() {
            break;
        }
    }
    short
}

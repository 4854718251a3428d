//! What every board does between reset and first tick: load what is kept, and tell what went wrong before.

use core::cell::RefCell;

use control_core::{Calibration, Controller};
use mirror_protocol::ResetCause;
use static_cell::{ConstStaticCell, StaticCell};

use crate::board::{Board, BoardFlash};
use crate::calibration::Upload;
use crate::control::Control;
use crate::fault_log::FaultLog;
use crate::flash::divide;
use crate::keeper::{Keeper, RECORD_BYTES, Record};
use crate::mailbox::{ControlSide, LinkSide};
use crate::origin::Origin;
use crate::rpc::Session;

/// Where calibrations live, and what is kept in flash.
pub struct Memory {
    /// What is uploaded.
    pub uploaded: &'static mut Record,
    /// Takes the calibration in use.
    pub in_use: fn(Calibration) -> &'static mut Calibration,
    /// Takes another, in whose place the next one is made.
    pub spare: fn(Calibration) -> &'static mut Calibration,
    /// Takes the one that comes back when another was only tried.
    pub settled: fn(Calibration) -> &'static mut Calibration,
    /// Takes the flash.
    pub flash: fn(BoardFlash) -> &'static RefCell<BoardFlash>,
    /// Takes the fault log.
    pub fault_log: fn(FaultLog) -> &'static RefCell<FaultLog>,
}

impl Memory {
    /// That of an image, which has it once.
    pub fn of_the_image() -> Self {
        static UPLOADED: ConstStaticCell<Record> = ConstStaticCell::new([0; RECORD_BYTES]);
        static IN_USE: StaticCell<Calibration> = StaticCell::new();
        static SPARE: StaticCell<Calibration> = StaticCell::new();
        static SETTLED: StaticCell<Calibration> = StaticCell::new();
        static FLASH: StaticCell<RefCell<BoardFlash>> = StaticCell::new();
        static FAULT_LOG: StaticCell<RefCell<FaultLog>> = StaticCell::new();
        Self {
            uploaded: UPLOADED.take(),
            in_use: |calibration| IN_USE.init(calibration),
            spare: |calibration| SPARE.init(calibration),
            settled: |calibration| SETTLED.init(calibration),
            flash: |flash| FLASH.init(RefCell::new(flash)),
            fault_log: |log| FAULT_LOG.init(RefCell::new(log)),
        }
    }
}

/// The link's side of the application and the control loop's, as they begin.
pub fn start<B: Board>(
    flash: Option<BoardFlash>,
    memory: Memory,
    origin: Origin,
    (link, control_loop): (LinkSide, ControlSide),
) -> (Session, Control) {
    let (log, calibrations) = flash.map(|flash| divide((memory.flash)(flash))).unzip();
    let fault_log = (memory.fault_log)(FaultLog::start(log, &origin));
    let mut keeper = Keeper::new(calibrations);
    let calibration = (memory.in_use)(keeper.load(memory.uploaded));
    let bad_calibration = keeper.fault();
    let sense = *keeper.sense();
    let spare = (memory.spare)(*calibration);
    let upload = Upload::new(memory.uploaded, spare, (memory.settled)(*calibration));
    let mut session = Session::new::<B>(link, calibration, upload, keeper, fault_log);
    let mut controller = Controller::new(calibration);
    if origin.cause != ResetCause::Power
        && let Some(retained) = origin.retained.kept()
    {
        controller.recall(&retained);
    }
    let mut control = Control::new(controller, &sense, control_loop, origin.retained);
    if let Some(fault) = bad_calibration {
        control.trip(fault);
    }
    if let Some(stopped) = origin.last_stop {
        control.trip(stopped.fault);
        session = session.after(stopped.text);
    }
    (session, control)
}

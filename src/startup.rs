//! What every board does between reset and first tick: load what is kept, and tell what went wrong before.

use control_core::{Calibration, Controller};
use mirror_protocol::Sentence;
use protection::Fault;
use static_cell::{ConstStaticCell, StaticCell};

use crate::board::{Board, CalibrationFlash};
use crate::calibration::Upload;
use crate::control::Control;
use crate::keeper::{Keeper, RECORD_BYTES, Record};
use crate::mailbox::{ControlSide, LinkSide};
use crate::rpc::Session;

/// Why the firmware stopped before this start.
pub struct LastStop {
    /// Which kind of stop.
    pub fault: Fault,
    /// Where, or what it said.
    pub text: Sentence,
}

/// Where calibrations live.
pub struct Memory {
    /// What is uploaded.
    pub uploaded: &'static mut Record,
    /// Takes the calibration in use.
    pub in_use: fn(Calibration) -> &'static mut Calibration,
    /// Takes another, in whose place the next one is made.
    pub spare: fn(Calibration) -> &'static mut Calibration,
    /// Takes the one that comes back when another was only tried.
    pub settled: fn(Calibration) -> &'static mut Calibration,
}

impl Memory {
    /// That of an image, which has it once.
    pub fn of_the_image() -> Self {
        static UPLOADED: ConstStaticCell<Record> = ConstStaticCell::new([0; RECORD_BYTES]);
        static IN_USE: StaticCell<Calibration> = StaticCell::new();
        static SPARE: StaticCell<Calibration> = StaticCell::new();
        static SETTLED: StaticCell<Calibration> = StaticCell::new();
        Self {
            uploaded: UPLOADED.take(),
            in_use: |calibration| IN_USE.init(calibration),
            spare: |calibration| SPARE.init(calibration),
            settled: |calibration| SETTLED.init(calibration),
        }
    }
}

/// The link's side of the application and the control loop's, as they begin.
pub fn start<B: Board>(
    flash: Option<CalibrationFlash>,
    memory: Memory,
    last_stop: Option<LastStop>,
    (link, control_loop): (LinkSide, ControlSide),
) -> (Session, Control) {
    let mut keeper = Keeper::new(flash);
    let calibration = (memory.in_use)(keeper.load(memory.uploaded));
    let bad_calibration = keeper.fault();
    let sense = *keeper.sense();
    let spare = (memory.spare)(*calibration);
    let upload = Upload::new(memory.uploaded, spare, (memory.settled)(*calibration));
    let mut session = Session::new::<B>(link, calibration, upload, keeper);
    let mut control = Control::new(Controller::new(calibration), &sense, control_loop);
    if let Some(fault) = bad_calibration {
        control.trip(fault);
    }
    if let Some(stopped) = last_stop {
        control.trip(stopped.fault);
        session = session.after(stopped.text);
    }
    (session, control)
}

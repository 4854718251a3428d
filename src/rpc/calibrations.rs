//! The endpoints of the two calibrations: the mirror's, and the current sense's.

use core::fmt::Write;

use control_core::{Ampere, Calibration, SenseCalibration};
use mirror_protocol::{
    CalibrationChunk, CalibrationInfo, CalibrationQuery, CalibrationReadReply, CalibrationRefusal,
    CalibrationReply, CalibrationUse, CalibrationUseReply, CalibrationWriteReply, Kept, Refusal,
    Sense, SenseReply, Sentence,
};
use postcard_rpc::header::VarHeader;

use super::session::{Session, info};
use crate::calibration::UploadError;
use crate::mailbox::Order;

pub(super) fn calibration(session: &mut Session, _header: VarHeader, (): ()) -> CalibrationReply {
    session.check_version()?;
    Ok(session.calibration.clone())
}

pub(super) fn read_calibration(
    session: &mut Session,
    _header: VarHeader,
    query: CalibrationQuery,
) -> CalibrationReadReply {
    session.check_version()?;
    Ok(session.upload.read(query.offset))
}

pub(super) fn write_calibration(
    session: &mut Session,
    _header: VarHeader,
    chunk: CalibrationChunk,
) -> CalibrationWriteReply {
    session.check_version()?;
    session.upload.write(&chunk)
}

pub(super) async fn use_calibration(
    session: &mut Session,
    _header: VarHeader,
    usage: CalibrationUse,
) -> CalibrationUseReply {
    session
        .check_version()
        .map_err(CalibrationRefusal::Refused)?;
    let told = |calibration: &Calibration| info(calibration, Kept::OnTrial);
    let used = session
        .upload
        .put_to_use(session.mailbox, usage, told)
        .await;
    let used = used.map_err(|error| match error {
        UploadError::ControlStopped => CalibrationRefusal::Refused(Refusal::ControlStopped),
        UploadError::Calibration(error) => {
            let mut sentence = Sentence::new();
            // What does not fit is left out.
            let _ = write!(sentence, "{error}");
            CalibrationRefusal::Unusable(sentence)
        }
    })?;
    let kept = match usage {
        CalibrationUse::OnTrial => Kept::OnTrial,
        CalibrationUse::ForGood => {
            // The exchange has turned all channels off.
            session.keeper.keep(session.upload.record());
            session.keeper.kept()
        }
    };
    session.calibration = CalibrationInfo { kept, ..used };
    Ok(session.calibration.clone())
}

pub(super) async fn revert_calibration(
    session: &mut Session,
    _header: VarHeader,
    (): (),
) -> CalibrationReply {
    session.check_version()?;
    let settled = session.upload.revert(session.mailbox).await;
    let settled = settled.map_err(|_| Refusal::ControlStopped)?;
    session.calibration = info(settled, session.keeper.kept());
    Ok(session.calibration.clone())
}

pub(super) fn sense(session: &mut Session, _header: VarHeader, (): ()) -> SenseReply {
    session.check_version()?;
    Ok(session.keeper.sense_info())
}

/// Turns all channels off first: what is driven was computed from currents read otherwise.
pub(super) async fn set_sense(
    session: &mut Session,
    _header: VarHeader,
    sense: Sense,
) -> SenseReply {
    session.order(Order::Off).await?;
    let sense = SenseCalibration::new(sense.zero_a.map(Ampere), sense.gain)
        .ok_or(Refusal::SenseImplausible)?;
    session.mailbox.calibrate_sense(sense);
    session
        .keeper
        .keep_sense(sense, session.upload.into_buffer());
    Ok(session.keeper.sense_info())
}

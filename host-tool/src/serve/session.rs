//! What one client says, carried out.

use std::net::SocketAddr;
use std::sync::Arc;

use calibration::PlatePose;
use mirror_protocol::{CalibrationInfo, Status};
use quantities::{Length, Span, Voltage};
use tokio::sync::watch;

use crate::board::{Board, check_drives, check_position};
use crate::commands::kept_words;
use crate::commands::pose::{reach, reached};
use crate::error::{BeyondBoard, ToolError};
use crate::scpi::{self, Error, Group, Kind, Unit, event, quoted, units};
use crate::serve::action::{Action, Question, Registers};
use crate::serve::answers::{boards, numbers, read_from};
use crate::serve::boards::Boards;
use crate::serve::commands::read;
use crate::serve::device::{Asked, Client, Device, Moved};
use crate::serve::failure::{stopped, told};
use crate::serve::states::{
    has_tripped, is_own, is_settling, kept_away, operation, questionable, settles_in,
};
use crate::serve::trace::{self, COLUMNS, TraceError};
use crate::tilted_pose::TiltedPose;

/// The board that a session speaks to, once it has spoken to one.
type SpeakingTo = Option<Arc<Device>>;

/// One client's conversation.
pub(super) struct Session {
    boards: Arc<Boards>,
    client: Arc<Client>,
    speaking_to: watch::Sender<SpeakingTo>,
    /// How long the client says that a mirror takes to settle; `None`: as the board foresees.
    settling: Option<Span>,
    /// Stops of the board that this client knows of, and drives nevertheless.
    known_stops: u32,
    /// *OPC was said and has not come true.
    awaits_complete: bool,
}

/// While a client waits for the mirror to settle it is looked after so often whether it still moves: as soon as a person would notice.
const LOOKED_AFTER: Span = Span { s: 0.1 };

/// What a command answers: bytes, or nothing.
type Answer = Result<Option<Vec<u8>>, Error>;

impl Session {
    pub(super) fn new(boards: Arc<Boards>, address: SocketAddr) -> Self {
        let status = std::sync::Mutex::default();
        Self {
            boards,
            client: Arc::new(Client { address, status }),
            speaking_to: watch::Sender::new(None),
            settling: None,
            known_stops: 0,
            awaits_complete: false,
        }
    }

    pub(super) fn client(&self) -> Arc<Client> {
        self.client.clone()
    }

    /// The board that is spoken to, now and later.
    pub(super) fn speaking_to(&self) -> watch::Receiver<SpeakingTo> {
        self.speaking_to.subscribe()
    }

    /// Carries out a line, and returns what is to be answered: all answers of a line stand in one.
    pub(super) async fn answer(&mut self, line: &[u8]) -> Vec<u8> {
        let Ok(line) = std::str::from_utf8(line) else {
            let said = "the line is no text; write commands in ASCII";
            self.fail(Error::new(Kind::InvalidCharacter, said));
            return Vec::new();
        };
        let mut answers = Vec::new();
        for unit in units(line.trim()) {
            let answer = match unit {
                Ok(unit) => self.carry_out(&unit).await,
                Err(error) => Err(error),
            };
            match answer {
                Ok(Some(answer)) => answers.push(answer),
                Ok(None) => {}
                Err(error) => self.fail(error),
            }
        }
        let mut answer = answers.join(&b';');
        if !answer.is_empty() {
            answer.push(b'\n');
        }
        answer
    }

    /// The client has gone.
    pub(super) async fn end(&mut self) {
        if let Some(device) = self.speaking_to.send_replace(None) {
            // A board that does not answer ramps to zero by itself.
            let _ = device.release(&self.client).await;
        }
    }

    fn fail(&self, error: Error) {
        self.client.status().push(error);
    }

    /// The board that is spoken to.
    fn device(&mut self) -> Result<Arc<Device>, Error> {
        if let Some(device) = &*self.speaking_to.borrow() {
            return Ok(device.clone());
        }
        let device = self.boards.device(None).map_err(|error| told(&error))?;
        self.speak_to(device.clone());
        Ok(device)
    }

    fn speak_to(&mut self, device: Arc<Device>) {
        self.known_stops = device.stops();
        self.speaking_to.send_replace(Some(device));
    }

    async fn carry_out(&mut self, unit: &Unit) -> Answer {
        match read(unit)? {
            Action::Ask(question) => {
                let answer = self.text(question).await?;
                return Ok(Some(answer.into_bytes()));
            }
            Action::Trace(count, period) => return self.trace(count, period).await.map(Some),
            Action::SelectBoard(name) => {
                let device = self
                    .boards
                    .device(Some(&name))
                    .map_err(|error| told(&error))?;
                self.end().await;
                self.speak_to(device);
            }
            Action::SetPosition(z) => self.set_position(z).await?,
            Action::SetPose(pose) => self.set_pose(pose).await?,
            Action::SetDrives(volts) => self.set_drives(volts).await?,
            Action::SetSettling(settling) => self.settling = Some(settling),
            Action::SetOutput(true) => {
                let said = "a position or voltages turn the outputs on: SOURce:POSition 120um";
                return Err(Error::new(Kind::SettingsConflict, said));
            }
            Action::SetOutput(false) => self.device()?.off(&self.client).await?,
            Action::ClearFaults => {
                self.device()?.take(&self.client)?;
                self.ask(async |board| board.clear().await).await?;
            }
            Action::ReleaseLock => self.device()?.release(&self.client).await?,
            Action::Reset => {
                self.settling = None;
                self.device()?.release(&self.client).await?;
            }
            Action::Wait => self.settle().await?,
            Action::Complete => self.awaits_complete = true,
            Action::ClearStatus => {
                self.awaits_complete = false;
                self.client.status().clear();
            }
            Action::SetEventEnable(mask) => self.client.status().event_enable = mask,
            Action::SetServiceEnable(mask) => self.client.status().set_service_enable(mask),
            Action::SetEnable(which, mask) => group(&mut self.client.status(), which).enable = mask,
            Action::Preset => {
                for which in [Registers::Questionable, Registers::Operation] {
                    group(&mut self.client.status(), which).enable = 0;
                }
            }
        }
        Ok(None)
    }

    /// The answer to what is answered in text.
    async fn text(&mut self, question: Question) -> Result<String, Error> {
        Ok(match question {
            Question::EventEnable => self.client.status().event_enable.to_string(),
            Question::ServiceEnable => self.client.status().service_enable().to_string(),
            Question::NextError => self.client.status().next_error(),
            Question::ErrorCount => self.client.status().error_count().to_string(),
            Question::Version => "1999.0".to_owned(),
            Question::Settling => numbers([self.settling.map(|settling| settling.s)]),
            Question::TraceColumns => quoted(&COLUMNS.map(|(name, _)| name).join(",")),
            Question::Boards => boards(),
            Question::Board => quoted(&self.device()?.found().name),
            Question::LockOwner => {
                let driver = self.device()?.driver();
                driver.map_or("NONE".to_owned(), |driver| quoted(&driver))
            }
            Question::RequestLock => self.request_lock().await?,
            Question::AwaitComplete => {
                self.settle().await?;
                "1".to_owned()
            }
            Question::Identify => self.identify().await?,
            Question::Calibration => {
                let calibration = self.calibration().await?;
                let CalibrationInfo {
                    device, date, kept, ..
                } = &calibration;
                [device.as_str(), date.as_str(), kept_words(*kept)]
                    .map(quoted)
                    .join(",")
            }
            Question::SelfTest => {
                let (status, calibration) = (self.status().await?, self.calibration().await?);
                let is_sound = is_own(calibration.kept) && !has_tripped(&status);
                u8::from(!is_sound).to_string()
            }
            Question::TakeEvent => {
                self.note_complete().await?;
                self.client.status().take_event().to_string()
            }
            Question::StatusByte => {
                self.note_complete().await?;
                self.note_states().await?;
                self.client.status().byte().to_string()
            }
            Question::TakeStates(which) => {
                self.note_states().await?;
                group(&mut self.client.status(), which)
                    .take_event()
                    .to_string()
            }
            Question::States(which) => {
                self.note_states().await?;
                group(&mut self.client.status(), which)
                    .condition()
                    .to_string()
            }
            Question::Enable(which) => group(&mut self.client.status(), which).enable.to_string(),
            Question::Position => numbers([self.asked_pose()?.map(|pose| pose.z_um * 1e-6)]),
            Question::Pose => {
                let pose = self.asked_pose()?.map(|pose| {
                    let tilts = [pose.tilt_x_rad, pose.tilt_y_rad];
                    [pose.z_um * 1e-6, tilts[0], tilts[1]].map(Some)
                });
                numbers(pose.unwrap_or_default())
            }
            Question::Drives => match self.asked()? {
                Some(Asked::Drives(volts)) => numbers(volts.map(Some)),
                _ => numbers([None; 4]),
            },
            Question::Read(reading) => read_from(reading, &self.status().await?),
        })
    }

    async fn identify(&mut self) -> Result<String, Error> {
        let name = self.device()?.found().name.clone();
        let identity = self.ask(async |board| Ok(board.identity().clone())).await?;
        let fields = [
            "host-tool",
            &identity.board,
            &name,
            &identity.firmware_version,
        ];
        Ok(fields.map(|field| field.replace([',', ';'], " ")).join(","))
    }

    /// What comes of asking the board.
    async fn ask<T>(
        &mut self,
        question: impl AsyncFnOnce(&Board) -> Result<T, ToolError>,
    ) -> Result<T, Error> {
        let device = self.device()?;
        let board = device.board().await.map_err(|error| told(&error))?;
        let answer = question(&board).await;
        device.heard(&board, answer).await
    }

    async fn status(&mut self) -> Result<Status, Error> {
        self.ask(async |board| board.status().await).await
    }

    async fn calibration(&mut self) -> Result<CalibrationInfo, Error> {
        self.ask(async |board| board.calibration().await).await
    }

    fn asked(&mut self) -> Result<Option<Asked>, Error> {
        Ok(self.device()?.moved().map(|moved| moved.asked))
    }

    fn asked_pose(&mut self) -> Result<Option<PlatePose>, Error> {
        Ok(match self.asked()? {
            Some(Asked::Pose(pose)) => Some(pose),
            _ => None,
        })
    }

    async fn set_position(&mut self, z: Length) -> Result<(), Error> {
        check_position(z, &self.status().await?).map_err(beyond)?;
        self.drive(Asked::Pose(PlatePose {
            z_um: z.um,
            ..PlatePose::default()
        }))
        .await
    }

    async fn set_pose(&mut self, asked: TiltedPose) -> Result<(), Error> {
        let status = self.status().await?;
        let reach = self.ask(async |board| reach(board, &status).await).await?;
        let pose = reached(asked, &reach).map_err(beyond)?;
        self.drive(Asked::Pose(pose)).await
    }

    async fn set_drives(&mut self, volts: [f64; 4]) -> Result<(), Error> {
        let asked = volts.map(|v| Voltage { v });
        check_drives(asked, &self.status().await?).map_err(beyond)?;
        self.drive(Asked::Drives(volts)).await
    }

    async fn drive(&mut self, asked: Asked) -> Result<(), Error> {
        let device = self.device()?;
        if device.stops() != self.known_stops {
            return Err(stopped());
        }
        device.drive(&self.client, asked, self.settling).await
    }

    async fn request_lock(&mut self) -> Result<String, Error> {
        let device = self.device()?;
        if device.take(&self.client).is_err() {
            return Ok("0".to_owned());
        }
        let stops = device.stops();
        if stops != self.known_stops {
            device.greet_again().await?;
            self.known_stops = stops;
        }
        Ok("1".to_owned())
    }

    /// The last command of this client that drives, if what it asked for is still held.
    fn own_move(&self) -> Option<(Arc<Device>, Moved)> {
        let device = self.speaking_to.borrow().clone()?;
        let moved = device
            .moved()
            .filter(|_| device.is_driven_by(&self.client))?;
        Some((device, moved))
    }

    /// Waits until the mirror has settled after what this client asked for last.
    async fn settle(&mut self) -> Result<(), Error> {
        while let Some((_, moved)) = self.own_move() {
            let status = self.status().await?;
            let tick = status.telemetry.tick;
            let left = self
                .ask(async |board| Ok(settles_in(board, &status, moved)))
                .await?;
            if left.s == 0.0 {
                return self.note_kept_away(&status, moved).await;
            }
            // What another client, or another tool, turns off does not settle: looked after now and then.
            let left = Span {
                s: left.s.min(LOOKED_AFTER.s),
            };
            self.ask(async |board| board.wait(tick, left).await).await?;
        }
        Ok(())
    }

    /// A wait ends: that a mirror stays away from where it was asked to be goes into the queue, beside the answer.
    async fn note_kept_away(&mut self, status: &Status, moved: Moved) -> Result<(), Error> {
        let away = self.ask(async |board| Ok(kept_away(board, status, moved)));
        if let Some(error) = away.await? {
            self.fail(error);
        }
        Ok(())
    }

    /// *OPC comes true once the mirror has settled.
    async fn note_complete(&mut self) -> Result<(), Error> {
        if !self.awaits_complete {
            return Ok(());
        }
        if let Some((_, moved)) = self.own_move() {
            let status = self.status().await?;
            let is_settling = self
                .ask(async |board| Ok(is_settling(board, &status, moved)))
                .await?;
            if is_settling {
                return Ok(());
            }
            self.note_kept_away(&status, moved).await?;
        }
        self.awaits_complete = false;
        self.client.status().raise(event::OPERATION_COMPLETE);
        Ok(())
    }

    /// Takes the board's states into the registers.
    async fn note_states(&mut self) -> Result<(), Error> {
        let device = self.device()?;
        let (status, calibration) = (self.status().await?, self.calibration().await?);
        let is_stopped = device.stops() != self.known_stops;
        let is_settling = match device.moved() {
            Some(moved) => {
                self.ask(async |board| Ok(is_settling(board, &status, moved)))
                    .await?
            }
            None => false,
        };
        let mut registers = self.client.status();
        registers.questionable.update(questionable(
            &status,
            calibration.kept,
            is_stopped,
            device.moved(),
        ));
        registers.operation.update(operation(&status, is_settling));
        Ok(())
    }

    async fn trace(&mut self, count: u32, period: Span) -> Result<Vec<u8>, Error> {
        let device = self.device()?;
        let _alone = device.tracing.lock().await;
        let board = device.board().await.map_err(|error| told(&error))?;
        match trace::take(&board, count, period).await {
            Ok(block) => Ok(block),
            Err(TraceError::Scpi(error)) => Err(error),
            Err(TraceError::Tool(error)) => device.heard(&board, Err(error)).await,
        }
    }
}

fn beyond(error: BeyondBoard) -> Error {
    told(&error.into())
}

fn group(status: &mut scpi::Status, which: Registers) -> &mut Group {
    match which {
        Registers::Questionable => &mut status.questionable,
        Registers::Operation => &mut status.operation,
    }
}

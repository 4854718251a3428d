//! The control tick: converter codes in, PWM codes out.

use control_core::{Controller, LANES, PwmCode, Setpoint};
use mirror_protocol::{Commanded, Stream, Telemetry};

use crate::board::{Board, Sensed};
use crate::mailbox::Mailbox;

/// Runs the control loop on `board`, a tick at a time, for ever.
pub async fn run(mut board: impl Board, mut control: Control) -> ! {
    loop {
        let sensed = board.sense().await;
        let codes = control.tick(sensed);
        board.drive(codes);
    }
}

/// The state from one tick to the next.
pub struct Control {
    controller: Controller<'static>,
    mailbox: &'static Mailbox,
    setpoint: Setpoint,
    applied: [PwmCode; LANES],
    tick: u32,
    stream: Pacer,
}

impl Control {
    /// A loop that starts with all channels off.
    pub fn new(controller: Controller<'static>, mailbox: &'static Mailbox) -> Self {
        Self {
            controller,
            mailbox,
            setpoint: Setpoint::Off,
            applied: [PwmCode(0); LANES],
            tick: 0,
            stream: Pacer::default(),
        }
    }

    /// One tick: `sensed` are the codes read while the codes of the last tick were driven; the
    /// result is driven next.
    pub fn tick(&mut self, sensed: Sensed) -> [PwmCode; LANES] {
        if let Some(calibration) = self.mailbox.take_calibration() {
            // Drives computed under another calibration mean nothing.
            self.setpoint = Setpoint::Off;
            let before = self.controller.exchange(calibration);
            self.mailbox.return_calibration(before);
        }
        let command = self.mailbox.take_command();
        self.setpoint = command.unwrap_or(self.setpoint);

        let applied = self.applied.map(PwmCode::drive);
        let currents = sensed.currents.map(|code| code.current());
        let step = self.controller.step(self.setpoint, applied, currents);
        let codes = step.drives.map(PwmCode::nearest);

        let telemetry = Telemetry {
            tick: self.tick,
            drive_v: applied.map(|drive| drive.0),
            current_a: currents.map(|current| current.0),
            temperature_k: step
                .sense
                .map(|lane| lane.map(|lane| lane.temperature_rise.0)),
            limits: step.limits.bits(),
            sensor_z_um: sensed.sensor_z.map(|z| z.0),
        };
        self.report(command.is_some(), codes, telemetry);
        self.applied = codes;
        self.tick = self.tick.wrapping_add(1);
        codes
    }

    fn report(&mut self, commanded: bool, codes: [PwmCode; LANES], telemetry: Telemetry) {
        self.mailbox.publish(telemetry);
        if commanded {
            self.mailbox.confirm(Commanded {
                tick: telemetry.tick,
                drive_v: codes.map(|code| code.drive().0),
                limits: telemetry.limits,
            });
        }
        if let Some(stream) = self.mailbox.take_stream() {
            self.stream = Pacer::new(stream);
            self.mailbox.begin_stream(telemetry.tick);
        }
        if self.stream.is_due() {
            self.mailbox.send_sample(telemetry);
        }
    }
}

/// Picks the ticks that a stream asked for.
#[derive(Default)]
struct Pacer {
    period_ticks: u16,
    ticks_to_next: u16,
    samples_left: u32,
}

impl Pacer {
    fn new(stream: Stream) -> Self {
        Self {
            period_ticks: stream.period_ticks,
            ticks_to_next: 1,
            samples_left: stream.count,
        }
    }

    fn is_due(&mut self) -> bool {
        if self.samples_left == 0 {
            return false;
        }
        self.ticks_to_next = self.ticks_to_next.saturating_sub(1);
        if self.ticks_to_next > 0 {
            return false;
        }
        self.ticks_to_next = self.period_ticks;
        self.samples_left -= 1;
        true
    }
}

//! The control tick: converter codes in, PWM codes out.

use control_core::{Controller, LANES, Limits, Micrometre, PwmCode, Setpoint, Volt};
use experiment::{Mean, Pacer, Player, Quantity, Shape, Stream, Waveform};
use mirror_protocol::{Commanded, Telemetry};

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
    player: Option<Player>,
    applied: [PwmCode; LANES],
    /// Whether the codes of `applied` came with another setpoint than those before.
    stepped: bool,
    limits_since_command: Limits,
    tick: u32,
    stream: Pacer,
    mean: Mean<MEASURED>,
}

/// Quantities that a stream takes the mean of: four currents, and the sensor.
const MEASURED: usize = LANES + 1;

impl Control {
    /// A loop that starts with all channels off.
    pub fn new(controller: Controller<'static>, mailbox: &'static Mailbox) -> Self {
        Self {
            controller,
            mailbox,
            setpoint: Setpoint::Off,
            player: None,
            applied: [PwmCode(0); LANES],
            stepped: false,
            limits_since_command: Limits::NONE,
            tick: 0,
            stream: Pacer::default(),
            mean: Mean::default(),
        }
    }

    /// One tick: `sensed` are the codes read while the codes of the last tick were driven; the
    /// result is driven next.
    pub fn tick(&mut self, sensed: Sensed) -> [PwmCode; LANES] {
        if let Some(calibration) = self.mailbox.take_calibration() {
            // Drives computed under another calibration mean nothing.
            self.setpoint = Setpoint::Off;
            self.player = None;
            let before = self.controller.exchange(calibration);
            self.mailbox.return_calibration(before);
        }
        let command = self.mailbox.take_command();
        let last = self.setpoint;
        self.follow(command);

        let applied = self.applied.map(PwmCode::drive);
        let currents = sensed.currents.map(|code| code.current());
        let step = self.controller.step(self.setpoint, applied, currents);
        let codes = step.codes;
        if command.is_some() {
            self.limits_since_command = Limits::NONE;
        }
        self.limits_since_command = self.limits_since_command.union(step.limits);

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
        self.stepped = self.setpoint != last;
        self.tick = self.tick.wrapping_add(1);
        codes
    }

    fn report(&mut self, commanded: bool, codes: [PwmCode; LANES], telemetry: Telemetry) {
        self.mailbox.publish(telemetry, self.limits_since_command);
        if commanded {
            self.mailbox.confirm(Commanded {
                tick: telemetry.tick,
                drive_v: codes.map(|code| code.drive().0),
                limits: telemetry.limits,
            });
        }
        if let Some(stream) = self.mailbox.take_stream() {
            self.begin_stream(stream);
        }
        let due = self.stream.tick(self.stepped);
        if due.counts {
            let [a, b, c, d] = telemetry.current_a;
            self.mean
                .add([a, b, c, d, telemetry.sensor_z_um.unwrap_or(0.0)]);
        }
        if due.sample {
            let [a, b, c, d, z_um] = self.mean.take();
            self.mailbox.send_sample(Telemetry {
                current_a: [a, b, c, d],
                sensor_z_um: telemetry.sensor_z_um.map(|_| z_um),
                ..telemetry
            });
        }
    }

    fn begin_stream(&mut self, stream: Stream) {
        self.stream = Pacer::new(stream);
        self.mean = Mean::default();
        self.mailbox.begin_stream(self.tick);
    }

    /// The setpoint of this tick: a new command's, else the waveform's, else the last one.
    fn follow(&mut self, command: Option<Setpoint>) {
        if let Some((player, stream)) = self.mailbox.take_play() {
            self.player = Some(player);
            self.begin_stream(stream);
        }
        if let Some(setpoint) = command {
            self.player = None;
            self.setpoint = setpoint;
        }
        match &mut self.player {
            Some(player) if player.is_over() && player.waveform().ends_off => {
                self.player = None;
                self.setpoint = Setpoint::Off;
            }
            Some(player) => {
                let value = player.next(|index| self.mailbox.point(index));
                self.setpoint = setpoint(player.waveform(), value);
            }
            None => {}
        }
    }
}

fn setpoint(waveform: &Waveform, value: f32) -> Setpoint {
    match (waveform.quantity, waveform.shape) {
        // Steps need a path, anything else is one.
        (Quantity::Position, Shape::Steps(_)) => Setpoint::Position(Micrometre(value)),
        (Quantity::Position, _) => Setpoint::Track(Micrometre(value)),
        (Quantity::Drive { active, others_v }, _) => {
            Setpoint::Drive(active.map(|is_active| Volt(if is_active { value } else { others_v })))
        }
    }
}

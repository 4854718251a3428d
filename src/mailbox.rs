//! What the control loop and the link leave for each other.
//!
//! The two run independently, on some boards at different priorities. A command waits here for the
//! next tick, and the tick leaves here what it did.

use core::cell::Cell;

use control_core::{Calibration, Limits, Setpoint};
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;
use embassy_sync::signal::Signal;
use embassy_time::{Duration, with_timeout};
use experiment::{POINTS, Player};
use mirror_protocol::{Commanded, Stream, Telemetry};

/// A tick lasts 100 us; a loop that has not answered after this long has stopped.
const TICK_TIMEOUT: Duration = Duration::from_millis(50);

/// Samples that wait for the link.
const QUEUED_SAMPLES: usize = 16;

type Shared<T> = Mutex<CriticalSectionRawMutex, Cell<T>>;

/// The meeting place.
pub struct Mailbox {
    command: Shared<Option<Setpoint>>,
    play: Shared<Option<(Player, Stream)>>,
    points: Mutex<CriticalSectionRawMutex, [Cell<i16>; POINTS]>,
    stream: Shared<Option<Stream>>,
    calibration: Shared<Option<&'static mut Calibration>>,
    calibration_before: Signal<CriticalSectionRawMutex, &'static mut Calibration>,
    commanded: Signal<CriticalSectionRawMutex, Commanded>,
    streaming: Signal<CriticalSectionRawMutex, u32>,
    latest: Shared<Telemetry>,
    limits_since_command: Shared<Limits>,
    samples: Channel<CriticalSectionRawMutex, Telemetry, QUEUED_SAMPLES>,
    dropped: Shared<u32>,
}

/// The control loop did not run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ControlStopped;

/// The one mailbox of the image.
pub static MAILBOX: Mailbox = Mailbox::new();

impl Default for Mailbox {
    fn default() -> Self {
        Self::new()
    }
}

impl Mailbox {
    /// A mailbox that nobody has used. A board has one, [`MAILBOX`].
    pub const fn new() -> Self {
        Self {
            command: Mutex::new(Cell::new(None)),
            play: Mutex::new(Cell::new(None)),
            points: Mutex::new([const { Cell::new(0) }; POINTS]),
            stream: Mutex::new(Cell::new(None)),
            calibration: Mutex::new(Cell::new(None)),
            calibration_before: Signal::new(),
            commanded: Signal::new(),
            streaming: Signal::new(),
            latest: Mutex::new(Cell::new(Telemetry {
                tick: 0,
                drive_v: [0.0; 4],
                current_a: [0.0; 4],
                temperature_k: [None; 4],
                limits: 0,
                sensor_z_um: None,
            })),
            limits_since_command: Mutex::new(Cell::new(Limits::NONE)),
            samples: Channel::new(),
            dropped: Mutex::new(Cell::new(0)),
        }
    }

    /// Link side: has the next tick carry out `setpoint`.
    pub fn post(&self, setpoint: Setpoint) {
        self.command.lock(|command| command.set(Some(setpoint)));
    }

    /// Link side: has the next tick carry out `setpoint`, and waits until it has.
    ///
    /// # Errors
    /// Where no tick came.
    pub async fn command(&self, setpoint: Setpoint) -> Result<Commanded, ControlStopped> {
        self.commanded.reset();
        self.post(setpoint);
        let confirmed = with_timeout(TICK_TIMEOUT, self.commanded.wait()).await;
        confirmed.map_err(|_| {
            // What was refused must not be carried out later.
            self.take_command();
            ControlStopped
        })
    }

    /// Link side: asks for a stream of samples in place of any earlier one, and waits for its first
    /// tick.
    ///
    /// # Errors
    /// Where no tick came.
    pub async fn stream(&self, stream: Stream) -> Result<u32, ControlStopped> {
        self.streaming.reset();
        self.request_stream(stream);
        self.first_tick().await
    }

    /// Link side: has the next tick begin a waveform, and with it a stream of samples in place of
    /// any earlier one; waits for that tick.
    ///
    /// # Errors
    /// Where no tick came.
    pub async fn play(&self, player: Player, stream: Stream) -> Result<u32, ControlStopped> {
        self.streaming.reset();
        self.play.lock(|slot| slot.set(Some((player, stream))));
        self.first_tick().await
    }

    async fn first_tick(&self) -> Result<u32, ControlStopped> {
        let first_tick = with_timeout(TICK_TIMEOUT, self.streaming.wait()).await;
        first_tick.map_err(|_| {
            // What was refused must not begin later.
            self.take_stream();
            self.take_play();
            ControlStopped
        })
    }

    /// Link side: has the next tick exchange the calibration, which turns all channels off, and waits for
    /// the one before.
    ///
    /// # Errors
    /// Where no tick came: the calibration that was not taken.
    pub async fn exchange(
        &self,
        calibration: &'static mut Calibration,
    ) -> Result<&'static mut Calibration, Option<&'static mut Calibration>> {
        self.calibration_before.reset();
        self.calibration.lock(|slot| slot.set(Some(calibration)));
        let before = with_timeout(TICK_TIMEOUT, self.calibration_before.wait()).await;
        before.map_err(|_| self.take_calibration())
    }

    /// Link side: changes points of the table, from `first` on. `false` where they do not fit.
    pub fn load_points(&self, first: usize, points: &[i16]) -> bool {
        self.points.lock(|table| {
            let Some(room) = table.get(first..).and_then(|rest| rest.get(..points.len())) else {
                return false;
            };
            for (slot, point) in room.iter().zip(points) {
                slot.set(*point);
            }
            true
        })
    }

    /// Link side: has the next tick begin a stream.
    pub fn request_stream(&self, stream: Stream) {
        self.stream.lock(|slot| slot.set(Some(stream)));
    }

    /// Link side: the most recent tick.
    pub fn latest(&self) -> Telemetry {
        self.latest.lock(Cell::get)
    }

    /// Link side: the limits that have acted since the last command.
    pub fn limits_since_command(&self) -> Limits {
        self.limits_since_command.lock(Cell::get)
    }

    /// Link side: the next sample of the stream.
    pub async fn next_sample(&self) -> Telemetry {
        self.samples.receive().await
    }

    /// Link side: samples that were lost since start because the link was too slow.
    pub fn dropped_samples(&self) -> u32 {
        self.dropped.lock(Cell::get)
    }

    /// Whether the queue towards the link is full. An emulated board waits then, as its time can.
    pub fn is_congested(&self) -> bool {
        self.samples.is_full()
    }

    /// Control side: a command that came since the last tick.
    pub(crate) fn take_command(&self) -> Option<Setpoint> {
        self.command.lock(Cell::take)
    }

    /// Control side: a calibration that came since the last tick.
    pub(crate) fn take_calibration(&self) -> Option<&'static mut Calibration> {
        self.calibration.lock(Cell::take)
    }

    /// Control side: the calibration that is no longer in use.
    pub(crate) fn return_calibration(&self, before: &'static mut Calibration) {
        self.calibration_before.signal(before);
    }

    /// Control side: a waveform that was asked for since the last tick, with its stream.
    pub(crate) fn take_play(&self) -> Option<(Player, Stream)> {
        self.play.lock(Cell::take)
    }

    /// Control side: a point of the table; 0 beyond its end.
    pub(crate) fn point(&self, index: usize) -> i16 {
        self.points
            .lock(|table| table.get(index).map_or(0, Cell::get))
    }

    /// Control side: a stream that was asked for since the last tick.
    pub(crate) fn take_stream(&self) -> Option<Stream> {
        self.stream.lock(Cell::take)
    }

    /// Control side: a command is carried out.
    pub(crate) fn confirm(&self, commanded: Commanded) {
        self.commanded.signal(commanded);
    }

    /// Control side: a stream begins with this tick; samples of an earlier one are forgotten.
    pub(crate) fn begin_stream(&self, first_tick: u32) {
        self.samples.clear();
        self.streaming.signal(first_tick);
    }

    /// Control side: a tick is over.
    pub(crate) fn publish(&self, telemetry: Telemetry, limits_since_command: Limits) {
        self.latest.lock(|latest| latest.set(telemetry));
        self.limits_since_command
            .lock(|limits| limits.set(limits_since_command));
    }

    /// Control side: a sample for the link, dropped and counted where the link is too slow.
    pub(crate) fn send_sample(&self, telemetry: Telemetry) {
        if self.samples.try_send(telemetry).is_err() {
            self.dropped
                .lock(|dropped| dropped.set(dropped.get().wrapping_add(1)));
        }
    }
}

//! What the control loop and the link leave for each other.
//!
//! The two run independently, on some boards at different priorities. An order waits here for the
//! next tick, and the tick leaves here what it did.

use core::cell::Cell;

use control_core::{CHANNELS, Calibration, SenseCalibration, Setpoint};
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_time::{Duration, with_timeout};
use mirror_protocol::{ChannelState, Commanded, Health, Stream, Telemetry};
use protection::{Denied, Lease};
use waveforms::{POINTS, Player};

use crate::exchange::{Queue, Slot};

/// A tick lasts 100 us; a loop that has not answered after this long has stopped.
const TICK_TIMEOUT: Duration = Duration::from_millis(50);

/// Samples that wait for the link.
const QUEUED_SAMPLES: usize = 16;

/// A value that is there at all times.
type Shared<T> = Mutex<CriticalSectionRawMutex, Cell<T>>;

/// What the link wants of the next tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Order {
    /// Drive like this, under this lease.
    Drive(Setpoint, Lease),
    /// Turn all channels off.
    Off,
    /// Go on for at least so long.
    Renew(Lease),
    /// Forget the faults.
    Clear,
}

/// Why an order was not carried out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Failure {
    /// The control loop did not run.
    ControlStopped,
    /// The protection did not let it.
    Denied(Denied),
}

/// A waveform to play: with its stream of samples, under a lease.
pub(crate) type Play = (Player, Stream, Lease);

/// The meeting place.
pub struct Mailbox {
    order: Slot<Order>,
    play: Slot<Play>,
    points: Mutex<CriticalSectionRawMutex, [Cell<i16>; POINTS]>,
    stream: Slot<Stream>,
    sense: Slot<SenseCalibration>,
    calibration: Slot<&'static mut Calibration>,
    calibration_before: Signal<CriticalSectionRawMutex, &'static mut Calibration>,
    commanded: Signal<CriticalSectionRawMutex, Result<Commanded, Denied>>,
    streaming: Signal<CriticalSectionRawMutex, Result<u32, Denied>>,
    latest: Shared<Telemetry>,
    health: Shared<Health>,
    about_to_lapse: Shared<bool>,
    samples: Queue<Telemetry, QUEUED_SAMPLES>,
    bootloader: Signal<CriticalSectionRawMutex, ()>,
    dropped: Shared<u32>,
}

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
            order: Slot::new(),
            play: Slot::new(),
            points: Mutex::new([const { Cell::new(0) }; POINTS]),
            stream: Slot::new(),
            sense: Slot::new(),
            calibration: Slot::new(),
            calibration_before: Signal::new(),
            commanded: Signal::new(),
            streaming: Signal::new(),
            latest: Mutex::new(Cell::new(Telemetry {
                tick: 0,
                drive_v: [0.0; 4],
                current_a: [0.0; 4],
                temperature_k: [None; 4],
                limits: 0,
                states: [ChannelState::Off; CHANNELS],
                sensor_z_um: None,
            })),
            health: Mutex::new(Cell::new(Health {
                lease_left_ms: None,
                supply_v: 0.0,
                missed_ticks: 0,
                limits_since_command: 0,
            })),
            about_to_lapse: Mutex::new(Cell::new(false)),
            samples: Queue::new(),
            bootloader: Signal::new(),
            dropped: Mutex::new(Cell::new(0)),
        }
    }

    /// Link side: has the next tick carry out `order`.
    pub fn post(&self, order: Order) {
        self.order.put(order);
    }

    /// Link side: has the next tick carry out `order`, and waits until it has: for as long as the
    /// heaters are checked, where they must be.
    ///
    /// # Errors
    /// Where no tick came, or the protection denied it.
    pub async fn order(&self, order: Order) -> Result<Commanded, Failure> {
        self.commanded.reset();
        self.post(order);
        match with_timeout(TICK_TIMEOUT, self.commanded.wait()).await {
            Ok(confirmed) => confirmed.map_err(Failure::Denied),
            Err(_) => {
                // What was refused must not be carried out later.
                self.take_order();
                Err(Failure::ControlStopped)
            }
        }
    }

    /// Link side: asks for a stream of samples in place of any earlier one, and waits for its first
    /// tick.
    ///
    /// # Errors
    /// Where no tick came.
    pub async fn stream(&self, stream: Stream) -> Result<u32, Failure> {
        self.streaming.reset();
        self.request_stream(stream);
        self.first_tick().await
    }

    /// Link side: has the next tick begin a waveform, and with it a stream of samples in place of
    /// any earlier one; waits for the tick in which they begin, which comes after the check of the
    /// heaters, where they must be checked.
    ///
    /// # Errors
    /// Where no tick came, or the protection denied it.
    pub async fn play(&self, player: Player, stream: Stream, lease: Lease) -> Result<u32, Failure> {
        self.streaming.reset();
        self.play.put((player, stream, lease));
        self.first_tick().await
    }

    async fn first_tick(&self) -> Result<u32, Failure> {
        match with_timeout(TICK_TIMEOUT, self.streaming.wait()).await {
            Ok(first_tick) => first_tick.map_err(Failure::Denied),
            Err(_) => {
                // What was refused must not begin later.
                self.take_stream();
                self.take_play();
                Err(Failure::ControlStopped)
            }
        }
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
        self.calibration.put(calibration);
        let before = with_timeout(TICK_TIMEOUT, self.calibration_before.wait()).await;
        before.map_err(|_| self.take_calibration())
    }

    /// Link side: has currents read like this from the next tick on.
    pub fn calibrate_sense(&self, sense: SenseCalibration) {
        self.sense.put(sense);
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
        self.stream.put(stream);
    }

    /// Link side: the most recent tick.
    pub fn latest(&self) -> Telemetry {
        self.latest.lock(Cell::get)
    }

    /// Link side: how the board was at the most recent tick.
    pub fn health(&self) -> Health {
        self.health.lock(Cell::get)
    }

    /// Link side: the board is to leave for its bootloader.
    pub fn request_bootloader(&self) {
        self.bootloader.signal(());
    }

    /// Link side: waits for [`Self::request_bootloader`].
    pub async fn bootloader_requested(&self) {
        self.bootloader.wait().await;
    }

    /// Link side: the next sample of the stream.
    pub async fn next_sample(&self) -> Telemetry {
        self.samples.next().await
    }

    /// Link side: samples that were lost since start because the link was too slow.
    pub fn dropped_samples(&self) -> u32 {
        self.dropped.lock(Cell::get)
    }

    /// Whether the queue towards the link is full. An emulated board waits then, as its time can.
    pub fn is_congested(&self) -> bool {
        self.samples.is_full()
    }

    /// Whether the next tick ends a short lease, and no order waits that could renew it. An emulated
    /// board gives the host some time then.
    pub fn is_about_to_lapse(&self) -> bool {
        self.about_to_lapse.lock(Cell::get) && self.order.is_empty()
    }

    /// Control side: an order that came since the last tick.
    pub(crate) fn take_order(&self) -> Option<Order> {
        self.order.take()
    }

    /// Control side: a calibration that came since the last tick.
    pub(crate) fn take_calibration(&self) -> Option<&'static mut Calibration> {
        self.calibration.take()
    }

    /// Control side: what the current sense was found to be off by since the last tick.
    pub(crate) fn take_sense(&self) -> Option<SenseCalibration> {
        self.sense.take()
    }

    /// Control side: the calibration that is no longer in use.
    pub(crate) fn return_calibration(&self, before: &'static mut Calibration) {
        self.calibration_before.signal(before);
    }

    /// Control side: a waveform that was asked for since the last tick, with its stream and lease.
    pub(crate) fn take_play(&self) -> Option<Play> {
        self.play.take()
    }

    /// Control side: a point of the table; 0 beyond its end.
    pub(crate) fn point(&self, index: usize) -> i16 {
        self.points
            .lock(|table| table.get(index).map_or(0, Cell::get))
    }

    /// Control side: a stream that was asked for since the last tick.
    pub(crate) fn take_stream(&self) -> Option<Stream> {
        self.stream.take()
    }

    /// Control side: an order is carried out, or denied.
    pub(crate) fn confirm(&self, confirmed: Result<Commanded, Denied>) {
        self.commanded.signal(confirmed);
    }

    /// Control side: a waveform does not begin.
    pub(crate) fn deny_play(&self, denied: Denied) {
        self.streaming.signal(Err(denied));
    }

    /// Control side: a stream begins with this tick; samples of an earlier one are forgotten.
    pub(crate) fn begin_stream(&self, first_tick: u32) {
        self.samples.clear();
        self.streaming.signal(Ok(first_tick));
    }

    /// Control side: a tick is over.
    pub(crate) fn publish(&self, telemetry: Telemetry, health: Health, about_to_lapse: bool) {
        self.latest.lock(|latest| latest.set(telemetry));
        self.health.lock(|slot| slot.set(health));
        self.about_to_lapse.lock(|slot| slot.set(about_to_lapse));
    }

    /// Control side: a sample for the link, dropped and counted where the link is too slow.
    pub(crate) fn send_sample(&self, telemetry: Telemetry) {
        if !self.samples.push(telemetry) {
            self.dropped
                .lock(|dropped| dropped.set(dropped.get().wrapping_add(1)));
        }
    }
}

//! The link's side: orders to the next tick, and what came of them.

use core::cell::Cell;
use core::pin::pin;

use control_core::{Calibration, SenseCalibration};
use embassy_time::{Duration, with_timeout};
use mirror_protocol::{ChannelState, Commanded, Health, Stream, Telemetry, TelemetryBatch};
use protection::{Denied, Lease};
use waveforms::Player;

use super::slots::{Mailbox, Order, Trip};

/// A tick lasts 0.1 ms, and a check of the heaters 2.5 ms; a loop that has not answered after twenty times that has stopped.
const TICK_TIMEOUT: Duration = Duration::from_millis(50);
/// An order waits so many times longer while heaters are checked and cool: 1 s, four times what a start takes in air.
const COOLING_TIMEOUTS: u32 = 20;

/// The mailbox as the link sees it.
#[derive(Clone, Copy)]
pub struct LinkSide(pub(super) &'static Mailbox);

/// Why an order was not carried out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Failure {
    /// The control loop did not run.
    ControlStopped,
    /// The heaters are still warm from before a reset or a trip.
    Cooling,
    /// Somebody stopped the board meanwhile.
    Stopped,
    /// The protection did not let it.
    Denied(Denied),
}

impl LinkSide {
    /// Has the next tick turn all channels off, before anything that waits for it and in its place. Whoever drove has
    /// to greet the board again before it drives.
    pub fn stop(self) {
        self.0.order.take();
        self.0.play.take();
        self.0
            .stops
            .lock(|stops| stops.set(stops.get().wrapping_add(1)));
        self.0.stop.put(());
    }

    /// Whether a stop waits for the next tick.
    pub fn is_stopping(self) -> bool {
        !self.0.stop.is_empty()
    }

    /// Stops since start.
    pub fn stops(self) -> u32 {
        self.0.stops.lock(Cell::get)
    }

    /// Has the next tick carry out `order`.
    pub fn post(self, order: Order) {
        self.0.order.put(order);
    }

    /// Has the next tick carry out `order`, and waits until it has: for as long as the heaters are
    /// checked, where they must be.
    ///
    /// # Errors
    /// Where no tick came, the protection denied it, or the board was stopped meanwhile.
    pub async fn order(self, order: Order) -> Result<Commanded, Failure> {
        self.0.commanded.reset();
        self.post(order);
        match self.answered(self.0.commanded.wait()).await {
            Ok(confirmed) => confirmed.map_err(Failure::Denied),
            Err(failure) => {
                // What was refused must not be carried out later.
                self.post(Order::Off);
                Err(failure)
            }
        }
    }

    /// Asks for a stream of samples in place of any earlier one, and waits for its first tick.
    ///
    /// # Errors
    /// Where no tick came.
    pub async fn stream(self, stream: Stream) -> Result<u32, Failure> {
        self.0.streaming.reset();
        self.request_stream(stream);
        self.first_tick().await
    }

    /// Has the next tick begin a waveform, and with it a stream of samples in place of any earlier
    /// one; waits for the tick in which they begin, which comes after the check of the heaters, where
    /// they must be checked.
    ///
    /// # Errors
    /// Where no tick came, the protection denied it, or the board was stopped meanwhile.
    pub async fn play(self, player: Player, stream: Stream, lease: Lease) -> Result<u32, Failure> {
        self.0.streaming.reset();
        self.0.play.put((player, stream, lease));
        self.first_tick().await
    }

    async fn first_tick(self) -> Result<u32, Failure> {
        match self.answered(self.0.streaming.wait()).await {
            Ok(first_tick) => first_tick.map_err(Failure::Denied),
            Err(failure) => {
                // What was refused must not begin later.
                self.0.stream.take();
                self.0.play.take();
                self.post(Order::Off);
                Err(failure)
            }
        }
    }

    /// Waits for a tick's answer, for longer where heaters are checked first.
    async fn answered<T>(self, answer: impl Future<Output = T>) -> Result<T, Failure> {
        let mut answer = pin!(answer);
        let stops = self.stops();
        for _ in 0..COOLING_TIMEOUTS {
            let answered = with_timeout(TICK_TIMEOUT, answer.as_mut()).await;
            if self.stops() != stops {
                return Err(Failure::Stopped);
            }
            if let Ok(answer) = answered {
                return Ok(answer);
            }
            if !self.latest().states.contains(&ChannelState::Starting) {
                return Err(Failure::ControlStopped);
            }
        }
        Err(Failure::Cooling)
    }

    /// Has the next tick exchange the calibration, which turns all channels off, and waits for the one
    /// before.
    ///
    /// # Errors
    /// Where no tick came: the calibration that was not taken.
    pub async fn exchange(
        self,
        calibration: &'static mut Calibration,
    ) -> Result<&'static mut Calibration, Option<&'static mut Calibration>> {
        self.0.calibration_before.reset();
        self.0.calibration.put(calibration);
        let before = with_timeout(TICK_TIMEOUT, self.0.calibration_before.wait()).await;
        before.map_err(|_| self.0.calibration.take())
    }

    /// Has currents read like this from the next tick on.
    pub fn calibrate_sense(self, sense: SenseCalibration) {
        self.0.sense.put(sense);
    }

    /// Changes points of the table, from `first` on. `false` where they do not fit.
    pub fn load_points(self, first: usize, points: &[i16]) -> bool {
        self.0.points.lock(|table| {
            let Some(room) = table.get(first..).and_then(|rest| rest.get(..points.len())) else {
                return false;
            };
            for (slot, point) in room.iter().zip(points) {
                slot.set(*point);
            }
            true
        })
    }

    /// Has the next tick begin a stream.
    pub fn request_stream(self, stream: Stream) {
        self.0.stream.put(stream);
    }

    /// The most recent tick.
    pub fn latest(self) -> Telemetry {
        self.0.latest.lock(Cell::get)
    }

    /// How the board was at the most recent tick.
    pub fn health(self) -> Health {
        self.0.health.lock(Cell::get)
    }

    /// The samples of the stream that wait, as many as travel together; the next one where none does.
    pub async fn next_samples(self) -> TelemetryBatch {
        let mut batch = TelemetryBatch::new();
        let mut next = Some(self.0.samples.next().await);
        while let Some(sample) = next {
            // There is room: a full batch takes no further one.
            let _ = batch.push(sample);
            next = (!batch.is_full()).then(|| self.0.samples.take()).flatten();
        }
        batch
    }

    /// The next trip.
    pub(crate) async fn next_trip(self) -> Trip {
        self.0.trips.next().await
    }

    /// Samples that were lost since start because the link was too slow.
    pub fn dropped_samples(self) -> u32 {
        self.0.dropped.lock(Cell::get)
    }

    /// The board is to leave for its bootloader.
    pub fn request_bootloader(self) {
        self.0.bootloader.signal(());
    }

    /// Waits for [`Self::request_bootloader`].
    pub async fn bootloader_requested(self) {
        self.0.bootloader.wait().await;
    }
}

//! The control loop's side: what came since the last tick, and what this one did.

use core::cell::Cell;

use control_core::{Calibration, SenseCalibration};
use mirror_protocol::{Commanded, Health, Stream, Telemetry};
use protection::Denied;

use super::slots::{Mailbox, Order, Play, Trip};

/// The mailbox as the control loop sees it. There is one of it.
pub struct ControlSide(pub(super) &'static Mailbox);

impl ControlSide {
    /// Whether a stop came since the last tick.
    pub(crate) fn take_stop(&self) -> bool {
        self.0.stop.take().is_some()
    }

    /// Whether a stop waits for the next tick.
    pub(crate) fn has_stop(&self) -> bool {
        !self.0.stop.is_empty()
    }

    /// An order that came since the last tick.
    pub(crate) fn take_order(&self) -> Option<Order> {
        self.0.order.take()
    }

    /// Whether a stop, or what the link has to answer before it takes another request, waits for the next tick.
    pub(crate) fn has_any(&self) -> bool {
        self.has_stop()
            || !self.0.order.is_empty()
            || !self.0.play.is_empty()
            || !self.0.stream.is_empty()
            || !self.0.calibration.is_empty()
    }

    /// A calibration that came since the last tick.
    pub(crate) fn take_calibration(&self) -> Option<&'static mut Calibration> {
        self.0.calibration.take()
    }

    /// The calibration that is no longer in use.
    pub(crate) fn return_calibration(&self, before: &'static mut Calibration) {
        self.0.calibration_before.signal(before);
    }

    /// What the current sense was found to be off by since the last tick.
    pub(crate) fn take_sense(&self) -> Option<SenseCalibration> {
        self.0.sense.take()
    }

    /// A waveform that was asked for since the last tick, with its stream and lease.
    pub(crate) fn take_play(&self) -> Option<Play> {
        self.0.play.take()
    }

    /// A waveform does not begin.
    pub(crate) fn deny_play(&self, denied: Denied) {
        self.0.streaming.signal(Err(denied));
    }

    /// A point of the table; 0 beyond its end.
    pub(crate) fn point(&self, index: usize) -> i16 {
        let table = &self.0.points;
        table.lock(|table| table.get(index).map_or(0, Cell::get))
    }

    /// A stream that was asked for since the last tick.
    pub(crate) fn take_stream(&self) -> Option<Stream> {
        self.0.stream.take()
    }

    /// A stream begins with this tick; samples of an earlier one are forgotten.
    pub(crate) fn begin_stream(&self, first_tick: u32) {
        self.0.samples.clear();
        self.0.streaming.signal(Ok(first_tick));
    }

    /// An order is carried out, or denied.
    pub(crate) fn confirm(&self, confirmed: Result<Commanded, Denied>) {
        self.0.commanded.signal(confirmed);
    }

    /// A tick is over.
    pub(crate) fn publish(&self, telemetry: Telemetry, health: Health) {
        self.0.latest.lock(|latest| latest.set(telemetry));
        self.0.health.lock(|slot| slot.set(health));
    }

    /// The tick that was published last has tripped.
    pub(crate) fn tell_trip(&self) {
        let trip = Trip {
            telemetry: self.0.latest.lock(Cell::get),
            health: self.0.health.lock(Cell::get),
        };
        self.0.trips.push(trip);
    }

    /// A sample for the link, dropped and counted where the link is too slow.
    pub(crate) fn send_sample(&self, telemetry: Telemetry) {
        if !self.0.samples.push(telemetry) {
            let dropped = &self.0.dropped;
            dropped.lock(|dropped| dropped.set(dropped.get().wrapping_add(1)));
        }
    }

    /// Whether the next sample would be dropped.
    pub(crate) fn is_congested(&self) -> bool {
        self.0.samples.is_full()
    }
}

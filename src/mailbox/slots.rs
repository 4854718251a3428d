//! What waits in the mailbox, in either direction.

use core::cell::Cell;

use control_core::{CHANNELS, Calibration, SenseCalibration, Setpoint};
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use mirror_protocol::{ChannelState, Commanded, Health, Pose, Stream, Telemetry};
use protection::{Denied, Lease};
use waveforms::{POINTS, Player, Trigger};

use crate::exchange::{Queue, Slot};

/// Samples that wait for the link: at most 1.6 ms of a stream with one a tick.
pub const QUEUED_SAMPLES: usize = 16;

/// A value that is there at all times.
pub(super) type Shared<T> = Mutex<CriticalSectionRawMutex, Cell<T>>;

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
    /// Compensate the surroundings in positions, or leave the mirror to them.
    Compensate(bool),
}

/// The tick in which the board tripped.
#[derive(Clone, Copy, Debug)]
pub struct Trip {
    /// What it drove and sensed.
    pub telemetry: Telemetry,
    /// How the board was.
    pub health: Health,
}

/// Trips that wait to be logged. Between two of them a host has to clear the first.
const QUEUED_TRIPS: usize = 2;

/// A waveform to play: with its stream of samples, under a lease.
pub(crate) type Play = (Player, Stream, Lease);

/// The meeting place.
pub struct Mailbox {
    // To the control loop.
    pub(super) stop: Slot<()>,
    pub(super) order: Slot<Order>,
    pub(super) play: Slot<Play>,
    pub(super) points: Mutex<CriticalSectionRawMutex, [Cell<i16>; POINTS]>,
    pub(super) stream: Slot<Stream>,
    pub(super) sense: Slot<SenseCalibration>,
    pub(super) calibration: Slot<&'static mut Calibration>,
    // To the link.
    pub(super) calibration_before: Signal<CriticalSectionRawMutex, &'static mut Calibration>,
    pub(super) commanded: Signal<CriticalSectionRawMutex, Result<Commanded, Denied>>,
    pub(super) streaming: Signal<CriticalSectionRawMutex, Result<u32, Denied>>,
    pub(super) latest: Shared<Telemetry>,
    pub(super) health: Shared<Health>,
    pub(super) samples: Queue<Telemetry, QUEUED_SAMPLES>,
    pub(super) trips: Queue<Trip, QUEUED_TRIPS>,
    pub(super) dropped: Shared<u32>,
    // Within the link.
    pub(super) stops: Shared<u32>,
    pub(super) bootloader: Signal<CriticalSectionRawMutex, ()>,
}

impl Default for Mailbox {
    fn default() -> Self {
        Self::new()
    }
}

impl Mailbox {
    /// A mailbox that nobody has used. An image has one, which [`take`] gives.
    pub const fn new() -> Self {
        Self {
            stop: Slot::new(),
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
                drive_v: [0.0; CHANNELS],
                current_a: [0.0; CHANNELS],
                temperature_k: [None; CHANNELS],
                limits: 0,
                states: [ChannelState::Off; CHANNELS],
                sensor_z_um: None,
                pose: Pose {
                    z_um: 0.0,
                    tilt_rad: None,
                },
                room: None,
                uncertainty: None,
                settles_in_ms: None,
                trigger: Trigger::NONE,
            })),
            health: Mutex::new(Cell::new(Health {
                lease_left_ms: None,
                supply_v: 0.0,
                missed_ticks: 0,
                late_ticks: 0,
                limits_since_command: 0,
                compensates_room: false,
                lowest_position_um: 0.0,
                loss: None,
            })),
            samples: Queue::new(),
            trips: Queue::new(),
            dropped: Mutex::new(Cell::new(0)),
            stops: Mutex::new(Cell::new(0)),
            bootloader: Signal::new(),
        }
    }
}

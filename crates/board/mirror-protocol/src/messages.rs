//! Commands, answers and telemetry of the present protocol version.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};
use waveforms::{Flaw, Stream, Trigger, Waveform};

/// Ask for a piston position.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Position {
    /// From rest, positive towards the substrate.
    pub z_um: f32,
    /// How long to hold it without renewal; [`LEASE_FOREVER_MS`]: until told otherwise.
    pub lease_ms: u32,
}

/// Ask for a pose of the plate.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct SetPose {
    /// Piston, from rest and positive towards the substrate.
    pub z_um: f32,
    /// Rotation about the x axis, right-handed: z rises along y.
    pub tilt_x_rad: f32,
    /// Rotation about the y axis, right-handed: z falls along x.
    pub tilt_y_rad: f32,
    /// How long to hold it without renewal; [`LEASE_FOREVER_MS`]: until told otherwise.
    pub lease_ms: u32,
}

/// Ask for a voltage on each actuator.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Drives {
    /// Channel by channel.
    pub drive_v: [f32; 4],
    /// How long to hold them without renewal; [`LEASE_FOREVER_MS`]: until told otherwise.
    pub lease_ms: u32,
}

/// A lease that does not end.
pub const LEASE_FOREVER_MS: u32 = u32::MAX;

/// Extend the lease of what is driven, so that this much is left of it; a longer one stays.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Renewal {
    /// From now on; [`LEASE_FOREVER_MS`]: until told otherwise.
    pub lease_ms: u32,
}

/// What a channel is doing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum ChannelState {
    /// Zero drive: another channel has turned the board off.
    #[default]
    Off,
    /// The heater is being checked, at start and once faults are cleared.
    Starting,
    /// The heater is sound; zero drive.
    Ready,
    /// Driven as asked.
    Driving,
    /// Driven, but not as asked; the limits say why.
    Limited,
    /// Turned off because of a fault, by its code (`protection::Fault`).
    Tripped(u8),
}

/// Ask for a waveform, and for a stream of samples whose first is the tick that computes the
/// waveform's first value; that value is driven from the tick after it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Play {
    /// What to play.
    pub waveform: Waveform,
    /// What to sample.
    pub stream: Stream,
    /// How long to play, and to stay at its last value, without renewal; [`LEASE_FOREVER_MS`]: until
    /// told otherwise.
    pub lease_ms: u32,
}

/// Points of a chunk of the board's table.
pub const CHUNK_POINTS: usize = 64;

/// Some of the board's points, for waveforms that are tables. They take the place of the old ones at
/// once.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Points {
    /// Index of the first of them.
    pub first: u16,
    /// The points, in shares of the amplitude ([`waveforms::FULL_SCALE`] being all of it).
    pub points: heapless::Vec<i16, CHUNK_POINTS>,
}

/// A stream as it begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Streaming {
    /// The tick of its first sample. Earlier ticks belong to an earlier stream.
    pub first_tick: u32,
}

/// A command as it was carried out by the control tick after it arrived.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Commanded {
    /// The control tick that carried it out.
    pub tick: u32,
    /// The voltages now driven.
    pub drive_v: [f32; 4],
    /// Bits of the limits that acted (`control_core::Limits`).
    pub limits: u16,
}

/// The board at this moment.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema)]
pub struct Status {
    /// What it does now.
    pub telemetry: Telemetry,
    /// How it is.
    pub health: Health,
    /// Top of the calibrated range.
    pub max_position_um: f32,
    /// Highest drive that is allowed.
    pub max_drive_v: f32,
    /// Telemetry samples that found the link too slow and were dropped since start.
    pub dropped_samples: u32,
    /// Stops since start (`mirror_protocol::usb::STOP_REQUEST`).
    pub stops: u32,
    /// What the firmware left behind when it stopped before this start; empty where it did not. The
    /// channels have tripped then, and their fault tells the kind.
    pub last_stop: Sentence,
    /// What a chip with option bytes was told to be.
    pub option_bytes: Option<OptionBytes>,
}

/// The option bytes of an STM32G4, as far as a board depends on them (RM0440, FLASH_OPTR).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct OptionBytes {
    /// BOR_LEV, 0 to 4: the supply below which the chip is held in reset.
    pub brown_out_level: u8,
    /// nSWBOOT0: the pin BOOT0 (PB8) decides at every reset whether the program or the bootloader in the ROM is started.
    pub boots_by_pin: bool,
    /// DBANK: the flash is two banks, of which one can be written while a program runs from the other.
    pub is_dual_bank: bool,
}

/// How the board is, apart from what it drives.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Schema)]
pub struct Health {
    /// What is left of the lease of what is driven, if anything is; [`LEASE_FOREVER_MS`] where it
    /// does not end.
    pub lease_left_ms: Option<u32>,
    /// The output stages' supply.
    pub supply_v: f32,
    /// Control ticks since start that did not take place.
    pub missed_ticks: u32,
    /// Control ticks since start whose drives came too late for the next, and were driven one later.
    pub late_ticks: u32,
    /// Bits of the limits that have acted since the last command (`control_core::Limits`): on the way to a
    /// position too, where [`Telemetry::limits`] has forgotten them.
    pub limits_since_command: u16,
    /// Whether positions compensate the surroundings.
    pub compensates_room: bool,
    /// Where the range begins: the surroundings alone hold the mirror there, and a heater cannot cool. 0 where they are not warmer than at
    /// calibration, or not compensated.
    pub lowest_position_um: f32,
    /// What the surroundings take of the heat beyond what they took at calibration, as a part of that; `None` where the
    /// calibration cannot tell.
    pub loss: Option<Loss>,
}

/// What the board knows of the surroundings' temperature (`control_core::surroundings`).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Room {
    /// Hundredths of a kelvin above the surroundings at calibration.
    pub rise_ck: i16,
    /// Standard deviation of that, in the same unit.
    pub deviation_ck: u16,
}

/// What the board knows of the heat that the surroundings take.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Schema)]
pub struct Loss {
    /// Change since calibration, as a part of what it was.
    pub change: f32,
    /// Standard deviation of that.
    pub deviation: f32,
}

/// Ask the board to compensate its surroundings in positions, or to leave the mirror to them. It does so after a reset.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Compensate {
    /// Whether it shall.
    pub is_wanted: bool,
}

/// Where the plate is, as the controller has it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Schema)]
pub struct Pose {
    /// Piston, from rest and positive towards the substrate.
    pub z_um: f32,
    /// Rotations about the x and y axes; `None` where the calibration does not know the plate's levers.
    pub tilt_rad: Option<[f32; 2]>,
}

/// One control tick, as seen from outside.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Schema)]
pub struct Telemetry {
    /// Control ticks since start; wraps after 119 hours at 10 kHz.
    pub tick: u32,
    /// Voltages that were driven during the tick, as quantised.
    pub drive_v: [f32; 4],
    /// Currents that were sensed during the tick.
    pub current_a: [f32; 4],
    /// Temperatures above ambient that the currents imply, where they imply any.
    pub temperature_k: [Option<f32>; 4],
    /// Bits of the limits that act (`control_core::Limits`).
    pub limits: u16,
    /// What each channel is doing.
    pub states: [ChannelState; 4],
    /// Reading of a position sensor on the board's sensor input, if there is one. The controller
    /// never sees it.
    pub sensor_z_um: Option<f32>,
    /// Where the plate is asked to be on its way, or where voltages that are asked for take it.
    pub pose: Pose,
    /// What the heaters' resistances tell of the surroundings; `None` where the calibration in use does not know them well
    /// enough.
    pub room: Option<Room>,
    /// How far the plate may be from `pose` once it is settled; `None` where the calibration in use does not say what it leaves
    /// unknown. Samples of a stream have it, and the next one, ten ticks or more after the last that did: all of
    /// them are more than USB carries.
    pub uncertainty: Option<Uncertainty>,
    /// How long until the plate is where it is asked to be, to within that; 0: it is settled. `None` where no position is asked for,
    /// and where a bound holds an actuator back for ever.
    pub settles_in_ms: Option<u16>,
    /// What of a waveform began in the tick, as its pins told. In a sample, in any tick since the one before.
    pub trigger: Trigger,
}

/// Half the width of an interval that holds a value in 95 of 100 cases (`control_core::Uncertainty`).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Uncertainty {
    /// Of the piston; the highest number stands for more as well.
    pub z_nm: u16,
    /// Of either tilt, where the levers are known.
    pub tilt_urad: u16,
}

/// Samples that travel together at most: so many of the longest fill a frame ([`crate::MAX_FRAME_BYTES`]).
///
/// One by one, those of every tick would not all come through: a sample of a driven board takes two packets of 64 bytes, twenty in
/// a millisecond, and full-speed USB carries nineteen (USB 2.0, table 5-9).
pub const BATCH_SAMPLES: usize = 3;

/// The samples of a stream that waited for the link when it had room, the earliest first.
pub type TelemetryBatch = heapless::Vec<Telemetry, BATCH_SAMPLES>;

/// Why the board does not do what it was asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Refusal {
    /// The last greeting came from another protocol version.
    ProtocolVersion {
        /// The board's version.
        board: u16,
        /// The tool's version.
        tool: u16,
    },
    /// The control loop does not run, so nothing is carried out.
    ControlStopped,
    /// No greeting came since the board started or, for a command that drives, since it was stopped.
    NoHello,
    /// A number in the command is not finite.
    NotANumber,
    /// A stream's period is zero.
    ZeroPeriod,
    /// The board has tripped and must be cleared first.
    Tripped {
        /// Code of the fault (`protection::Fault`).
        fault: u8,
    },
    /// Nothing is driven whose lease could be renewed: it has ended, or the channels are off.
    NoLease,
    /// A piece of an upload does not follow the one before it.
    UploadGap {
        /// The offset at which the next piece must begin.
        expected: u16,
    },
    /// A piece of an upload goes beyond the end.
    UploadTooLong,
    /// A waveform that cannot be played.
    Waveform(Flaw),
    /// Points beyond the end of the board's table.
    TableEnd,
    /// No sound board's current sense is off by so much.
    SenseImplausible,
    /// The board has no bootloader that takes firmware over this link.
    NoBootloader,
    /// The heaters are still warm from before a reset or a trip; nothing is driven before they have cooled.
    Cooling,
}

/// A sentence.
pub type Sentence = heapless::String<128>;

//! What a person does at the bench while a board runs: breaks something, moves the sensor's spot, the stage, the oven.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::faults::{Injected, Observed, PlantFault};

/// The bench around a board, changed from outside while it runs; its clones are the same bench.
#[derive(Clone, Debug, Default)]
pub struct Controls(Arc<Mutex<State>>);

#[derive(Debug, Default)]
struct State {
    injected: Injected,
    surroundings: Surroundings,
    /// Where the plate's centre is (um).
    plate_um: f64,
    triggers: Counted,
}

/// What a counter at the trigger pins has counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counted {
    /// Frames that began.
    pub frames: u64,
    /// Lines that began.
    pub lines: u64,
}

/// What is around the mirror.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Surroundings {
    /// Where the position sensor's spot is on the plate, from its centre (um).
    pub spot_um: [f64; 2],
    /// How far a stage has moved the mirror (um).
    pub stage_um: f64,
    /// How warm the oven is that the mirror is in, if it is in one (degC).
    pub oven_c: Option<f64>,
    /// How many times the heat that it took at first the air takes, if that has changed.
    pub air_factor: Option<f64>,
}

impl Controls {
    /// A bench with this around the mirror, where nothing is broken.
    pub fn around(surroundings: Surroundings) -> Self {
        Self(Arc::new(Mutex::new(State {
            surroundings,
            ..State::default()
        })))
    }

    /// Lets something break from the next tick on, or with `None` be sound again (a vacuum stays).
    pub fn inject(&self, fault: Option<PlantFault>) {
        self.state().injected = Injected::after(fault, 0);
    }

    /// Lets something break so many ticks later.
    pub fn inject_after(&self, fault: PlantFault, ticks: u32) {
        self.state().injected = Injected::after(Some(fault), ticks);
    }

    /// What was seen since what was injected last has begun.
    pub fn observed(&self) -> Observed {
        self.state().injected.observed()
    }

    /// Moves the position sensor's spot on the plate: x and y in micrometres from its centre.
    pub fn move_spot(&self, at_um: [f64; 2]) {
        self.state().surroundings.spot_um = at_um;
    }

    /// Moves the stage that the whole mirror is on, by so much from where it was first: what its sensor then sees
    /// further towards the substrate (um).
    pub fn move_stage(&self, um: f64) {
        self.state().surroundings.stage_um = um;
    }

    /// Brings the mirror into an oven, or another room, at this temperature (degC).
    pub fn set_oven(&self, celsius: f64) {
        self.state().surroundings.oven_c = Some(celsius);
    }

    /// Makes the air take so many times the heat that it took at first.
    pub fn set_air(&self, factor: f64) {
        self.state().surroundings.air_factor = Some(factor);
    }

    /// What is around the mirror now.
    pub fn surroundings(&self) -> Surroundings {
        self.state().surroundings
    }

    /// Whether nothing is broken, nor will be by itself.
    pub(crate) fn is_quiet(&self) -> bool {
        self.state().injected.is_quiet()
    }

    /// For who simulates the bench, once a tick: the fault of this tick, and for how many ticks it has been there.
    pub fn fault_of_this_tick(&self) -> (Option<PlantFault>, u32) {
        self.state().injected.of_this_tick()
    }

    /// Where the plate's centre is by now, from its cold rest position towards the substrate (um): what an instrument without
    /// noise and error would read.
    pub fn plate_um(&self) -> f64 {
        self.state().plate_um
    }

    /// For who simulates the bench, once a tick: what was driven at the outputs, and what is connected after it.
    pub fn observe(&self, drive_v: [f64; 4], connected: &virtual_mirror::State) {
        let mut state = self.state();
        state.injected.observe(drive_v, connected.hottest_k);
        state.plate_um = connected.z_um;
    }

    /// What the trigger pins have told since the board was switched on.
    pub fn triggers(&self) -> Counted {
        self.state().triggers
    }

    /// For who simulates the bench, once a tick: what the trigger pins tell ([`plant_link::Pins::trigger`]). They fall between two
    /// beginnings.
    pub fn count_triggers(&self, bits: u8) {
        let triggers = &mut self.state().triggers;
        triggers.frames += u64::from(bits & 1);
        triggers.lines += u64::from(bits >> 1 & 1);
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

//! What a tick tells, as the protocol has it.

use control_core::{Controller, Estimate, Second, Uncertainty};
use mirror_protocol::{ChannelState, LEASE_FOREVER_MS, Loss, Pose, Room};
use protection::Lease;

use crate::TICKS_PER_MS;

pub(super) fn pose(controller: &Controller<'_>) -> Pose {
    let pose = controller.pose();
    Pose {
        z_um: pose.z.0,
        tilt_rad: controller
            .knows_tilts()
            .then_some([pose.tilt_x.0, pose.tilt_y.0]),
    }
}

pub(super) fn room(surroundings: &Estimate) -> Room {
    // The casts saturate.
    let hundredths = |kelvin: f32| kelvin * 100.0;
    Room {
        rise_ck: hundredths(surroundings.rise.0) as i16,
        deviation_ck: hundredths(surroundings.thermometer_deviation().0) as u16,
    }
}

pub(super) fn uncertainty(uncertainty: Uncertainty) -> mirror_protocol::Uncertainty {
    // The casts saturate.
    mirror_protocol::Uncertainty {
        z_nm: (uncertainty.z.0 * 1e3) as u16,
        tilt_urad: (uncertainty.tilt.0 * 1e6) as u16,
    }
}

/// So many milliseconds and what is begun of another.
pub(super) fn whole_ms(time: Second) -> u16 {
    // Of a positive number, the cast takes the fraction away, and saturates.
    let ms = time.0 * 1e3;
    let whole = ms as u16;
    whole.saturating_add(u16::from(ms > f32::from(whole)))
}

pub(super) fn loss(surroundings: &Estimate) -> Loss {
    Loss {
        change: surroundings.loss,
        deviation: surroundings.loss_deviation,
    }
}

pub(super) fn state(state: protection::ChannelState) -> ChannelState {
    match state {
        protection::ChannelState::Off => ChannelState::Off,
        protection::ChannelState::Starting => ChannelState::Starting,
        protection::ChannelState::Ready => ChannelState::Ready,
        protection::ChannelState::Driving => ChannelState::Driving,
        protection::ChannelState::Limited => ChannelState::Limited,
        protection::ChannelState::Tripped(fault) => ChannelState::Tripped(fault.code()),
    }
}

pub(super) fn lease_ms(lease: Lease) -> u32 {
    lease
        .remaining()
        .map_or(LEASE_FOREVER_MS, |ticks| ticks / TICKS_PER_MS)
}

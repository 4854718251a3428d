//! Calibrations as bytes, as the board reads them from the link and from its flash.

use control_core::{
    AdcCode, Ampere, CHANNELS, Calibration, Controller, CurrentSense, Micrometre, SenseCalibration,
    Setpoint, Volt,
};
use crc::{CRC_32_ISO_HDLC, Crc};

use crate::factory::factory;

const CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

/// What the parser is given.
pub(crate) fn seeds() -> Vec<Vec<u8>> {
    vec![
        factory().to_bytes().to_vec(),
        SenseCalibration::DESIGNED.to_bytes().to_vec(),
    ]
}

/// Tries the bytes as they are, and with a checksum that is right: behind it is where the numbers are
/// checked. What is accepted must drive finite voltages.
pub(crate) fn run(input: &[u8]) {
    accept(input);
    let mut sealed = input.to_vec();
    if let Some(end) = sealed.len().checked_sub(4) {
        let checksum = CRC.checksum(&sealed[..end]);
        sealed[end..].copy_from_slice(&checksum.to_le_bytes());
        accept(&sealed);
    }
}

fn accept(bytes: &[u8]) {
    if let Some(sense) = SenseCalibration::from_bytes(bytes) {
        assert_eq!(SenseCalibration::from_bytes(&sense.to_bytes()), Some(sense));
        let currents = CurrentSense::new(&sense).currents([AdcCode(u16::MAX); CHANNELS]);
        assert!(
            currents
                .iter()
                .all(|current| (0.011..0.014).contains(&current.0))
        );
    }
    let Ok(mut calibration) = Calibration::from_bytes(bytes) else {
        return;
    };
    assert_eq!(
        Calibration::from_bytes(&calibration.to_bytes()),
        Ok(calibration)
    );
    let top = calibration.max_drive();
    let mut controller = Controller::new(&mut calibration);
    let mut applied = [Volt(0.0); CHANNELS];
    for z_um in [50.0, 1e6, -1.0, 0.0] {
        for current in [0.0, 5e-3, f32::NAN] {
            let setpoint = Setpoint::position(Micrometre(z_um));
            let step = controller.step(setpoint, applied, [Ampere(current); CHANNELS]);
            let is_safe = |drive: &Volt| (0.0..=top.0).contains(&drive.0);
            assert!(step.drives.iter().all(is_safe), "{:?}", step.drives);
            applied = step.drives;
        }
    }
}

//! What a bench would measure on virtual mirrors, as measurement files.
//!
//! The virtual mirror knows nothing of the lab's experiments and files, and these nothing of mirrors; tests, benches and
//! the shipped sessions meet here.

use experiments::{Dwell, Experiment};
use measurement::{Keys, MeasurementFile, Row, Session};
use virtual_mirror::session::Recording;
use virtual_mirror::{ConfigError, MirrorConfig, Plan, Session as Recorded};

/// Which instruments the bench has besides the drive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Instruments {
    /// A position sensor and four current senses.
    PositionAndCurrents,
    /// A position sensor only.
    Position,
    /// Four current senses only.
    Currents,
}

/// Measures experiments of drives, one after the other, on the mirror that `config` describes.
///
/// # Errors
/// Where a number of `config` is out of range.
///
/// # Panics
/// Where an experiment moves positions, which takes a board.
pub fn measure(
    config: &MirrorConfig,
    experiments: &[Experiment],
    instruments: Instruments,
) -> Result<Session, ConfigError> {
    let plan = Plan {
        experiments: experiments.iter().map(planned).collect(),
    };
    let recorded = Recorded::record(config, &plan)?;
    let has_oven = experiments.iter().any(|e| e.ambient_rise_k != 0.0);
    let files = recorded.recordings.iter().map(|recording| {
        let keys = keys(&recording.experiment, recorded.noise_z_nm);
        let mut rows = rows(recording, instruments);
        if has_oven {
            let celsius = config.ambient_c + recording.experiment.ambient_rise_k;
            rows.iter_mut()
                .for_each(|row| row.ambient_c = Some(celsius));
        }
        if recording.rows.iter().any(|row| row.reference_um != 0.0) {
            let told = recording.rows.iter().map(|row| row.reference_um);
            rows.iter_mut()
                .zip(told)
                .for_each(|(row, um)| row.reference_um = Some(um));
        }
        let file = MeasurementFile {
            keys,
            notes: Vec::new(),
            rows,
        };
        (format!("{}.csv", recording.experiment.name), file)
    });
    Ok(Session {
        files: files.collect(),
    })
}

/// An experiment in the virtual mirror's own terms.
fn planned(experiment: &Experiment) -> virtual_mirror::Experiment {
    let dwells = experiment.dwells().expect("an experiment of drives");
    let row = |dwell: &Dwell| virtual_mirror::Dwell {
        rest_s: dwell.rest_s,
        dwell_s: dwell.duration_s,
        drive_v: dwell.to_v,
        reference_um: dwell.stage_um,
    };
    virtual_mirror::Experiment {
        name: experiment.name.clone(),
        rest_s: experiment.rest_s,
        prehold_v: experiment.prehold.map_or(0.0, |prehold| prehold.volts),
        prehold_s: experiment.prehold.map_or(0.0, |prehold| prehold.seconds),
        ambient_rise_k: experiment.ambient_rise_k,
        interpolated: experiment.is_curved(),
        drive: experiment.drive_key(),
        rows: dwells.iter().map(row).collect(),
    }
}

fn keys(experiment: &virtual_mirror::Experiment, noise_z_nm: f64) -> Keys {
    let mut keys = Keys::default();
    keys.set("experiment", &experiment.name);
    keys.set("noise_z_nm", &noise_z_nm.to_string());
    if experiment.prehold_s > 0.0 {
        keys.set("prehold_V", &experiment.prehold_v.to_string());
        keys.set("prehold_s", &experiment.prehold_s.to_string());
    }
    if let Some(drive) = &experiment.drive {
        keys.set("drive", drive);
    }
    keys
}

fn rows(recording: &Recording, instruments: Instruments) -> Vec<Row> {
    let with_currents = instruments != Instruments::Position;
    let with_position = instruments != Instruments::Currents;
    let row = |row: &virtual_mirror::session::Row| Row {
        t_s: rounded(row.t_s, 1e-7),
        t_global_s: Some(rounded(row.t_global_s, 1e-7)),
        voltage_v: row.drive_v.map(|volts| rounded(volts, 1e-6)),
        current_a: row
            .reading
            .current_a
            .map(|current| with_currents.then_some(rounded(current, 1e-9))),
        z_um: with_position.then_some(rounded(row.reading.z_um, 1e-4)),
        ..Row::default()
    };
    recording.rows.iter().map(row).collect()
}

/// As an instrument prints it.
fn rounded(value: f64, step: f64) -> f64 {
    let steps_per_unit = (1.0 / step).round();
    (value * steps_per_unit).round() / steps_per_unit
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_session_is_read_again_as_it_was_measured() {
        let experiments = [
            Experiment::sweep(3.5, 7, 1.0, 1),
            Experiment::sine(1.0, 0.5, 1.0, 1),
        ];
        for instruments in [
            Instruments::PositionAndCurrents,
            Instruments::Position,
            Instruments::Currents,
        ] {
            let session =
                measure(&MirrorConfig::bench(), &experiments, instruments).expect("possible");
            assert_eq!(session.files.len(), 2);
            for (name, file) in session.files {
                let again = MeasurementFile::parse(&name, &file.to_string()).expect("readable");
                assert_eq!(again, file);
                assert_eq!(
                    file.has_displacement(),
                    instruments != Instruments::Currents
                );
                assert_eq!(file.has_current(), instruments != Instruments::Position);
            }
        }
    }
}

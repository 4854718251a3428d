//! What is known of a mirror's surroundings: how warm they are, and where a stage has moved it to.

use measurement::{MeasurementFile, Row, Session};

/// A smaller change of a thermometer's readings (K) tells of the room and not of the mirror: such a drift is left to the
/// effect `ambient-drift`.
const STEADY_K: f64 = 1.0;

/// The temperatures of a session.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Surroundings<'a> {
    session: &'a Session,
    first_c: Option<f64>,
}

impl<'a> Surroundings<'a> {
    pub(crate) fn of(session: &'a Session) -> Self {
        let first = session
            .files
            .iter()
            .find(|(_, file)| file.ambient_c().is_some());
        Self {
            session,
            first_c: first.and_then(|(_, file)| level(file)),
        }
    }

    /// The first known temperature, which cold resistances and the displacement's zero belong to (degC).
    pub(crate) fn first_c(&self) -> Option<f64> {
        self.first_c
    }

    /// Temperature rise of the surroundings since the first known one, row by row (K). A file that says nothing is as warm as the first
    /// one on its clock that does; one whose readings hardly differ is at their mean.
    pub(crate) fn rise_k(&self, file: &MeasurementFile) -> Vec<f64> {
        let since_first = |celsius: Option<f64>| {
            let rise = celsius
                .zip(self.first_c)
                .map_or(0.0, |(now, first)| now - first);
            if rise.abs() < STEADY_K { 0.0 } else { rise }
        };
        let level = level(file).or_else(|| self.session.ambient_c(file));
        if is_steady(file) {
            return vec![since_first(level); file.rows.len()];
        }
        let mut last = level;
        let at = |row: &Row| {
            last = row.ambient_c.or(last);
            since_first(last)
        };
        file.rows.iter().map(at).collect()
    }
}

fn readings(file: &MeasurementFile) -> impl Iterator<Item = f64> {
    file.rows.iter().filter_map(|row| row.ambient_c)
}

fn is_steady(file: &MeasurementFile) -> bool {
    let highest = readings(file).fold(f64::NEG_INFINITY, f64::max);
    let lowest = readings(file).fold(f64::INFINITY, f64::min);
    highest - lowest < STEADY_K
}

/// The mean of a file's readings, or the first of them where they differ.
fn level(file: &MeasurementFile) -> Option<f64> {
    let first = file.ambient_c()?;
    let off: f64 = readings(file).map(|celsius| celsius - first).sum();
    let mean = first + off / readings(file).count() as f64;
    Some(if is_steady(file) { mean } else { first })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(text: &str) -> (String, MeasurementFile) {
        let file = MeasurementFile::parse("a.csv", text).expect("readable");
        ("a.csv".into(), file)
    }

    fn rises(files: &[&str]) -> Vec<Vec<f64>> {
        let session = Session {
            files: files.iter().map(|text| file(text)).collect(),
        };
        let around = Surroundings::of(&session);
        let files = session.files.iter();
        files.map(|(_, file)| around.rise_k(file)).collect()
    }

    #[test]
    fn a_thermometer_s_noise_and_a_small_drift_are_no_other_room() {
        let room = "t_s,V_V,T_ambient_C\n1,0,22.05\n2,1,21.95\n3,0,\n";
        let later = "t_s,V_V,T_ambient_C\n1,0,22.6\n2,1,22.7\n";
        let oven = "t_s,V_V,T_ambient_C\n1,0,60.1\n2,1,59.9\n";
        let all = rises(&[room, later, oven]);
        assert_eq!(all[..2], [vec![0.0; 3], vec![0.0; 2]]);
        assert!(
            all[2]
                .iter()
                .all(|rise| (rise - 38.0).abs() < 1e-9 && *rise == all[2][0])
        );
    }

    #[test]
    fn an_oven_that_warms_is_followed_row_by_row() {
        let oven = "t_s,V_V,T_ambient_C\n1,0,22\n2,0,\n3,0,40\n4,0,60\n";
        assert_eq!(rises(&[oven]), [[0.0, 0.0, 18.0, 38.0]]);
    }

    #[test]
    fn a_file_that_says_nothing_is_where_the_others_on_its_clock_are() {
        let room = "t_s,V_V,T_ambient_C\n1,0,22\n2,1,22\n";
        let clock = "# session=later\nt_global_s,t_s,V_V";
        let oven = format!("{clock},T_ambient_C\n1,1,0,60\n2,2,1,60\n");
        let unsaid = format!("{clock}\n11,1,0\n12,2,1\n");
        assert_eq!(rises(&[room, &oven, &unsaid])[1..], [[38.0; 2], [38.0; 2]]);
        assert_eq!(rises(&[&unsaid, &unsaid]), [[0.0; 2], [0.0; 2]]);
    }
}

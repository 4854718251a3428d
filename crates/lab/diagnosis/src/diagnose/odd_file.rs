//! One file that reads otherwise than the others: its displacements count from another zero or with another gain, or its currents with another gain.
//!
//! No effect of a mirror comes and goes with a file. Each file's zero and gain is tried as effects are, by slopes, and told where it alone
//! explains what is missing.

use super::analysis::Analysis;
use crate::candidate::Candidate;
use identification::dataset::Channel;
use identification::prediction::standardised;

/// What one file may read otherwise.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Oddity {
    /// Its displacements, by a constant.
    Zero,
    /// Its displacements, by a part of themselves.
    GainOfDisplacements,
    /// Its currents, by a part of themselves.
    GainOfCurrents,
}

impl Oddity {
    const ALL: [Self; 3] = [Self::Zero, Self::GainOfDisplacements, Self::GainOfCurrents];

    /// In words, where a file of this name is odd by so much (um, or a part of the reading).
    fn sentence(self, name: &str, size: f64) -> String {
        let more = if size > 0.0 { "more" } else { "less" };
        match self {
            Self::Zero => format!(
                "`{name}` as a whole reads {:.2} um {more} than the other files say, which explains all that is missing: was the sensor zeroed \
                 anew, or did anything move, before it? Correct its z_um, or leave the file out",
                size.abs()
            ),
            Self::GainOfDisplacements => format!(
                "all displacements of `{name}` are {:.1} % {more} than the other files say, which explains all that is missing: was it another \
                 range of the sensor, or another spot? Correct its z_um, or leave the file out",
                100.0 * size.abs()
            ),
            Self::GainOfCurrents => format!(
                "all currents of `{name}` are {:.1} % {more} than the other files say, which explains all that is missing: was it another range, \
                 meter or mirror? Correct them, or leave the file out",
                100.0 * size.abs()
            ),
        }
    }
}

impl Analysis<'_> {
    /// The file whose own zero or gain explains what is missing, and more of it than any effect does: its name, and in a sentence.
    pub(super) fn odd_file(&self, candidates: &[Candidate]) -> Option<(String, String)> {
        let files = 0..self.data.experiments.len();
        if files.len() < 2 {
            return None;
        }
        let all = files.flat_map(|file| Oddity::ALL.map(|oddity| (file, oddity)));
        let scored = all.filter_map(|(file, oddity)| {
            let (score, size) = self.read_otherwise(file, oddity)?;
            Some((score, file, oddity, size))
        });
        let (score, file, oddity, size) = scored.max_by(|a, b| a.0.total_cmp(&b.0))?;
        let of_effects = candidates.iter().map(Candidate::score);
        let most = of_effects.fold(0.0, f64::max);
        let name = &self.data.experiments[file];
        let explains = score > most && self.null.explains(self.misfit, score);
        explains.then(|| (name.clone(), oddity.sentence(name, size)))
    }

    /// How much of the misfit a file's own zero or gain explains, and how large it is; `None` where the base explains it as well.
    fn read_otherwise(&self, file: usize, oddity: Oddity) -> Option<(f64, f64)> {
        let predicted = self.data.observations.iter().zip(&self.base);
        let change =
            predicted.map(
                |(o, predicted)| match (o.experiment == file, oddity, o.channel) {
                    (true, Oddity::Zero, Channel::Displacement) => 1.0,
                    (true, Oddity::GainOfDisplacements, Channel::Displacement)
                    | (true, Oddity::GainOfCurrents, Channel::Current(_)) => *predicted,
                    _ => 0.0,
                },
            );
        let direction = self.session.vector(&standardised(change, self.data));
        let square = direction.norm_squared();
        let along = direction.dot(&self.residual);
        (square > f64::EPSILON).then(|| (along * along / square, along / square))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_s_name_is_told_with_by_how_much_it_is_odd() {
        let zero = Oddity::Zero.sentence("ramp", 0.983);
        assert!(
            zero.starts_with("`ramp` as a whole reads 0.98 um more than"),
            "{zero}"
        );
        let gain = Oddity::GainOfDisplacements.sentence("hold", 0.0201);
        assert!(
            gain.starts_with("all displacements of `hold` are 2.0 % more than"),
            "{gain}"
        );
        let gain = Oddity::GainOfCurrents.sentence("hold", -0.0304);
        assert!(
            gain.starts_with("all currents of `hold` are 3.0 % less than"),
            "{gain}"
        );
    }
}

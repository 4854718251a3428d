//! A bench whose readings are screened as they come.

use experiments::Experiment;
use measurement::MeasurementFile;

use crate::bench::{Bench, Part};
use crate::screening::{MOST_WITHOUT, ReadingCounts, SensorError, screen};

/// A bench whose readings are screened as they come.
pub(crate) struct Screened<'a, B> {
    bench: &'a mut B,
    pub(crate) counts: ReadingCounts,
}

impl<'a, B: Bench> Screened<'a, B> {
    pub(crate) fn new(bench: &'a mut B) -> Self {
        Self {
            bench,
            counts: ReadingCounts::default(),
        }
    }
}

impl<B: Bench> Bench for Screened<'_, B> {
    type Error = B::Error;

    fn tick_s(&self) -> f64 {
        self.bench.tick_s()
    }

    async fn count_from_rest(&mut self) -> Result<(), B::Error> {
        self.bench.count_from_rest().await
    }

    async fn measure(
        &mut self,
        part: Part,
        experiment: &Experiment,
    ) -> Result<MeasurementFile, B::Error> {
        let mut file = self.bench.measure(part, experiment).await?;
        let counts = screen(&mut file, experiment.reading);
        self.counts.add(counts);
        if counts.without_weight() as f64 > MOST_WITHOUT * counts.asked as f64 {
            return Err(SensorError {
                experiment: experiment.name.clone(),
                counts,
            }
            .into());
        }
        Ok(file)
    }

    async fn put_on_trial(
        &mut self,
        calibration: &control_core::Calibration,
    ) -> Result<(), B::Error> {
        self.bench.put_on_trial(calibration).await
    }

    async fn compute<T: Send + 'static>(
        &mut self,
        what: &'static str,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, B::Error> {
        self.bench.compute(what, work).await
    }
}

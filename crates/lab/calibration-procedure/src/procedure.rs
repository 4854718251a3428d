//! The steps of a calibration, one after the other.

use calibration::{
    Refined, Remaining, TabulateError, ringing, tabulate, with_piston_residual, with_resonance,
};
use control_core::Calibration;
use experiments::calibration::{self as played, Effort, RANGE};
use experiments::{Experiment, session_in_common};
use identification::{Dataset, Identification};
use measurement::Session;
use mirror_model::Model;

use crate::bench::{Bench, Part};
use crate::doubt::{Doubt, Left};
use crate::drift_check;
use crate::refine;
use crate::screened::Screened;
use crate::screening::ReadingCounts;
use crate::travel;
use crate::trial::Trial;

/// What is to be calibrated, and how.
#[derive(Clone, Debug)]
pub struct Procedure {
    /// The model that identification starts from.
    pub start: Model,
    /// What the mirror is called.
    pub device: String,
    /// The day, as `2026-11-21`.
    pub date: String,
    /// Highest drive of the board (V).
    pub max_v: f64,
    /// Top of the range under the calibration that the board has (um).
    pub reach_um: f64,
    /// Whether displacements come with every tick.
    pub reads_every_tick: bool,
    /// How much is moved.
    pub effort: Effort,
}

/// Where the measurements come from that the mirror is identified by.
#[derive(Clone, Debug)]
pub enum Source {
    /// They were made before.
    Files(Session),
    /// They are made on the mirror.
    Mirror,
}

/// A calibration on trial, and the way to it.
#[derive(Clone, Debug)]
pub struct Calibrated {
    /// What was identified.
    pub model: Model,
    /// How.
    pub identified: Identification,
    /// Effects of the model that the board does not invert.
    pub not_inverted: Vec<Remaining>,
    /// The refined calibration, which says what the trial left, and by how much the mirror moved meanwhile.
    pub calibration: Calibration,
    /// What the refined stages leave of the displacement (um, root mean square); only a sensor that is read at every tick
    /// tells.
    pub refined_rms_um: Option<f64>,
    /// Where the mirror rests (um), its own memory left out, from where it did at the beginning: films that are hot for the first time move for
    /// good. 0 where films are usual, and where the sensor is not read at every tick.
    pub rest_um: f64,
    /// The calibration of before, as it was tried.
    pub before: Trial,
    /// The new one, as it was tried.
    pub after: Trial,
    /// By how much the mirror moved from the beginning to the end at the same drives (um); 0 where that is no more than any mirror does.
    pub moved_um: f64,
    /// What the sensor read, and what of it bore no weight.
    pub readings: ReadingCounts,
}

impl Procedure {
    /// What is played, part by part, where the mirror is measured and reaches as far as it does now: what it takes can be
    /// said before anything moves.
    pub fn experiments(&self) -> Vec<(Part, Experiment)> {
        let part = |part: Part, experiments: Vec<Experiment>| {
            experiments
                .into_iter()
                .map(move |experiment| (part, experiment))
        };
        let top_um = RANGE * self.reach_um;
        let trial = || {
            played::Trial::new(&self.effort, top_um)
                .experiments()
                .to_vec()
        };
        let refining = if self.reads_every_tick {
            played::moves(&self.effort, top_um)
        } else {
            vec![played::rests(top_um); refine::ROUNDS]
        };
        let ringing = self.reads_every_tick.then(|| played::ringing(self.max_v));
        let check = |rest_s: f64| {
            part(
                Part::DriftCheck,
                vec![played::drift_check(self.max_v).after(rest_s)],
            )
        };
        check(0.0)
            .chain(part(Part::Session, session_in_common(self.max_v)))
            .chain(part(Part::Session, ringing.into_iter().collect()))
            .chain(part(Part::Before, trial()))
            .chain(part(Part::Refining, refining))
            .chain(part(Part::After, trial()))
            .chain(check(played::CHECKED_REST_S))
            .collect()
    }

    /// Calibrates. The new calibration is on trial then; it is the caller's to keep it.
    ///
    /// # Errors
    /// Where a step fails, hardly a reading bears weight, or the trial says that the new one is not to be kept.
    pub async fn run<B: Bench>(
        &self,
        bench: &mut B,
        source: Source,
    ) -> Result<Calibrated, B::Error> {
        let mut bench = Screened::new(bench);
        let first = drift_check::first(&mut bench, self.max_v, self.reach_um).await?;
        let (session, jumps) = match source {
            Source::Files(session) => (session.clone(), session),
            Source::Mirror => self.measure_session(&mut bench).await?,
        };
        travel::check(&session, self.reach_um)?;
        first.is_of_the_mirror_of(&session)?;
        let (model, identified) = self.identify(&mut bench, session).await?;
        let resonance = bench
            .compute("listening to the plate", move || ringing(&jumps))
            .await?;
        let tabulated = tabulate(&model)?;
        let start = match resonance {
            Some(heard) => {
                with_resonance(&tabulated.calibration, heard).map_err(TabulateError::from)?
            }
            None => tabulated.calibration,
        };
        let top_um = RANGE * self.reach_um.min(f64::from(start.max_position().0));
        let before =
            Trial::run(&mut bench, Part::Before, &self.effort, (top_um, self.max_v)).await?;
        let (calibration, refined) = if self.reads_every_tick {
            match refine::by_moves(&mut bench, &self.effort, start).await? {
                Ok(refined) => (refined.calibration, Some(refined)),
                Err(error) => {
                    // What moved meanwhile is the likelier reason.
                    drift_check::moved_since(&first, &mut bench, self.max_v).await?;
                    return Err(error.into());
                }
            }
        } else {
            (refine::by_rests(&mut bench, start).await?, None)
        };
        // What creeps far goes less far at once.
        let reached_um = top_um.min(RANGE * f64::from(calibration.max_position().0));
        let after = Trial::run(
            &mut bench,
            Part::After,
            &self.effort,
            (reached_um, self.max_v),
        )
        .await?;
        let moved_um = drift_check::moved_since(&first, &mut bench, self.max_v).await?;
        let promised_rms_um = refined.as_ref().map(Refined::rest_rms_um);
        Doubt::of(&left(&before), &left(&after), promised_rms_um)?;
        // Anywhere within what has moved, a rectangular distribution (JCGM 100:2008, 4.3.7).
        let left_um = after.figures().rest_rms_um.hypot(moved_um / 3.0_f64.sqrt());
        let calibration =
            with_piston_residual(&calibration, left_um).map_err(TabulateError::from)?;
        Ok(Calibrated {
            model,
            identified,
            not_inverted: tabulated.remaining,
            calibration,
            rest_um: refined.as_ref().map_or(0.0, |refined| refined.rest_um),
            refined_rms_um: refined.map(|refined| refined.residual_rms_um),
            before,
            after,
            moved_um,
            readings: bench.counts,
        })
    }

    /// The session that identifies the mirror, and jumps that it rings after.
    async fn measure_session<B: Bench>(
        &self,
        bench: &mut B,
    ) -> Result<(Session, Session), B::Error> {
        let [mut session, mut jumps] = [Session::default(), Session::default()];
        for experiment in session_in_common(self.max_v) {
            let file = bench.measure(Part::Session, &experiment).await?;
            let name = format!("{}.csv", experiment.name);
            session.files.push((name, file));
        }
        if self.reads_every_tick {
            let ringing = played::ringing(self.max_v);
            let file = bench.measure(Part::Session, &ringing).await?;
            jumps.files.push((ringing.name, file));
        }
        Ok((session, jumps))
    }

    async fn identify<B: Bench>(
        &self,
        bench: &mut B,
        session: Session,
    ) -> Result<(Model, Identification), B::Error> {
        let start = self.start.clone();
        let identify = move || {
            let files: Vec<_> = session.files.iter().map(|(name, _)| name.clone()).collect();
            identification::identify(&start, &Dataset::new(&session), &files)
        };
        let (mut model, identified) = bench.compute("identifying", identify).await??;
        model.provenance.device = Some(self.device.clone());
        model.provenance.date = Some(self.date.clone());
        model.parameters.drive_limit_v = self.max_v;
        Ok((model, identified))
    }
}

fn left(trial: &Trial) -> Left {
    let figures = trial.figures();
    Left {
        rest_rms_um: figures.rest_rms_um,
        overshoot_percent: figures.overshoot_percent,
        loop_um: figures.loop_um,
        triangle_rms_um: figures.triangle_rms_um,
    }
}

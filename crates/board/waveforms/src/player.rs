//! A waveform as it is played, a value a control tick.

use crate::turn::{Course, folded, phase_step, sine};
use crate::waveform::{FULL_SCALE, Flaw, Quantity, Shape, Table, Tilt, Trigger, Waveform};

/// Plays a waveform.
///
/// The value of a tick is that of the waveform in the tick's middle, so that the steps that come out
/// are where the curve is on average. After the last cycle a sine and a triangle stay in their
/// middle, a table at its last point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Player {
    waveform: Waveform,
    cycles_left: u32,
    /// Of sines and triangles: the place in the cycle, a whole turn being 2^32.
    phase: u32,
    phase_step: u32,
    /// What begins with the next tick.
    due: Trigger,
    /// The place in the frame and in the line, and how far a tick goes in them.
    courses: [Course; 2],
    /// Of tables: the point, and the ticks since it began.
    point: u16,
    ticks: u32,
    /// How far what is told is ahead: ticks, and the same in the cycle of a sine or a triangle.
    lead_ticks: f32,
    lead: u32,
}

/// What a waveform is in one tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Played {
    /// Of the waveform's quantity; of a pose, the piston.
    pub value: f32,
    /// Rotations about x and y of a pose (rad); 0 where it is none.
    pub tilts: [f32; 2],
    /// What begins with it.
    pub trigger: Trigger,
}

impl Player {
    /// A player at the waveform's start, for a board of `tick_hz` control ticks a second.
    ///
    /// # Errors
    /// What makes the waveform unplayable.
    pub fn new(waveform: Waveform, tick_hz: u32) -> Result<Self, Flaw> {
        waveform.check(tick_hz)?;
        let phase_step = match waveform.shape {
            Shape::Sine { frequency_hz } | Shape::Triangle { frequency_hz } => {
                phase_step(frequency_hz, tick_hz)
            }
            Shape::Steps(_) | Shape::Lines(_) => 0,
        };
        let begins = |count: u16, trigger: Trigger| match count {
            0 => Trigger::NONE,
            _ => trigger,
        };
        let (frames, lines) = (waveform.triggers.frames, waveform.triggers.lines);
        // At most half a turn: the waveform is checked.
        let course = |count: u16| Course::of(phase_step.wrapping_mul(count.into()));
        Ok(Self {
            waveform,
            cycles_left: waveform.cycles,
            phase: phase_step / 2,
            phase_step,
            due: begins(frames, Trigger::FRAME).with(begins(lines, Trigger::LINE)),
            courses: [course(frames), course(lines)],
            point: 0,
            ticks: 0,
            lead_ticks: 0.0,
            lead: 0,
        })
    }

    /// The same, told so many ticks ahead, for who follows positions so much later. What begins, and when all is over, is not told ahead;
    /// drives and steps are not.
    pub fn leading(mut self, ticks: f32) -> Self {
        let is_followed = !matches!(self.waveform.quantity, Quantity::Drive { .. });
        if is_followed && ticks > 0.0 {
            self.lead_ticks = ticks;
            // In f64, as the step itself; whole cycles are none.
            self.lead = (f64::from(ticks) * f64::from(self.phase_step)) as u64 as u32;
        }
        self
    }

    /// What is played.
    pub fn waveform(&self) -> &Waveform {
        &self.waveform
    }

    /// Whether all cycles are over.
    pub fn is_over(&self) -> bool {
        self.cycles_left == 0
    }

    /// The next tick. `point` tells the board's points by their index.
    pub fn next(&mut self, point: impl Fn(usize) -> i16) -> Played {
        let trigger = core::mem::take(&mut self.due);
        let [shape, x, y] = match self.waveform.shape {
            Shape::Sine { .. } => self.turn(sine),
            Shape::Triangle { .. } => self.turn(|quarters| quarters),
            Shape::Steps(table) => self.step(table, point),
            Shape::Lines(table) => self.line(table, point),
        };
        let tilts = match &self.waveform.quantity {
            Quantity::Pose {
                tilts: [about_x, about_y],
            } => [
                about_x.offset + about_x.amplitude * x,
                about_y.offset + about_y.amplitude * y,
            ],
            Quantity::Position | Quantity::Drive { .. } => [0.0; 2],
        };
        Played {
            value: self.waveform.offset + self.waveform.amplitude * shape,
            tilts,
            trigger,
        }
    }

    fn turn(&mut self, shape: impl Fn(f32) -> f32) -> [f32; 3] {
        if self.is_over() {
            return self.of_pose(|tilt| tilt.at_turn(0), 0.0);
        }
        // The last cycle ends in the middle, and nothing is ahead of that.
        let phase = match self.phase.overflowing_add(self.lead) {
            (_, true) if self.cycles_left == 1 => 0,
            (phase, _) => phase,
        };
        let shares = self.of_pose(|tilt| tilt.at_turn(phase), shape(folded(phase)));
        let (phase, turned) = self.phase.overflowing_add(self.phase_step);
        self.phase = phase;
        self.cycles_left -= u32::from(turned);
        let [frame, line] = &mut self.courses;
        for (course, trigger) in [(frame, Trigger::FRAME), (line, Trigger::LINE)] {
            if course.pass() {
                self.due = self.due.with(trigger);
            }
        }
        if self.is_over() {
            self.due = Trigger::NONE;
        }
        shares
    }

    /// The piston's share of its amplitude, and each tilt's.
    fn of_pose(&self, share: impl Fn(&Tilt) -> f32, piston: f32) -> [f32; 3] {
        match &self.waveform.quantity {
            Quantity::Pose { tilts: [x, y] } => [piston, share(x), share(y)],
            Quantity::Position | Quantity::Drive { .. } => [piston, 0.0, 0.0],
        }
    }

    /// The shares that a table has in its columns, `at` telling that of the column which begins at an index.
    fn of_columns(&self, table: Table, at: impl Fn(usize) -> f32) -> [f32; 3] {
        let column = usize::from(table.points);
        match self.waveform.quantity {
            Quantity::Pose { .. } => [at(0), at(column), at(2 * column)],
            Quantity::Position | Quantity::Drive { .. } => [at(0), 0.0, 0.0],
        }
    }

    fn step(&mut self, table: Table, point: impl Fn(usize) -> i16) -> [f32; 3] {
        let index = usize::from(self.point);
        let shares = self.of_columns(table, |column| share(point(column + index)));
        self.pass(table, table.points);
        shares
    }

    fn line(&mut self, table: Table, point: impl Fn(usize) -> i16) -> [f32; 3] {
        let last = usize::from(table.points) - 1;
        if self.is_over() {
            return self.of_columns(table, |column| share(point(column + last)));
        }
        let lines = (self.ticks as f32 + 0.5 + self.lead_ticks) / table.dwell_ticks as f32;
        let ahead = lines as usize;
        let index = usize::from(self.point) + ahead;
        // What is ahead of the last line is the first of the next cycle, where there is one.
        let cycles = index.checked_div(last).unwrap_or_default();
        let (index, part) = match cycles < self.cycles_left as usize {
            true => (index - cycles * last, lines - ahead as f32),
            false => (last - 1, 1.0),
        };
        let shares = self.of_columns(table, |column| {
            let from = share(point(column + index));
            let to = share(point(column + index + 1));
            from + part * (to - from)
        });
        self.pass(table, table.points - 1);
        shares
    }

    /// A tick passes in a table with so many dwells; at the end the last one stays.
    fn pass(&mut self, table: Table, dwells: u16) {
        if self.is_over() {
            return;
        }
        self.ticks += 1;
        if self.ticks < table.dwell_ticks {
            return;
        }
        self.ticks = 0;
        if self.point + 1 < dwells {
            self.point += 1;
            return;
        }
        self.cycles_left -= 1;
        if !self.is_over() {
            self.point = 0;
            if self.waveform.triggers.frames > 0 {
                self.due = Trigger::FRAME;
            }
        }
    }
}

/// A point as a share of the amplitude.
fn share(point: i16) -> f32 {
    f32::from(point) / f32::from(FULL_SCALE)
}

#[cfg(test)]
mod tests;

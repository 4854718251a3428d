//! What the live view knows: samples and answers of the board go in, and orders to it come out.

use std::collections::VecDeque;
use std::path::PathBuf;

use calibration::PlatePose;
use mirror_protocol::{ChannelState, LEASE_FOREVER_MS, Status, Telemetry};
use quantities::{Length, in_unit};

use super::keys::Key;
use crate::board::check_position;
use crate::commands::pose::told_pose;
use crate::error::ToolError;
use crate::names::fault_name;
use crate::report::decimal;

/// The recent past that is drawn (s of the board's time): a few of the slowest time constants of a mirror in air.
pub(super) const PAST_S: f64 = 10.0;
/// Points of the past that are kept: more than a wide terminal has dots.
const MOST_POINTS: f64 = 500.0;

/// What the board is to do, or this tool.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Order {
    /// Move to a pose, and stay there.
    Move(PlatePose),
    /// Turn all channels off.
    Stop,
    /// Forget faults and stops.
    Clear,
    /// Begin a recording, or end the one that there is.
    Record,
    /// End the view.
    Quit,
    /// The same, by Ctrl-C.
    Interrupt,
}

/// What became of a board that is gone, and what to do: the same whatever was asked of it when it went.
const GONE: &str = "gone: it was unplugged, reset, or its emulator ended. Plug it in, or start it again: the view goes on by itself";
/// What a key says that needs a board where there is none.
const NO_BOARD: &str = "that needs the board, which is gone; q quits";

/// One moment of the past.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Point {
    pub(super) tick: u32,
    /// Where the plate is asked to be on its way (um).
    pub(super) pose_um: f64,
    /// What the sensor reads, where it does (um).
    pub(super) sensor_um: Option<f64>,
    /// Temperature rises (K), where the currents imply any.
    pub(super) rise_k: [Option<f64>; 4],
}

/// What is recorded, and how much of it there is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Recorded {
    pub(super) file: PathBuf,
    pub(super) samples: usize,
}

/// What the live view knows.
#[derive(Debug)]
pub(super) struct State {
    /// What the board is called.
    pub(super) board: String,
    pub(super) tick_hz: u32,
    /// Control ticks from one sample to the next.
    period_ticks: u16,
    /// Asked of the board now and then.
    pub(super) status: Status,
    /// Where the board is gone, that it is and what to do; all else is what was known last.
    pub(super) gone: Option<String>,
    pub(super) latest: Telemetry,
    pub(super) past: VecDeque<Point>,
    /// Whether the latest sample is one of the stream that there is, so that the next one tells what is lost between.
    is_streaming: bool,
    /// Samples that have come, and those missing between them.
    pub(super) samples: u64,
    pub(super) lost: u64,
    /// The pose that was asked for last, while this view drives.
    pub(super) asked: Option<PlatePose>,
    /// Whether this view has ever asked the board to drive.
    pub(super) has_driven: bool,
    /// A position or a step that is being typed.
    pub(super) entry: String,
    /// What happened last, in words.
    pub(super) notice: String,
    pub(super) recorded: Option<Recorded>,
}

impl State {
    pub(super) fn new(board: &str, tick_hz: u32, period_ticks: u16, status: Status) -> Self {
        Self {
            board: board.to_owned(),
            tick_hz,
            period_ticks,
            latest: status.telemetry,
            status,
            gone: None,
            is_streaming: false,
            past: VecDeque::new(),
            samples: 0,
            lost: 0,
            asked: None,
            has_driven: false,
            entry: String::new(),
            notice: String::new(),
            recorded: None,
        }
    }

    /// Top of the range (um).
    pub(super) fn max_um(&self) -> f64 {
        decimal(self.status.max_position_um)
    }

    /// Seconds of the board's time from a tick to the latest sample.
    pub(super) fn age_s(&self, tick: u32) -> f64 {
        f64::from(self.latest.tick.wrapping_sub(tick)) / f64::from(self.tick_hz)
    }

    /// The board is gone. Where it is found and lost again before it answers, nothing has changed, and what was told stays.
    pub(super) fn loses(&mut self) {
        self.is_streaming = false;
        if self.gone.replace(GONE.to_owned()).is_some() {
            return;
        }
        self.lets_go("");
    }

    /// The board is still gone, or is there and cannot be opened.
    pub(super) fn misses(&mut self, error: &ToolError) {
        // That it cannot be reached is known.
        let is_absent = matches!(error, ToolError::Open { .. } | ToolError::LinkLost { .. });
        self.gone = Some(match is_absent {
            true => GONE.to_owned(),
            false => format!("not shown: {error}"),
        });
    }

    /// The board is there, perhaps again; then it counts anew, and what came before is no past of it.
    pub(super) fn finds(&mut self, tick_hz: u32, period_ticks: u16, status: Status) {
        if self.gone.take().is_some() {
            "the board is back".clone_into(&mut self.notice);
        }
        (self.tick_hz, self.period_ticks) = (tick_hz, period_ticks);
        self.latest = status.telemetry;
        self.status = status;
        self.past.clear();
        self.is_streaming = false;
    }

    /// Takes a sample.
    pub(super) fn take(&mut self, sample: &Telemetry) {
        if self.is_streaming {
            let ticks = sample.tick.wrapping_sub(self.latest.tick);
            self.lost += u64::from((ticks / u32::from(self.period_ticks)).saturating_sub(1));
        }
        self.is_streaming = true;
        self.samples += 1;
        self.latest = *sample;
        if let Some(recorded) = &mut self.recorded {
            recorded.samples += 1;
        }
        let step_s = PAST_S / MOST_POINTS;
        if self
            .past
            .back()
            .is_none_or(|last| self.age_s(last.tick) >= step_s)
        {
            self.past.push_back(Point {
                tick: sample.tick,
                pose_um: decimal(sample.pose.z_um),
                sensor_um: sample.sensor_z_um.map(decimal),
                rise_k: sample.temperature_k.map(|kelvin| kelvin.map(decimal)),
            });
        }
        while self
            .past
            .front()
            .is_some_and(|first| self.age_s(first.tick) > PAST_S)
        {
            self.past.pop_front();
        }
    }

    /// What a key asks for, if it is more than a change of the view's own.
    pub(super) fn press(&mut self, key: Key) -> Option<Order> {
        let order = self.order(key);
        let needs_board = !matches!(order, None | Some(Order::Quit | Order::Interrupt));
        if self.gone.is_some() && needs_board {
            NO_BOARD.clone_into(&mut self.notice);
            return None;
        }
        if let Some(Order::Move(pose)) = order {
            self.asked = Some(pose);
            self.has_driven = true;
            self.notice.clear();
        }
        order
    }

    fn order(&mut self, key: Key) -> Option<Order> {
        match key {
            Key::Character(character) => {
                self.entry.push(character);
                None
            }
            Key::Backspace => {
                self.entry.pop();
                None
            }
            Key::Escape => {
                self.entry.clear();
                None
            }
            Key::Enter => {
                let entry = std::mem::take(&mut self.entry);
                (!entry.is_empty()).then(|| self.read(&entry)).flatten()
            }
            Key::Nudge(um) => Some(Order::Move(self.within(self.now(), um))),
            Key::Hold => Some(Order::Move(self.within(self.pose(), 0.0))),
            Key::Stop => {
                self.entry.clear();
                Some(Order::Stop)
            }
            Key::Clear => Some(Order::Clear),
            Key::Record => Some(Order::Record),
            Key::Quit => Some(Order::Quit),
            Key::Interrupt => Some(Order::Interrupt),
        }
    }

    /// A pose that is higher by so much (um), as far as the range goes.
    fn within(&self, from: PlatePose, um: f64) -> PlatePose {
        PlatePose {
            z_um: (from.z_um + um).clamp(0.0, self.max_um()),
            ..from
        }
    }

    /// The move to a position as it was typed, of a level plate, or with a sign by that much with the tilts that there are; micrometres where
    /// it has no unit.
    fn read(&mut self, entry: &str) -> Option<Order> {
        let from = match entry.starts_with(['+', '-']) {
            true => self.now(),
            false => PlatePose::default(),
        };
        let typed = in_unit(entry, "um").map_err(|error| error.to_string());
        let within = typed.and_then(|Length { um }| {
            let asked = Length { um: from.z_um + um };
            let within = check_position(asked, &self.status);
            within.map_err(|error| error.to_string()).map(|()| asked)
        });
        match within {
            Ok(asked) => Some(Order::Move(PlatePose {
                z_um: asked.um,
                ..from
            })),
            Err(why) => {
                self.notice = why;
                None
            }
        }
    }

    /// Where a step begins: at what was asked for last, or where the plate is.
    fn now(&self) -> PlatePose {
        self.asked.unwrap_or(self.pose())
    }

    /// Where the plate is asked to be on its way now; level where its tilts are not known.
    fn pose(&self) -> PlatePose {
        told_pose(&self.latest.pose)
    }

    /// The board was moved to a pose, which is the last that was asked for unless another is already.
    pub(super) fn drives(&mut self, pose: PlatePose) {
        self.asked.get_or_insert(pose);
    }

    /// This view drives nothing any more, and why.
    pub(super) fn lets_go(&mut self, why: impl Into<String>) {
        self.asked = None;
        self.notice = why.into();
    }

    /// The first channel that has tripped, from 1, and its fault.
    pub(super) fn tripped(&self) -> Option<(usize, &'static str)> {
        let of = |(channel, state): (usize, &ChannelState)| match state {
            ChannelState::Tripped(fault) => Some((channel, fault_name(*fault))),
            _ => None,
        };
        (1..).zip(&self.latest.states).find_map(of)
    }

    /// Who drives, as the end of a sentence that begins with `driven`; `None` where nothing is driven.
    pub(super) fn driver(&self) -> Option<String> {
        if self.asked.is_some() {
            return Some("from here".to_owned());
        }
        self.status.health.lease_left_ms.map(|left| match left {
            LEASE_FOREVER_MS => "by an earlier command, until told otherwise".to_owned(),
            ms => format!("by an earlier command, {:.0} s more", f64::from(ms) * 1e-3),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::board::tests::status;
    use mirror_protocol::Pose;
    use proptest::prelude::*;

    const PERIOD_TICKS: u16 = 100;

    fn at_rest() -> State {
        State::new("a", 10_000, PERIOD_TICKS, status(Telemetry::default()))
    }

    fn level(z_um: f64) -> PlatePose {
        PlatePose {
            z_um,
            ..PlatePose::default()
        }
    }

    fn typed(state: &mut State, text: &str) -> Option<Order> {
        for character in text.chars() {
            assert_eq!(state.press(Key::Character(character)), None);
        }
        state.press(Key::Enter)
    }

    #[test]
    fn a_position_is_typed_with_a_unit_or_without_and_refused_beyond_the_range() {
        let mut state = at_rest();
        assert_eq!(typed(&mut state, "60"), Some(Order::Move(level(60.0))));
        assert_eq!(typed(&mut state, "12.5um"), Some(Order::Move(level(12.5))));
        assert_eq!(typed(&mut state, "500nm"), Some(Order::Move(level(0.5))));
        assert_eq!(typed(&mut state, ""), None);
        for (text, told) in [
            ("300", "beyond the range"),
            ("1..2", "unit"),
            ("3mu", "unit"),
        ] {
            assert_eq!(typed(&mut state, text), None);
            assert!(state.notice.contains(told), "{text}: {}", state.notice);
            assert_eq!(state.entry, "");
        }
        state.press(Key::Character('7'));
        state.press(Key::Character('8'));
        state.press(Key::Backspace);
        assert_eq!(state.entry, "7");
        assert_eq!(state.press(Key::Stop), Some(Order::Stop));
        assert_eq!(state.press(Key::Enter), None, "a stop drops what was typed");
    }

    #[test]
    fn a_number_with_a_sign_is_a_step_and_moves_nothing_before_it_is_whole() {
        let mut state = at_rest();
        typed(&mut state, "60");
        assert_eq!(typed(&mut state, "-5"), Some(Order::Move(level(55.0))));
        assert_eq!(typed(&mut state, "+500nm"), Some(Order::Move(level(55.5))));
        for (text, told) in [("-60", "beyond the range"), ("-", "number"), ("5-", "unit")] {
            assert_eq!(typed(&mut state, text), None);
            assert!(state.notice.contains(told), "{text}: {}", state.notice);
        }
    }

    #[test]
    fn a_nudge_goes_on_from_what_was_asked_and_a_hold_stays_on_the_way() {
        let mut state = at_rest();
        state.latest.pose = Pose {
            z_um: 30.0,
            tilt_rad: None,
        };
        assert!(!state.has_driven);
        assert_eq!(state.press(Key::Nudge(1.0)), Some(Order::Move(level(31.0))));
        assert!(state.has_driven);
        assert_eq!(state.press(Key::Nudge(1.0)), Some(Order::Move(level(32.0))));
        state.drives(level(31.0));
        assert_eq!(
            state.press(Key::Nudge(10.0)),
            Some(Order::Move(level(42.0))),
            "the first was carried out meanwhile"
        );
        assert_eq!(state.press(Key::Hold), Some(Order::Move(level(30.0))));
        for (text, um, end_um) in [("0.5", -1.0, 0.0), ("169.5", 1.0, 170.0)] {
            typed(&mut state, text);
            assert_eq!(
                state.press(Key::Nudge(um)),
                Some(Order::Move(level(end_um)))
            );
        }
    }

    #[test]
    fn a_hold_and_steps_keep_the_tilts_and_a_position_is_level() {
        let mut state = at_rest();
        state.latest.pose = Pose {
            z_um: 60.0,
            tilt_rad: Some([0.015_625, -0.007_812_5]),
        };
        let tilted = |z_um| {
            Some(Order::Move(PlatePose {
                z_um,
                tilt_x_rad: 0.015_625,
                tilt_y_rad: -0.007_812_5,
            }))
        };
        assert_eq!(state.press(Key::Hold), tilted(60.0));
        assert_eq!(state.press(Key::Nudge(1.0)), tilted(61.0));
        assert_eq!(typed(&mut state, "+5"), tilted(66.0));
        assert_eq!(typed(&mut state, "70"), Some(Order::Move(level(70.0))));
    }

    #[test]
    fn who_drives_is_told() {
        let mut state = at_rest();
        assert_eq!(state.driver(), None);
        state.status.health.lease_left_ms = Some(5_400);
        let told = state.driver().expect("something is driven");
        assert_eq!(told, "by an earlier command, 5 s more");
        state.drives(level(1.0));
        assert_eq!(state.driver().as_deref(), Some("from here"));
        state.lets_go("why");
        assert_eq!(state.notice, "why");
        state.status.health.lease_left_ms = Some(LEASE_FOREVER_MS);
        let told = state.driver().expect("something is driven");
        assert!(told.contains("until told otherwise"), "{told}");
    }

    #[test]
    fn without_a_board_keys_that_need_one_say_so_and_the_others_go_on() {
        let mut state = at_rest();
        state.drives(level(60.0));
        state.loses();
        assert_eq!(state.asked, None, "nothing is driven from here");
        let told = state.gone.clone().expect("it is told");
        for word in ["gone", "unplugged", "Plug it in", "by itself"] {
            assert!(told.contains(word), "{told}");
        }
        for key in [
            Key::Nudge(1.0),
            Key::Hold,
            Key::Stop,
            Key::Clear,
            Key::Record,
        ] {
            state.notice.clear();
            assert_eq!(state.press(key), None, "{key:?}");
            assert_eq!(state.notice, NO_BOARD, "{key:?}");
        }
        assert_eq!(typed(&mut state, "60"), None);
        assert!(!state.has_driven);
        assert_eq!(state.press(Key::Quit), Some(Order::Quit));
        assert_eq!(state.press(Key::Interrupt), Some(Order::Interrupt));

        let another = ToolError::InUse {
            board: "a".to_owned(),
            owner: "another tool".to_owned(),
        };
        state.misses(&another);
        let told = state.gone.clone().expect("it is told");
        assert!(told.contains("in use by another tool"), "{told}");

        state.finds(10_000, PERIOD_TICKS, status(Telemetry::default()));
        assert_eq!(
            (&state.gone, state.notice.as_str()),
            (&None, "the board is back")
        );
        assert_eq!(typed(&mut state, "60"), Some(Order::Move(level(60.0))));
    }

    #[test]
    fn a_board_that_is_lost_again_before_it_answers_clears_no_notice() {
        let mut state = at_rest();
        state.loses();
        "recorded in a.csv".clone_into(&mut state.notice);
        state.loses();
        assert_eq!(state.notice, "recorded in a.csv");
    }

    #[test]
    fn a_board_that_is_back_has_lost_nothing_and_has_no_past() {
        let mut state = at_rest();
        let at = |tick| Telemetry {
            tick,
            ..Telemetry::default()
        };
        state.take(&at(1_000_000));
        state.loses();
        state.finds(10_000, PERIOD_TICKS, status(at(100)));
        assert!(state.past.is_empty());
        state.take(&at(5_000));
        assert_eq!((state.samples, state.lost), (2, 0));
        state.take(&at(5_200));
        assert_eq!(state.lost, 1);
    }

    proptest! {
        #[test]
        fn lost_samples_are_counted_and_the_past_is_bounded(
            steps in proptest::collection::vec(1_u32..5, 1..3000), first in any::<u32>(),
        ) {
            let mut state = at_rest();
            let mut tick = first;
            let mut missing = 0;
            state.take(&Telemetry { tick, ..Telemetry::default() });
            for step in &steps {
                tick = tick.wrapping_add(step * u32::from(PERIOD_TICKS));
                missing += u64::from(step - 1);
                state.take(&Telemetry { tick, ..Telemetry::default() });
            }
            prop_assert_eq!((state.samples, state.lost), (steps.len() as u64 + 1, missing));
            prop_assert!(state.past.len() <= MOST_POINTS as usize + 1);
            prop_assert!(state.past.iter().all(|point| state.age_s(point.tick) <= PAST_S));
        }
    }
}

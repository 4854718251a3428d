//! How fast an emulated board's clock goes.

use std::fs;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

/// Length of a control tick.
const TICK: Duration = Duration::from_micros(100);
/// Ticks from one look at the wall's clock to the next, so that looking costs nothing beside them: 1.6 ms of the
/// board's time.
const LOOK_TICKS: u32 = 16;
/// How far the board may be ahead before it waits: short beside an answer that a person waits for, and long beside
/// the 0.1 ms or so that falling asleep and waking up cost.
const AHEAD: Duration = Duration::from_millis(5);
/// A board that is further behind has been kept from running, and does not catch up: its mirror and its host would
/// see time rush. Twenty of a busy machine's turns of 5 ms.
const BEHIND: Duration = Duration::from_millis(100);
/// Ticks for which an idle board is left alone at a time while no tool is connected: 20 ms, less than a person notices
/// when a tool comes, and a five hundredth of what their exchanges would cost.
const QUIET_TICKS: u16 = 200;
/// From one look for a tool to the next: less than a person notices, and a look takes some 0.1 ms.
const TOOL_LOOK: Duration = Duration::from_millis(50);
/// A tool that waits for the board asks for its time every 20 ms, or is sent samples. One to which and from which nothing
/// has gone for so long computes, and the processor is its.
const COMPUTES: Duration = Duration::from_secs(1);

/// Where Linux tells which sockets are connected.
const SOCKETS: &str = "/proc/net/unix";
/// Which word of a line there is the state, and what that is of a socket that only listens.
const STATE: usize = 5;
const LISTENS: &str = "01";

/// How fast an emulated board's clock goes, beside the wall's.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Speed {
    /// As fast as it can while a tool waits for it, and with the wall's while none does.
    #[default]
    Awaited,
    /// As fast as it can.
    Fastest,
    /// So many times as fast, where the machine can.
    Times(f64),
}

/// Why a speed is none.
#[derive(Debug, thiserror::Error, PartialEq, Eq)]
#[error("`{0}` is no speed: say `max`, or how many times as fast as the wall's clock, 1 to 1000")]
pub struct NoSpeed(String);

impl Speed {
    /// A tool waits for samples by the wall's clock, as it does in front of a real board.
    const SLOWEST: f64 = 1.0;
    /// No machine is as fast: a tick takes 10 us at least.
    const HIGHEST: f64 = 1000.0;
}

impl FromStr for Speed {
    type Err = NoSpeed;

    fn from_str(text: &str) -> Result<Self, NoSpeed> {
        if text == "max" {
            return Ok(Self::Fastest);
        }
        match text.parse() {
            Ok(times) if (Self::SLOWEST..=Self::HIGHEST).contains(&times) => Ok(Self::Times(times)),
            _ => Err(NoSpeed(text.to_owned())),
        }
    }
}

/// When something last went between a board and a tool.
#[derive(Clone, Debug, Default)]
pub struct Traffic(Arc<Mutex<Option<Instant>>>);

impl Traffic {
    /// Something does.
    pub(crate) fn passes(&self) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = Some(Instant::now());
    }

    fn is_recent(&self) -> bool {
        let last = *self.0.lock().unwrap_or_else(PoisonError::into_inner);
        last.is_some_and(|last| last.elapsed() < COMPUTES)
    }
}

/// How a board knows that a tool waits for it.
#[derive(Debug)]
enum Tool {
    /// One is connected to this socket, at the last look: what goes through is the emulator's, and nobody else sees it.
    At {
        socket: PathBuf,
        looked: Option<Duration>,
        is_connected: bool,
    },
    /// Something has just passed.
    By(Traffic),
}

impl Tool {
    fn waits(&mut self, now: Duration) -> bool {
        match self {
            Self::At {
                socket,
                looked,
                is_connected,
            } => {
                if looked.is_none_or(|looked| now > looked + TOOL_LOOK) {
                    *looked = Some(now);
                    *is_connected = has_connection(socket);
                }
                *is_connected
            }
            Self::By(traffic) => traffic.is_recent(),
        }
    }
}

/// Keeps a board's clock at its speed.
#[derive(Debug)]
pub struct Pace {
    course: Course,
    start: Instant,
    tool: Tool,
    /// As far as anybody has looked.
    is_awaited: bool,
    /// Since the last look at the wall's clock.
    ticks: u32,
}

impl Pace {
    /// Of a board in an emulator that tools reach through `socket`.
    pub(crate) fn at(speed: Speed, socket: &Path) -> Self {
        let socket = socket.to_owned();
        let tool = Tool::At {
            socket,
            looked: None,
            is_connected: false,
        };
        Self::new(speed, tool)
    }

    /// Of a board whose exchanges with tools are seen.
    pub fn by(speed: Speed, traffic: Traffic) -> Self {
        Self::new(speed, Tool::By(traffic))
    }

    fn new(speed: Speed, tool: Tool) -> Self {
        Self {
            course: Course::new(speed),
            start: Instant::now(),
            tool,
            is_awaited: true,
            ticks: 0,
        }
    }

    /// A tick is over: waits for as long as the board is ahead.
    pub fn tick(&mut self) {
        if self.course.speed == Speed::Fastest {
            return;
        }
        self.ticks += 1;
        if self.ticks < LOOK_TICKS {
            return;
        }
        let ticks = std::mem::take(&mut self.ticks);
        self.wait(ticks);
    }

    /// An idle board may be left alone: waits for as long as that lasts, and returns how many ticks it is.
    pub(crate) fn leave_alone(&mut self) -> u16 {
        if self.course.speed != Speed::Awaited || self.is_awaited {
            return 0;
        }
        self.wait(QUIET_TICKS.into());
        QUIET_TICKS
    }

    /// Waits for as long as the board is ahead after so many ticks more.
    fn wait(&mut self, ticks: u32) {
        let now = self.start.elapsed();
        self.is_awaited = self.tool.waits(now);
        let ahead = self.course.ahead(ticks, now, self.is_awaited);
        if !ahead.is_zero() {
            thread::sleep(ahead);
        }
    }
}

/// The board's time beside the wall's.
#[derive(Debug)]
struct Course {
    speed: Speed,
    /// When the wall's clock has to be where the board's is.
    due: Option<Duration>,
}

impl Course {
    fn new(speed: Speed) -> Self {
        Self { speed, due: None }
    }

    /// How long to wait after so many ticks more, at `now` by the wall; with a tool that waits, or without.
    fn ahead(&mut self, ticks: u32, now: Duration, is_awaited: bool) -> Duration {
        let times = match self.speed {
            Speed::Fastest => None,
            Speed::Awaited if is_awaited => None,
            Speed::Awaited => Some(1.0),
            Speed::Times(times) => Some(times),
        };
        let Some(times) = times else {
            self.due = None;
            return Duration::ZERO;
        };
        let due = self.due.unwrap_or(now) + (TICK * ticks).div_f64(times);
        self.due = Some(if now > due + BEHIND { now } else { due });
        match due.saturating_sub(now) {
            ahead if ahead >= AHEAD => ahead,
            _ => Duration::ZERO,
        }
    }
}

/// Whether a tool is connected to `socket`, or waits for its turn: only the system knows, for QEMU takes the
/// connections.
fn has_connection(socket: &Path) -> bool {
    let sockets = fs::read_to_string(SOCKETS).unwrap_or_default();
    let name = format!(" {}", socket.display());
    sockets
        .lines()
        .filter(|line| line.ends_with(&name))
        .any(|line| line.split_whitespace().nth(STATE) != Some(LISTENS))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::net::{UnixListener, UnixStream};

    /// A machine that could run a board ten times as fast as the wall's clock.
    const TICK_TAKES: Duration = Duration::from_micros(10);
    /// A board may be ahead by so much, and looks after so many ticks.
    const TOLERANCE: Duration = AHEAD.saturating_add(TICK.saturating_mul(2 * LOOK_TICKS));

    /// How long so many ticks take by the wall's clock, from `start` on.
    fn takes(course: &mut Course, ticks: u32, start: Duration, has_tool: bool) -> Duration {
        let mut now = start;
        for _ in 0..ticks / LOOK_TICKS {
            now += TICK_TAKES * LOOK_TICKS;
            now += course.ahead(LOOK_TICKS, now, has_tool);
        }
        now - start
    }

    #[test]
    fn a_board_goes_at_its_speed_where_the_machine_can() {
        // 10 s of the board's time.
        let ticks = 100_000;
        for (speed, has_tool, wall_s) in [
            (Speed::Awaited, false, 10.0),
            (Speed::Awaited, true, 1.0),
            (Speed::Fastest, false, 1.0),
            (Speed::Times(1.0), true, 10.0),
            (Speed::Times(4.0), false, 2.5),
        ] {
            let took = takes(&mut Course::new(speed), ticks, Duration::ZERO, has_tool);
            let error_s = took.as_secs_f64() - wall_s;
            assert!(
                error_s.abs() <= TOLERANCE.as_secs_f64(),
                "{speed:?}: {took:?}"
            );
        }
    }

    #[test]
    fn a_board_that_was_kept_from_running_does_not_rush() {
        let mut course = Course::new(Speed::Times(1.0));
        let before = takes(&mut course, 1600, Duration::ZERO, false);
        let took = takes(&mut course, 16_000, before + 20 * BEHIND, false);
        let error = took.abs_diff(TICK * 16_000);
        assert!(error <= TOLERANCE, "{took:?}");
    }

    #[test]
    fn a_short_delay_is_made_up() {
        let mut course = Course::new(Speed::Times(1.0));
        let before = takes(&mut course, 1600, Duration::ZERO, false);
        let delay = BEHIND / 2;
        let took = takes(&mut course, 16_000, before + delay, false);
        let error = (took + delay).abs_diff(TICK * 16_000);
        assert!(error <= TOLERANCE, "{took:?}");
    }

    #[test]
    fn a_board_goes_with_the_wall_from_when_its_tool_leaves() {
        let mut course = Course::new(Speed::Awaited);
        let fast = takes(&mut course, 16_000, Duration::ZERO, true);
        let took = takes(&mut course, 16_000, fast, false);
        assert!(took.abs_diff(TICK * 16_000) <= TOLERANCE, "{took:?}");
    }

    #[test]
    fn a_tool_is_seen_while_it_is_connected() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("with a space.sock");
        let listener = UnixListener::bind(&path).expect("a socket");
        assert!(!has_connection(&path));
        let tool = UnixStream::connect(&path).expect("it listens");
        assert!(has_connection(&path), "it waits for its turn");
        let taken = listener.accept().expect("a tool");
        assert!(has_connection(&path));
        assert!(!has_connection(&folder.path().join("space.sock")));
        drop(tool);
        drop(taken);
        assert!(!has_connection(&path));
    }

    #[test]
    fn a_tool_that_computes_is_not_waiting() {
        let traffic = Traffic::default();
        let mut tool = Tool::By(traffic.clone());
        assert!(!tool.waits(Duration::ZERO), "nobody has come");
        traffic.passes();
        assert!(tool.waits(Duration::ZERO));
        let before = Instant::now().checked_sub(COMPUTES);
        *traffic.0.lock().expect("nobody panics") = before;
        assert!(!tool.waits(Duration::ZERO));
    }

    #[test]
    fn speeds_are_numbers_or_max() {
        assert_eq!("max".parse(), Ok(Speed::Fastest));
        assert_eq!("2.5".parse(), Ok(Speed::Times(2.5)));
        for text in ["", "0", "0.9", "-1", "nan", "inf", "1e9", "fast", "2x"] {
            let refused = text.parse::<Speed>().expect_err("no speed");
            assert!(
                refused.to_string().contains(&format!("`{text}`")),
                "{refused}"
            );
        }
    }
}

//! `monitor`: a live view of the board in the terminal, with keys that drive it.
//!
//! `keys` says what a key means, `state` what is known and what a key asks for, `lines`, `chart` and `view` what
//! that looks like.
//! `driver` does with the board what was asked, `screen` is the terminal, and this file lets all of them run side by side.

mod chart;
mod driver;
mod keys;
mod lines;
mod plotjuggler;
mod screen;
mod state;
mod view;

use std::cell::{Cell, RefCell};
use std::convert::Infallible;
use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use mirror_protocol::Identity;
use quantities::Span;
use ratatui::crossterm::event::Event;
use serde::Serialize;
use tokio::sync::Notify;
use tokio::sync::mpsc::{UnboundedReceiver, UnboundedSender, unbounded_channel};
use tokio::time::{MissedTickBehavior, interval, sleep};

use self::driver::Driver;
use self::plotjuggler::Receiver;
use self::screen::Screen;
use self::state::{Order, Recorded, State};
use super::record::Recorder;
use crate::board::{Board, Reconnecting, Samples, choose};
use crate::error::{OutputError, ToolError};
use crate::new_file::NewFile;
use crate::report;
use crate::system::ended_by_signal;

/// From one frame to the next: 20 a second look continuous, and cost little.
const FRAME: Duration = Duration::from_millis(50);
/// From one question about the board's health to the next, and where it is gone, from one look for it to the next.
const LOOK: Duration = Duration::from_millis(200);

#[derive(Serialize)]
struct Watched {
    samples: u64,
    samples_lost: u64,
    recorded: Vec<PathBuf>,
    /// Whether this view drove the mirror, and has turned the channels off.
    turned_off: bool,
    /// Whether the board was gone when the view ended.
    gone: bool,
}

/// Why a recording ends with its board.
const GONE: &str = "the board was gone";

/// How a view ended.
#[derive(Clone, Copy)]
enum ViewEnded {
    Quit,
    Signal(&'static str, u8),
}

/// Shows the board until it is told to end; what this view drives is off then.
pub(super) async fn run(
    board: Option<&str>,
    period: Span,
    output: PathBuf,
    plotjuggler: Option<&str>,
    json: bool,
) -> Result<(), ToolError> {
    screen::check()?;
    let receiver = plotjuggler.map(Receiver::open).transpose()?;
    let found = choose(board)?;
    let board = Board::open(&found).await?;
    let period_ticks = board.period_ticks(period)?;
    let status = board.status().await?;
    let identity = board.identity().clone();
    let state = RefCell::new(State::new(
        short(&found.name),
        identity.tick_hz,
        period_ticks,
        status,
    ));
    let view = LiveView {
        link: Reconnecting::open(found, board),
        identity: RefCell::new(identity),
        period,
        state: &state,
        recordings: RefCell::new(Recordings::new(output)),
        receiver,
        stop: Notify::new(),
    };
    let (send, orders) = unbounded_channel();
    let ended = {
        let mut screen = Screen::open()?;
        tokio::select! {
            ended = view.converse(&mut screen, screen::events(), send) => ended,
            ended = ended_by_signal() => {
                ended.map(|(name, number)| ViewEnded::Signal(name, number)).map_err(ToolError::Runtime)
            }
            Err(error) = view.go_on(orders) => Err(error),
        }
    };
    let turned_off = view.leave().await;
    let recorded = view.recordings.into_inner().finish()?;
    let state = state.into_inner();
    let gone = state.gone.is_some();
    let watched = Watched {
        samples: state.samples,
        samples_lost: state.lost,
        recorded,
        turned_off,
        gone,
    };
    report::print(&watched, json);
    match ended? {
        ViewEnded::Quit => Ok(()),
        ViewEnded::Signal(signal, number) => Err(ToolError::EndedBySignal {
            signal,
            number,
            outputs: outputs(turned_off, gone),
        }),
    }
}

/// A board's name; of a socket's path its last part.
fn short(name: &str) -> &str {
    name.rsplit('/')
        .next()
        .unwrap_or(name)
        .trim_end_matches(".sock")
}

/// What became of the channels, in words.
fn outputs(turned_off: bool, gone: bool) -> &'static str {
    match (turned_off, gone) {
        (true, _) => "channels are off",
        (false, true) => "the board is gone; what this drove it ramps to zero by itself",
        (false, false) => "this drove nothing, and the board goes on with what it does",
    }
}

/// What is shown, and what a key does besides driving.
struct LiveView<'a> {
    link: Reconnecting,
    /// Of the board as it was opened last.
    identity: RefCell<Identity>,
    /// From one sample to the next.
    period: Span,
    state: &'a RefCell<State>,
    recordings: RefCell<Recordings>,
    receiver: Option<Receiver>,
    stop: Notify,
}

impl LiveView<'_> {
    /// Draws frames and reads keys until one ends the view.
    async fn converse(
        &self,
        screen: &mut Screen,
        mut events: UnboundedReceiver<Event>,
        orders: UnboundedSender<Order>,
    ) -> Result<ViewEnded, ToolError> {
        let mut frames = interval(FRAME);
        frames.set_missed_tick_behavior(MissedTickBehavior::Delay);
        loop {
            tokio::select! {
                event = events.recv() => {
                    let Some(event) = event else {
                        return Ok(ViewEnded::Signal("the end of its terminal", 1));
                    };
                    if let Some(ended) = self.hear(&event, &orders)? {
                        return Ok(ended);
                    }
                }
                _ = frames.tick() => {}
            }
            screen.draw(&self.state.borrow())?;
        }
    }

    /// Does what a key asks for.
    fn hear(
        &self,
        event: &Event,
        orders: &UnboundedSender<Order>,
    ) -> Result<Option<ViewEnded>, ToolError> {
        let Event::Key(key) = event else {
            return Ok(None);
        };
        let mut state = self.state.borrow_mut();
        let is_typed = !state.entry.is_empty();
        let Some(order) = keys::read(key, is_typed).and_then(|key| state.press(key)) else {
            return Ok(None);
        };
        match order {
            Order::Stop => self.stop.notify_one(),
            Order::Quit => return Ok(Some(ViewEnded::Quit)),
            Order::Interrupt => return Ok(Some(ViewEnded::Signal("Ctrl-C", 2))),
            Order::Record => self
                .recordings
                .borrow_mut()
                .toggle(&self.identity.borrow(), &mut state)?,
            Order::Move(_) | Order::Clear => drop(orders.send(order)),
        }
        Ok(None)
    }

    /// Goes on with the board for as long as it is there, and once it is gone, when it is there again.
    async fn go_on(&self, mut orders: UnboundedReceiver<Order>) -> Result<Infallible, ToolError> {
        loop {
            let board = self.opened().await;
            // What was asked of a board that is gone is not done once it is back.
            while orders.try_recv().is_ok() {}
            let Err(error) = self.attend(&board, &mut orders).await;
            if !self.link.is_gone(&board, &error).await {
                return Err(error);
            }
            self.lose()?;
        }
    }

    /// The board, which where it is gone is looked for until it is there.
    async fn opened(&self) -> Arc<Board> {
        loop {
            match self.link.board().await {
                Ok(board) => return board,
                Err(error) => self.state.borrow_mut().misses(&error),
            }
            sleep(LOOK).await;
        }
    }

    /// Shows and drives one that is there.
    async fn attend(
        &self,
        board: &Arc<Board>,
        orders: &mut UnboundedReceiver<Order>,
    ) -> Result<Infallible, ToolError> {
        let period_ticks = board.period_ticks(self.period)?;
        let status = board.status().await?;
        let mut stream = board.stream(period_ticks, u32::MAX).await?;
        let identity = board.identity().clone();
        self.state
            .borrow_mut()
            .finds(identity.tick_hz, period_ticks, status);
        self.identity.replace(identity);
        let driver = Driver {
            board,
            found: self.link.found(),
            state: self.state,
            stop: &self.stop,
            is_driving: Cell::new(false),
        };
        tokio::select! {
            ended = self.watch(&mut stream) => ended,
            ended = self.look(board) => ended,
            ended = driver.carry_out(orders) => ended,
        }
    }

    /// The board is gone: what is recorded ends with it, for another one's time begins anew.
    fn lose(&self) -> Result<(), OutputError> {
        let mut state = self.state.borrow_mut();
        state.loses();
        self.recordings.borrow_mut().end(&mut state, Some(GONE))
    }

    /// Takes samples for as long as they come.
    async fn watch(&self, stream: &mut Samples) -> Result<Infallible, ToolError> {
        loop {
            let sample = stream.next().await?;
            let mut state = self.state.borrow_mut();
            state.take(&sample);
            if let Some(receiver) = &self.receiver {
                receiver.send(&sample, state.tick_hz);
            }
            if let Some(recorder) = &mut self.recordings.borrow_mut().now {
                recorder.append(&sample)?;
            }
        }
    }

    /// Asks the board now and then how it is.
    async fn look(&self, board: &Board) -> Result<Infallible, ToolError> {
        loop {
            sleep(LOOK).await;
            let status = board.status().await?;
            self.state.borrow_mut().status = status;
        }
    }

    /// Leaves the board: quiet, and with its channels off where this view drove them. Whether it did.
    async fn leave(&self) -> bool {
        let Some(board) = self.link.opened().await else {
            return false;
        };
        let has_driven = self.state.borrow().has_driven;
        // A board that does not answer ramps to zero by itself.
        if has_driven {
            let _ = board.off().await;
        }
        let _ = board.stop_stream().await;
        has_driven
    }
}

/// Measurement files of a view, one after the other.
struct Recordings {
    output: PathBuf,
    now: Option<Recorder>,
    done: Vec<PathBuf>,
}

impl Recordings {
    fn new(output: PathBuf) -> Self {
        Self {
            output,
            now: None,
            done: Vec::new(),
        }
    }

    /// Begins a recording, or ends the one that there is; a file that cannot be written is told.
    fn toggle(&mut self, identity: &Identity, state: &mut State) -> Result<(), OutputError> {
        if self.now.is_some() {
            return self.end(state, None);
        }
        let file = free_name(&self.output);
        let begun =
            NewFile::create(file.clone(), false).and_then(|new| Recorder::begin(identity, new));
        match begun {
            Ok(recorder) => {
                self.now = Some(recorder);
                state.recorded = Some(Recorded { file, samples: 0 });
            }
            Err(error) => state.notice = error.to_string(),
        }
        Ok(())
    }

    /// Ends the recording, if there is one; `partial` says why it is not whole.
    fn end(&mut self, state: &mut State, partial: Option<&str>) -> Result<(), OutputError> {
        if let Some(recorder) = self.now.take() {
            let file = recorder.finish(partial)?;
            state.notice = format!("recorded in {}", file.display());
            state.recorded = None;
            self.done.push(file);
        }
        Ok(())
    }

    /// Ends the recording that there is; returns all files.
    fn finish(mut self) -> Result<Vec<PathBuf>, OutputError> {
        if let Some(recorder) = self.now.take() {
            self.done.push(recorder.finish(None)?);
        }
        Ok(self.done)
    }
}

/// `path`, or the first of `name-2`, `name-3`, ... that is free.
fn free_name(path: &Path) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let numbered = |number: u32| {
        let mut name = format!("{stem}-{number}");
        if let Some(extension) = path.extension() {
            name = format!("{name}.{}", extension.to_string_lossy());
        }
        path.with_file_name(name)
    };
    let mut names = std::iter::once(path.to_owned()).chain((2..).map(numbered));
    names
        .find(|name| !name.exists())
        .unwrap_or_else(|| path.to_owned())
}

impl fmt::Display for Watched {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "watched    {} samples, {} lost",
            self.samples, self.samples_lost
        )?;
        for file in &self.recorded {
            writeln!(f, "recorded   in {}", file.display())?;
        }
        writeln!(f, "outputs    {}", outputs(self.turned_off, self.gone))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_recording_takes_the_next_free_name() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.b.csv");
        assert_eq!(free_name(&path), path);
        for next in ["a.b-2.csv", "a.b-3.csv"] {
            std::fs::write(free_name(&path), "").expect("a file");
            assert_eq!(free_name(&path), folder.path().join(next));
        }
    }
}

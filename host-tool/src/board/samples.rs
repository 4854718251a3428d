//! Waveforms that a board plays, and the samples that it sends.

use std::collections::VecDeque;
use std::time::Duration;

use mirror_protocol::{
    CHUNK_POINTS, LoadPointsEndpoint, Play, PlayEndpoint, Points, Shape, Stream, StreamEndpoint,
    Telemetry, TelemetryBatch, TelemetryTopic,
};
use postcard_rpc::host_client::MultiSubscription;
use quantities::Span;
use tokio::time::timeout;

use super::answer::{ANSWER_TIMEOUT, Request, no_answer};
use super::link::Board;
use crate::error::{BeyondBoard, ToolError};

/// Batches of samples that may wait while the tool does something else.
const QUEUED_BATCHES: usize = 65536;

/// Samples of the board's stream.
pub struct Samples {
    subscription: MultiSubscription<TelemetryBatch>,
    /// What has come, and was not asked for yet.
    arrived: VecDeque<Telemetry>,
    /// Earlier ones belong to an earlier stream, perhaps of another tool.
    first_tick: u32,
    longest_pause: Duration,
    stream: Stream,
    /// So many have come or been lost.
    past: u32,
}

impl Board {
    /// Control ticks in `period`, as far as a stream's period can be.
    ///
    /// # Errors
    /// Where it is less than one tick or more than 65535, or lies between two of them.
    pub fn period_ticks(&self, period: Span) -> Result<u16, ToolError> {
        Ok(period_ticks(period, self.identity().tick_hz)?)
    }

    /// Asks for `count` samples, one every `period_ticks` control ticks.
    ///
    /// # Errors
    /// Where the board does not answer, or refuses.
    pub async fn stream(&self, period_ticks: u16, count: u32) -> Result<Samples, ToolError> {
        let request = "send samples";
        let subscription = self.subscribe(request).await?;
        let stream = Stream {
            period_ticks,
            count,
            ..Stream::default()
        };
        let reply = self.ask::<StreamEndpoint>(request, &stream).await?;
        let first_tick = self.granted(request, reply)?.first_tick;
        let period = Duration::from_secs_f64(self.span(0, period_ticks.into()).s);
        Ok(Samples {
            subscription,
            arrived: VecDeque::new(),
            first_tick,
            longest_pause: period,
            stream,
            past: 0,
        })
    }

    /// What comes of `count` samples, one every `period_ticks` control ticks, with at least one: a few may be lost on the way.
    ///
    /// # Errors
    /// Where the board does not answer, or refuses, or no sample comes in time.
    pub async fn samples(
        &self,
        period_ticks: u16,
        count: u32,
    ) -> Result<Vec<Telemetry>, ToolError> {
        let mut stream = self.stream(period_ticks, count).await?;
        let mut samples = Vec::new();
        while let Some(sample) = stream.next_of_all().await? {
            samples.push(sample);
        }
        Ok(samples)
    }

    /// Puts points into the board's table, in shares of a waveform's amplitude.
    ///
    /// # Errors
    /// Where the board does not answer, or has no room for them.
    pub async fn load_points(&self, points: &[i16]) -> Result<(), ToolError> {
        let request = "take the points of a waveform";
        for (index, chunk) in points.chunks(CHUNK_POINTS).enumerate() {
            let message = Points {
                first: (index * CHUNK_POINTS) as u16,
                points: chunk.iter().copied().collect(),
            };
            let reply = self.ask::<LoadPointsEndpoint>(request, &message).await?;
            self.granted(request, reply)?;
        }
        Ok(())
    }

    /// Plays a waveform, and returns its samples with the first tick in which it is driven.
    ///
    /// # Errors
    /// Where the board does not answer, or refuses.
    pub async fn play(&self, play: &Play) -> Result<(Samples, u32), ToolError> {
        let request = "play a waveform";
        let subscription = self.subscribe(request).await?;
        let reply = self.ask::<PlayEndpoint>(request, play).await?;
        let first_tick = self.granted(request, reply)?.first_tick;
        let samples = Samples {
            subscription,
            arrived: VecDeque::new(),
            first_tick,
            longest_pause: self.longest_pause(play),
            stream: play.stream,
            past: 0,
        };
        Ok((samples, first_tick.wrapping_add(1)))
    }

    /// Longest time between two samples: a stream that slows down reaches that part of the whole.
    fn longest_pause(&self, play: &Play) -> Duration {
        let period = self.span(0, play.stream.period_ticks.into()).s;
        let slowed = match (play.stream.slowing, play.waveform.shape) {
            (0, _) => 0.0,
            (slowing, Shape::Steps(table)) => {
                self.span(0, table.dwell_ticks).s * f64::from(table.points) / f64::from(slowing)
            }
            (_, _) => 0.0,
        };
        Duration::from_secs_f64(period.max(slowed))
    }

    async fn subscribe(
        &self,
        request: Request,
    ) -> Result<MultiSubscription<TelemetryBatch>, ToolError> {
        let subscribed = self
            .client()
            .subscribe_multi::<TelemetryTopic>(QUEUED_BATCHES)
            .await;
        subscribed.map_err(|_| ToolError::LinkLost { request })
    }

    /// Ends the stream.
    ///
    /// # Errors
    /// Where the board does not answer, or refuses.
    pub async fn stop_stream(&self) -> Result<(), ToolError> {
        self.stream(1, 0).await.map(drop)
    }
}

impl Samples {
    /// The next of those that were asked for, with nothing in the place of any that the link was too slow for; `None` once the
    /// last has come, or is waited for in vain.
    ///
    /// # Errors
    /// Where not one comes in time, or the link is lost.
    pub async fn next_of_all(&mut self) -> Result<Option<Telemetry>, ToolError> {
        if self.past >= self.stream.count {
            return Ok(None);
        }
        match self.next().await {
            Err(ToolError::NoAnswer { .. }) if self.past > 0 => {
                self.past = self.stream.count;
                Ok(None)
            }
            next => {
                let sample = next?;
                let ticks = sample.tick.wrapping_sub(self.first_tick);
                self.past = past(&self.stream, ticks, self.past);
                Ok(Some(sample))
            }
        }
    }

    /// The next sample.
    ///
    /// # Errors
    /// Where none comes in time, or the link is lost.
    pub async fn next(&mut self) -> Result<Telemetry, ToolError> {
        let request = "send samples";
        let limit = self.longest_pause + ANSWER_TIMEOUT;
        loop {
            while let Some(sample) = self.arrived.pop_front() {
                // Ticks wrap, so later means less than half a turn ahead.
                if sample.tick.wrapping_sub(self.first_tick) < u32::MAX / 2 {
                    return Ok(sample);
                }
            }
            match timeout(limit, self.subscription.recv()).await {
                Ok(Ok(batch)) => self.arrived.extend(batch),
                Ok(Err(_)) => return Err(ToolError::LinkLost { request }),
                Err(_) => return Err(no_answer(request, limit)),
            }
        }
    }
}

/// A period that is so near to whole ticks, as a part of it, is they: what decimals and their arithmetic leave.
const WHOLE: f64 = 1e-6;

fn period_ticks(period: Span, tick_hz: u32) -> Result<u16, BeyondBoard> {
    let span = |ticks: f64| Span {
        s: ticks / f64::from(tick_hz),
    };
    let ticks = period.s * f64::from(tick_hz);
    let whole = ticks.round();
    let is_whole = (ticks - whole).abs() <= WHOLE * whole;
    let longest = f64::from(u16::MAX);
    match ticks {
        _ if is_whole && (1.0..=longest).contains(&whole) => Ok(whole as u16),
        ticks if (1.0..=longest).contains(&ticks) => Err(BeyondBoard::PartOfTick {
            asked: period,
            tick: span(1.0),
            shorter: span(ticks.floor()),
            longer: span(ticks.ceil()),
        }),
        _ => Err(BeyondBoard::Period {
            asked: period,
            tick: span(1.0),
            longest: span(longest),
        }),
    }
}

/// How many of a stream's samples have come or been lost with the one that is so many ticks after its first, where `before` had
/// until then. When those of a stream that slows down were due is not known here: it counts those that come.
fn past(stream: &Stream, ticks: u32, before: u32) -> u32 {
    match stream.slowing {
        0 => ticks / u32::from(stream.period_ticks.max(1)) + 1,
        _ => before + 1,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_period_is_whole_ticks_or_the_two_next_to_it_are_named() {
        let ticks = |s: f64| period_ticks(Span { s }, 10_000);
        for whole in 1..=u16::MAX {
            let decimal: f64 = format!("{:.1}e-3", 0.1 * f64::from(whole)).parse().unwrap();
            assert_eq!(ticks(decimal).ok(), Some(whole), "{decimal}");
        }
        for (asked, nearest) in [
            (0.15e-3, "0.0001 s or 0.0002 s"),
            (0.25e-3, "0.0002 s or 0.0003 s"),
            (1.0001e-3, "0.001 s or 0.0011 s"),
            (6.55345, "6.5534 s or 6.5535 s"),
        ] {
            let refused = ticks(asked).expect_err("no whole ticks");
            let help = miette::Diagnostic::help(&refused).expect("what to do");
            assert_eq!(help.to_string(), format!("ask for {nearest}"));
        }
        for beyond in [0.0, 0.05e-3, 0.099e-3, 6.55355, f64::INFINITY, f64::NAN] {
            let refused = ticks(beyond).expect_err("out of range");
            assert!(matches!(refused, BeyondBoard::Period { .. }), "{refused}");
        }
    }

    #[test]
    fn samples_that_are_lost_are_past_with_the_next_that_comes() {
        let even = Stream {
            period_ticks: 3,
            count: 10,
            ..Stream::default()
        };
        assert_eq!(past(&even, 0, 0), 1);
        assert_eq!(past(&even, 12, 1), 5, "three of them lost");
        assert_eq!(past(&even, 27, 5), 10, "the last");
        let slowing = Stream {
            slowing: 20,
            ..even
        };
        assert_eq!(past(&slowing, 300, 5), 6);
    }
}

//! Waveforms that a board plays, and the samples that it sends.

use std::time::Duration;

use mirror_protocol::{
    CHUNK_POINTS, LoadPointsEndpoint, Play, PlayEndpoint, Points, Shape, Stream, StreamEndpoint,
    Telemetry, TelemetryTopic,
};
use postcard_rpc::host_client::MultiSubscription;
use tokio::time::timeout;

use super::link::{ANSWER_TIMEOUT, Board, Request, no_answer};
use crate::error::ToolError;
use crate::quantity::Span;

/// Samples that may wait while the tool does something else.
const QUEUED_SAMPLES: usize = 65536;

/// Samples of the board's stream.
pub struct Samples {
    subscription: MultiSubscription<Telemetry>,
    /// Earlier ones belong to an earlier stream, perhaps of another tool.
    first_tick: u32,
    period: Duration,
}

impl Board {
    /// Control ticks in `period`, rounded, as far as a stream's period can be.
    ///
    /// # Errors
    /// Where it is less than one tick, or more than 65535.
    pub fn period_ticks(&self, period: Span) -> Result<u16, ToolError> {
        let ticks = (period.s * f64::from(self.identity().tick_hz)).round();
        if (1.0..=f64::from(u16::MAX)).contains(&ticks) {
            Ok(ticks as u16)
        } else {
            let (tick, longest) = (self.span(0, 1), self.span(0, u16::MAX.into()));
            Err(ToolError::Period {
                asked: period,
                tick,
                longest,
            })
        }
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
            first_tick,
            period,
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
        let length_ticks = count.saturating_sub(1) * u32::from(period_ticks);
        let mut samples = Vec::new();
        loop {
            let sample = match stream.next().await {
                Err(ToolError::NoAnswer { .. }) if !samples.is_empty() => return Ok(samples),
                next => next?,
            };
            samples.push(sample);
            if sample.tick.wrapping_sub(stream.first_tick) >= length_ticks {
                return Ok(samples);
            }
        }
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
            first_tick,
            period: self.longest_pause(play),
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

    async fn subscribe(&self, request: Request) -> Result<MultiSubscription<Telemetry>, ToolError> {
        let subscribed = self
            .client()
            .subscribe_multi::<TelemetryTopic>(QUEUED_SAMPLES)
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
    /// The next sample.
    ///
    /// # Errors
    /// Where none comes in time, or the link is lost.
    pub async fn next(&mut self) -> Result<Telemetry, ToolError> {
        let request = "send samples";
        let limit = self.period + ANSWER_TIMEOUT;
        loop {
            let sample = match timeout(limit, self.subscription.recv()).await {
                Ok(Ok(sample)) => sample,
                Ok(Err(_)) => return Err(ToolError::LinkLost { request }),
                Err(_) => return Err(no_answer(request, limit)),
            };
            // Ticks wrap, so later means less than half a turn ahead.
            if sample.tick.wrapping_sub(self.first_tick) < u32::MAX / 2 {
                return Ok(sample);
            }
        }
    }
}

//! An open board: requests with time-outs, and samples.

use std::convert::Infallible;
use std::time::Duration;

use control_core::Calibration;
use mirror_protocol::{
    CHUNK_POINTS, CalibrationChunk, CalibrationEndpoint, CalibrationInfo, CalibrationRefusal,
    CalibrationUseEndpoint, CalibrationWriteEndpoint, Chunk, ClearEndpoint, CommandReply,
    Commanded, Drives, ERROR_PATH, EnterBootloaderEndpoint, Hello, HelloEndpoint, Identity,
    LoadPointsEndpoint, OffEndpoint, PROTOCOL_VERSION, Play, PlayEndpoint, Points, Position,
    Refusal, RenewEndpoint, Renewal, Sense, SenseEndpoint, SenseInfo, SetDriveEndpoint,
    SetPositionEndpoint, SetSenseEndpoint, Shape, Status, StatusEndpoint, Stream, StreamEndpoint,
    Telemetry, TelemetryTopic, WireError,
};
use postcard_rpc::Endpoint;
use postcard_rpc::header::VarSeqKind;
use postcard_rpc::host_client::{HostClient, HostErr, MultiSubscription, WireSpawn};
use postcard_rpc::postcard_schema::Schema;
use serde::Serialize;
use serde::de::DeserializeOwned;
use tokio::time::{sleep, timeout};

use super::find::{Found, Place, is_driver_board};
use super::socket;
use crate::error::ToolError;
use crate::quantity::Span;

/// A board answers within a control tick and the link's time; this is for busy machines.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(3);

/// What a tool that renews all the time asks for. When it dies, the board ramps to zero after this.
pub const RENEWED_LEASE: Duration = Duration::from_millis(100);

/// Requests under way.
const QUEUED_REQUESTS: usize = 8;
/// Samples that may wait while the tool does something else.
const QUEUED_SAMPLES: usize = 65536;

/// An open board.
#[derive(Debug)]
pub struct Board {
    client: HostClient<WireError>,
    identity: Identity,
}

/// Samples of the board's stream.
pub struct Samples {
    subscription: MultiSubscription<Telemetry>,
    /// Earlier ones belong to an earlier stream, perhaps of another tool.
    first_tick: u32,
    period: Duration,
}

/// What a board can be asked, as an error message says it.
type Request = &'static str;

impl Board {
    /// Opens and greets a board.
    ///
    /// # Errors
    /// Where it cannot be reached, does not answer, or speaks another protocol version.
    pub async fn open(found: &Found) -> Result<Self, ToolError> {
        let cannot_open = |reason: String| ToolError::Open {
            board: found.name.clone(),
            reason,
        };
        let client = match &found.place {
            Place::Usb { serial } => HostClient::try_new_raw_nusb(
                |device| is_driver_board(device) && device.serial_number() == Some(serial),
                ERROR_PATH,
                QUEUED_REQUESTS,
                VarSeqKind::Seq2,
            )
            .map_err(cannot_open)?,
            Place::Socket { path } => {
                let wire = timeout(ANSWER_TIMEOUT, socket::connect(path)).await;
                let (tx, rx) = wire
                    .map_err(|_| no_answer("connect", ANSWER_TIMEOUT))?
                    .map_err(|error| cannot_open(error.to_string()))?;
                let sequence = VarSeqKind::Seq2;
                HostClient::new_with_wire(tx, rx, Tasks, sequence, ERROR_PATH, QUEUED_REQUESTS)
            }
        };
        let hello = Hello {
            protocol_version: PROTOCOL_VERSION,
        };
        let identity = ask::<HelloEndpoint>(&client, "introduce itself", &hello).await?;
        if identity.protocol_version == PROTOCOL_VERSION {
            Ok(Self { client, identity })
        } else {
            Err(ToolError::ProtocolVersion {
                board: identity.protocol_version,
            })
        }
    }

    /// Who the board is.
    pub fn identity(&self) -> &Identity {
        &self.identity
    }

    /// What the board is doing.
    ///
    /// # Errors
    /// Where it does not answer, or refuses.
    pub async fn status(&self) -> Result<Status, ToolError> {
        let request = "tell its status";
        self.granted(
            request,
            ask::<StatusEndpoint>(&self.client, request, &()).await?,
        )
    }

    /// Moves the mirror.
    ///
    /// # Errors
    /// Where the board does not answer, or refuses.
    pub async fn set_position(&self, position: Position) -> Result<Commanded, ToolError> {
        self.command::<SetPositionEndpoint>("move the mirror", &position)
            .await
    }

    /// Drives the actuators.
    ///
    /// # Errors
    /// Where the board does not answer, or refuses.
    pub async fn set_drive(&self, drives: Drives) -> Result<Commanded, ToolError> {
        self.command::<SetDriveEndpoint>("drive the actuators", &drives)
            .await
    }

    /// Turns all channels off.
    ///
    /// # Errors
    /// Where the board does not answer, or refuses.
    pub async fn off(&self) -> Result<Commanded, ToolError> {
        self.command::<OffEndpoint>("turn its channels off", &())
            .await
    }

    /// Has the board turn its channels off and leave for its bootloader.
    ///
    /// # Errors
    /// Where the board does not answer, or refuses.
    pub async fn enter_bootloader(&self) -> Result<(), ToolError> {
        let request = "leave for its bootloader";
        let reply = ask::<EnterBootloaderEndpoint>(&self.client, request, &()).await?;
        self.granted(request, reply)
    }

    /// Lets the board forget its faults.
    ///
    /// # Errors
    /// Where the board does not answer, or refuses.
    pub async fn clear(&self) -> Result<Commanded, ToolError> {
        self.command::<ClearEndpoint>("forget its faults", &())
            .await
    }

    /// Asks the board to go on with what it drives for another [`RENEWED_LEASE`].
    ///
    /// # Errors
    /// Where the board does not answer, or drives nothing.
    pub async fn renew(&self) -> Result<Commanded, ToolError> {
        let renewal = Renewal {
            lease_ms: RENEWED_LEASE.as_millis() as u32,
        };
        self.command::<RenewEndpoint>("go on", &renewal).await
    }

    /// Renews for as long as it is polled, whether anything is driven or not.
    ///
    /// # Errors
    /// Where the board does not answer, or has tripped.
    pub async fn keep_renewing(&self) -> Result<Infallible, ToolError> {
        // The time of an emulated board runs several times faster.
        let often = if self.identity.is_emulated { 20 } else { 4 };
        loop {
            match self.renew().await {
                Err(ToolError::Refused {
                    refusal: Refusal::NoLease,
                    ..
                })
                | Ok(_) => sleep(RENEWED_LEASE / often).await,
                Err(error) => return Err(error),
            }
        }
    }

    /// The calibration in use.
    ///
    /// # Errors
    /// Where the board does not answer, or refuses.
    pub async fn calibration(&self) -> Result<CalibrationInfo, ToolError> {
        let request = "tell its calibration";
        let reply = ask::<CalibrationEndpoint>(&self.client, request, &()).await?;
        self.granted(request, reply)
    }

    /// Uploads `calibration` and has the board use it, which turns all channels off.
    ///
    /// # Errors
    /// Where the board does not answer, or keeps the one that it has.
    pub async fn use_calibration(
        &self,
        calibration: &Calibration,
    ) -> Result<CalibrationInfo, ToolError> {
        let request = "take a calibration";
        let mut offset = 0;
        for piece in calibration.to_bytes().chunks(Chunk::new().capacity()) {
            let chunk = CalibrationChunk {
                offset,
                bytes: Chunk::from_slice(piece).unwrap_or_default(),
            };
            let reply = ask::<CalibrationWriteEndpoint>(&self.client, request, &chunk).await?;
            self.granted(request, reply)?;
            offset += piece.len() as u16;
        }
        let reply = ask::<CalibrationUseEndpoint>(&self.client, request, &()).await?;
        reply.map_err(|refusal| match refusal {
            CalibrationRefusal::Refused(refusal) => ToolError::Refused { request, refusal },
            CalibrationRefusal::Unusable(reason) => ToolError::CalibrationRefused {
                reason: reason.as_str().to_owned(),
            },
        })
    }

    /// What the current sense is taken to be off by.
    ///
    /// # Errors
    /// Where the board does not answer, or refuses.
    pub async fn sense(&self) -> Result<SenseInfo, ToolError> {
        let request = "tell its current sense";
        let reply = ask::<SenseEndpoint>(&self.client, request, &()).await?;
        self.granted(request, reply)
    }

    /// Has the board correct its current sense by `sense`, which turns all channels off.
    ///
    /// # Errors
    /// Where the board does not answer, or refuses.
    pub async fn set_sense(&self, sense: &Sense) -> Result<SenseInfo, ToolError> {
        let request = "correct its current sense";
        let reply = ask::<SetSenseEndpoint>(&self.client, request, sense).await?;
        self.granted(request, reply)
    }

    /// Control ticks in `period`, rounded, as far as a stream's period can be.
    ///
    /// # Errors
    /// Where it is less than one tick, or more than 65535.
    pub fn period_ticks(&self, period: Span) -> Result<u16, ToolError> {
        let ticks = (period.s * f64::from(self.identity.tick_hz)).round();
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
        let reply = ask::<StreamEndpoint>(&self.client, request, &stream).await?;
        let first_tick = self.granted(request, reply)?.first_tick;
        let period = Duration::from_secs_f64(self.span(0, period_ticks.into()).s);
        Ok(Samples {
            subscription,
            first_tick,
            period,
        })
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
            let reply = ask::<LoadPointsEndpoint>(&self.client, request, &message).await?;
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
        let reply = ask::<PlayEndpoint>(&self.client, request, play).await?;
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
            .client
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

    /// The board's time from one control tick to a later one.
    pub fn span(&self, from_tick: u32, to_tick: u32) -> Span {
        let ticks = to_tick.wrapping_sub(from_tick);
        Span {
            s: f64::from(ticks) / f64::from(self.identity.tick_hz),
        }
    }

    /// Waits until the board's own time is `span` past the control tick `tick`.
    ///
    /// # Errors
    /// Where the board does not answer, or its time stands still.
    pub async fn wait(&self, tick: u32, span: Span) -> Result<(), ToolError> {
        let ticks = (span.s * f64::from(self.identity.tick_hz)).round() as u32;
        let mut passed = 0;
        let mut last_progress = tokio::time::Instant::now();
        while passed < ticks {
            let now = self.status().await?.telemetry.tick.wrapping_sub(tick);
            if now != passed {
                (passed, last_progress) = (now, tokio::time::Instant::now());
            } else if last_progress.elapsed() > ANSWER_TIMEOUT {
                return Err(ToolError::ControlStopped);
            }
            sleep(Duration::from_millis(20)).await;
        }
        Ok(())
    }

    async fn command<E>(
        &self,
        request: Request,
        message: &E::Request,
    ) -> Result<Commanded, ToolError>
    where
        E: Endpoint<Response = CommandReply>,
        E::Request: Serialize + Schema,
    {
        self.granted(request, ask::<E>(&self.client, request, message).await?)
    }

    fn granted<T>(&self, request: Request, reply: Result<T, Refusal>) -> Result<T, ToolError> {
        reply.map_err(|refusal| ToolError::Refused { request, refusal })
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

async fn ask<E>(
    client: &HostClient<WireError>,
    request: Request,
    message: &E::Request,
) -> Result<E::Response, ToolError>
where
    E: Endpoint,
    E::Request: Serialize + Schema,
    E::Response: DeserializeOwned + Schema,
{
    let answer = timeout(ANSWER_TIMEOUT, client.send_resp::<E>(message)).await;
    answer
        .map_err(|_| no_answer(request, ANSWER_TIMEOUT))?
        .map_err(|error| match error {
            HostErr::Closed => ToolError::LinkLost { request },
            HostErr::Wire(error) => ToolError::NotUnderstood {
                request,
                detail: format!("{error:?}"),
            },
            other => ToolError::NotUnderstood {
                request,
                detail: other.to_string(),
            },
        })
}

fn no_answer(request: Request, limit: Duration) -> ToolError {
    ToolError::NoAnswer {
        request,
        seconds: limit.as_secs_f64(),
    }
}

/// Runs the client's tasks on this tool's runtime.
struct Tasks;

impl WireSpawn for Tasks {
    fn spawn(&mut self, task: impl Future<Output = ()> + Send + 'static) {
        drop(tokio::spawn(task));
    }
}

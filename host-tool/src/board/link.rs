//! An open board: requests with time-outs, and samples.

use std::time::Duration;

use mirror_protocol::{
    CommandReply, Commanded, Drives, ERROR_PATH, Hello, HelloEndpoint, Identity, OffEndpoint,
    PROTOCOL_VERSION, Position, Refusal, SetDriveEndpoint, SetPositionEndpoint, Status,
    StatusEndpoint, Stream, StreamEndpoint, Telemetry, TelemetryTopic, WireError,
};
use postcard_rpc::Endpoint;
use postcard_rpc::header::VarSeqKind;
use postcard_rpc::host_client::{HostClient, HostErr, MultiSubscription, WireSpawn};
use postcard_rpc::postcard_schema::Schema;
use serde::Serialize;
use serde::de::DeserializeOwned;
use tokio::time::{sleep, timeout};

use super::find::{Found, Place};
use super::socket;
use crate::error::ToolError;
use crate::quantity::Span;

/// A board answers within a control tick and the link's time; this is for busy machines.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(3);

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
                |device| device.serial_number() == Some(serial),
                ERROR_PATH,
                QUEUED_REQUESTS,
                VarSeqKind::Seq2,
            )
            .map_err(cannot_open)?,
            Place::Socket { path } => {
                let wire = socket::connect(path).await;
                let (tx, rx) = wire.map_err(|error| cannot_open(error.to_string()))?;
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

    /// Asks for `count` samples, one every `period`, which is rounded to control ticks.
    ///
    /// # Errors
    /// Where the board does not answer, or refuses.
    pub async fn stream(&self, period: Span, count: u32) -> Result<Samples, ToolError> {
        let request = "send samples";
        let subscription = self
            .client
            .subscribe_multi::<TelemetryTopic>(QUEUED_SAMPLES)
            .await
            .map_err(|_| ToolError::LinkLost { request })?;
        let ticks = (period.s * f64::from(self.identity.tick_hz)).round();
        let stream = Stream {
            period_ticks: ticks.clamp(1.0, 65535.0) as u16,
            count,
        };
        self.granted(
            request,
            ask::<StreamEndpoint>(&self.client, request, &stream).await?,
        )?;
        Ok(Samples { subscription })
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
        match timeout(ANSWER_TIMEOUT, self.subscription.recv()).await {
            Ok(Ok(sample)) => Ok(sample),
            Ok(Err(_)) => Err(ToolError::LinkLost { request }),
            Err(_) => Err(no_answer(request)),
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
        .map_err(|_| no_answer(request))?
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

fn no_answer(request: Request) -> ToolError {
    ToolError::NoAnswer {
        request,
        seconds: ANSWER_TIMEOUT.as_secs_f64(),
    }
}

/// Runs the client's tasks on this tool's runtime.
struct Tasks;

impl WireSpawn for Tasks {
    fn spawn(&mut self, task: impl Future<Output = ()> + Send + 'static) {
        drop(tokio::spawn(task));
    }
}

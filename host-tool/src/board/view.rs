//! What can be read of a board: requests with time-outs that change nothing.

use std::path::Path;
use std::time::Instant;

use mirror_protocol::{
    ERROR_PATH, Hello, HelloEndpoint, Identity, PROTOCOL_VERSION, Refusal, Status, StatusEndpoint,
    WireError,
};
use postcard_rpc::Endpoint;
use postcard_rpc::header::VarSeqKind;
use postcard_rpc::host_client::{HostClient, HostErr, WireSpawn};
use postcard_rpc::postcard_schema::Schema;
use serde::Serialize;
use serde::de::DeserializeOwned;
use tokio::time::timeout;

use super::answer::{ANSWER_TIMEOUT, Request, no_answer};
use super::find::{Found, Place, is_driver_board};
use super::socket;
use crate::error::ToolError;
use crate::verbosity::detail;

/// Requests under way.
const QUEUED_REQUESTS: usize = 8;

/// A board that was greeted, and can be read.
#[derive(Debug)]
pub struct View {
    link: Link,
    identity: Identity,
}

/// A link to a board, closed when nobody has it any more: the tasks that carry it would go on otherwise, and it would stay open.
#[derive(Debug)]
struct Link(HostClient<WireError>);

impl Drop for Link {
    fn drop(&mut self) {
        self.0.close();
    }
}

impl View {
    /// Connects to a board and greets it.
    ///
    /// # Errors
    /// Where it cannot be reached, does not answer, or speaks another protocol version.
    pub(super) async fn greet(found: &Found) -> Result<Self, ToolError> {
        let client = match &found.place {
            Place::Usb { serial } => HostClient::try_new_raw_nusb(
                |device| is_driver_board(device) && device.serial_number() == Some(serial),
                ERROR_PATH,
                QUEUED_REQUESTS,
                VarSeqKind::Seq2,
            )
            .map_err(|reason| cannot_open(found, reason))?,
            Place::Socket { path } => on_socket(found, path).await?,
        };
        Self::introduced(Link(client)).await
    }

    /// The same, on a socket on which somebody answers in the board's place.
    ///
    /// # Errors
    /// As of [`Self::greet`].
    pub(super) async fn greet_stand_in(found: &Found, socket: &Path) -> Result<Self, ToolError> {
        Self::introduced(Link(on_socket(found, socket).await?)).await
    }

    async fn introduced(link: Link) -> Result<Self, ToolError> {
        let identity = introduce(&link.0).await?;
        if identity.protocol_version == PROTOCOL_VERSION {
            Ok(Self { link, identity })
        } else {
            Err(ToolError::ProtocolVersion {
                board: identity.protocol_version,
            })
        }
    }

    /// Greets once more.
    pub(super) async fn introduce(&self) -> Result<Identity, ToolError> {
        introduce(self.client()).await
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
        self.granted(request, self.ask::<StatusEndpoint>(request, &()).await?)
    }

    pub(super) fn client(&self) -> &HostClient<WireError> {
        &self.link.0
    }

    pub(super) async fn ask<E>(
        &self,
        request: Request,
        message: &E::Request,
    ) -> Result<E::Response, ToolError>
    where
        E: Endpoint,
        E::Request: Serialize + Schema,
        E::Response: DeserializeOwned + Schema,
    {
        ask::<E>(self.client(), request, message).await
    }

    pub(super) fn granted<T>(
        &self,
        request: Request,
        reply: Result<T, Refusal>,
    ) -> Result<T, ToolError> {
        reply.map_err(|refusal| ToolError::Refused { request, refusal })
    }
}

fn cannot_open(found: &Found, reason: String) -> ToolError {
    ToolError::Open {
        board: found.name.clone(),
        reason,
    }
}

/// A client of who listens on a socket.
async fn on_socket(found: &Found, path: &Path) -> Result<HostClient<WireError>, ToolError> {
    let wire = timeout(ANSWER_TIMEOUT, socket::connect(path)).await;
    let (tx, rx) = wire
        .map_err(|_| no_answer("connect", ANSWER_TIMEOUT))?
        .map_err(|error| cannot_open(found, error.to_string()))?;
    let sequence = VarSeqKind::Seq2;
    Ok(HostClient::new_with_wire(
        tx,
        rx,
        Tasks,
        sequence,
        ERROR_PATH,
        QUEUED_REQUESTS,
    ))
}

async fn introduce(client: &HostClient<WireError>) -> Result<Identity, ToolError> {
    let hello = Hello {
        protocol_version: PROTOCOL_VERSION,
    };
    ask::<HelloEndpoint>(client, "introduce itself", &hello).await
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
    let begun = Instant::now();
    let answer = timeout(ANSWER_TIMEOUT, client.send_resp::<E>(message)).await;
    let took_ms = 1e3 * begun.elapsed().as_secs_f64();
    detail(format_args!("{}: {took_ms:.1} ms", E::PATH));
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

/// Runs the client's tasks on this tool's runtime.
struct Tasks;

impl WireSpawn for Tasks {
    fn spawn(&mut self, task: impl Future<Output = ()> + Send + 'static) {
        drop(tokio::spawn(task));
    }
}

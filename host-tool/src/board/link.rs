//! An open board: requests with time-outs.

use std::convert::Infallible;
use std::time::{Duration, Instant};

use board_sockets::{Untrusted, check_socket};
use mirror_protocol::{
    ClearEndpoint, CommandReply, Commanded, Compensate, CompensateEndpoint, Drives, ERROR_PATH,
    EnterBootloaderEndpoint, Hello, HelloEndpoint, Identity, OffEndpoint, PROTOCOL_VERSION,
    Position, Refusal, RenewEndpoint, Renewal, SetDriveEndpoint, SetPose, SetPoseEndpoint,
    SetPositionEndpoint, Status, StatusEndpoint, WireError,
};
use postcard_rpc::Endpoint;
use postcard_rpc::header::VarSeqKind;
use postcard_rpc::host_client::{HostClient, HostErr, WireSpawn};
use postcard_rpc::postcard_schema::Schema;
use serde::Serialize;
use serde::de::DeserializeOwned;
use tokio::time::{sleep, timeout};

use super::answer::{ANSWER_TIMEOUT, Request, no_answer};
use super::claim::{Claim, Claimed, in_use};
use super::find::{Found, Place, is_driver_board};
use super::owner::Owner;
use super::socket;
use super::stop_mark::StopMark;
use crate::error::ToolError;
use crate::verbosity::detail;

/// What a tool that renews all the time asks for. When it dies, the board ramps to zero after this.
const RENEWED_LEASE: Duration = Duration::from_millis(100);
/// The same as it is asked for (ms).
pub const RENEWED_LEASE_MS: u32 = RENEWED_LEASE.as_millis() as u32;

/// Requests under way.
const QUEUED_REQUESTS: usize = 8;

/// An open board.
#[derive(Debug)]
pub struct Board {
    client: HostClient<WireError>,
    identity: Identity,
    claim: Option<Claim>,
}

/// A board that was looked at.
#[derive(Debug)]
pub enum Seen {
    /// It answers, and is this process's own until it is dropped.
    Open(Box<Board>),
    /// Another process has it.
    InUse(Owner),
}

impl Board {
    /// Opens and greets a board, which is this process's own until it is dropped. Where another has it, that is said on
    /// standard error, and waited for.
    ///
    /// # Errors
    /// Where another does not let go of it or stops it meanwhile, it cannot be reached or trusted, does not answer, or
    /// speaks another protocol version.
    pub async fn open(found: &Found) -> Result<Self, ToolError> {
        check_place(found)?;
        let mark = StopMark::read(found);
        let claim = Claim::take(found, &mark).await?;
        let board = Self::greet(found, claim).await?;
        mark.check(found)?;
        Ok(board)
    }

    /// Opens a board to ask it something, and waits for nobody who has it for longer than a moment.
    ///
    /// # Errors
    /// As of [`Self::open`]; where another has it who does not say who it is.
    pub async fn look(found: &Found) -> Result<Seen, ToolError> {
        check_place(found)?;
        match Claim::at_a_glance(found).await {
            Claimed::Ours(claim) => Ok(Seen::Open(Box::new(Self::greet(found, claim).await?))),
            Claimed::Anothers(Some(owner)) => Ok(Seen::InUse(owner)),
            Claimed::Anothers(None) => Err(in_use(found, None)),
        }
    }

    /// Opens a board for good where nobody else has it for longer than a moment.
    ///
    /// # Errors
    /// As of [`Self::open`], at once.
    pub async fn open_if_free(found: &Found) -> Result<Self, ToolError> {
        let mark = StopMark::read(found);
        match Self::look(found).await? {
            Seen::Open(board) => {
                mark.check(found)?;
                Ok(*board)
            }
            Seen::InUse(owner) => Err(in_use(found, Some(&owner))),
        }
    }

    async fn greet(found: &Found, claim: Option<Claim>) -> Result<Self, ToolError> {
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
        let identity = introduce(&client).await?;
        if identity.protocol_version == PROTOCOL_VERSION {
            Ok(Self {
                client,
                identity,
                claim,
            })
        } else {
            Err(ToolError::ProtocolVersion {
                board: identity.protocol_version,
            })
        }
    }

    /// Greets the board once more, after which it can be driven again although it was stopped.
    ///
    /// # Errors
    /// Where it does not answer.
    pub async fn greet_again(&self) -> Result<(), ToolError> {
        introduce(&self.client).await.map(drop)
    }

    /// Who the board is.
    pub fn identity(&self) -> &Identity {
        &self.identity
    }

    /// Who had the board when it was opened, and was waited for.
    pub fn waited_for(&self) -> Option<&Owner> {
        self.claim.as_ref()?.before.as_ref()
    }

    /// What the board is doing.
    ///
    /// # Errors
    /// Where it does not answer, or refuses.
    pub async fn status(&self) -> Result<Status, ToolError> {
        let request = "tell its status";
        self.granted(request, self.ask::<StatusEndpoint>(request, &()).await?)
    }

    /// Moves the mirror.
    ///
    /// # Errors
    /// Where the board does not answer, or refuses.
    pub async fn set_position(&self, position: Position) -> Result<Commanded, ToolError> {
        self.command::<SetPositionEndpoint>("move the mirror", &position)
            .await
    }

    /// Has positions compensated for the surroundings, or not.
    ///
    /// # Errors
    /// Where the board does not answer, or refuses.
    pub async fn compensate(&self, wanted: Compensate) -> Result<Commanded, ToolError> {
        self.command::<CompensateEndpoint>("compensate its surroundings", &wanted)
            .await
    }

    /// Moves the mirror to a pose.
    ///
    /// # Errors
    /// Where the board does not answer, or refuses.
    pub async fn set_pose(&self, pose: SetPose) -> Result<Commanded, ToolError> {
        self.command::<SetPoseEndpoint>("move the mirror", &pose)
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
        let reply = self.ask::<EnterBootloaderEndpoint>(request, &()).await?;
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
            lease_ms: RENEWED_LEASE_MS,
        };
        self.command::<RenewEndpoint>("go on", &renewal).await
    }

    /// Renews for as long as it is polled, whether anything is driven or not. Only for who drives, and has ended what
    /// others drove before: a lease is its taker's to renew.
    ///
    /// # Errors
    /// Where the board does not answer, or has tripped.
    pub async fn keep_renewing(&self) -> Result<Infallible, ToolError> {
        loop {
            match self.renew().await {
                Err(ToolError::Refused {
                    refusal: Refusal::NoLease,
                    ..
                })
                | Ok(_) => sleep(self.renewal_period()).await,
                Err(error) => return Err(error),
            }
        }
    }

    /// From one renewal of a [`RENEWED_LEASE`] to the next. The time of an emulated board runs several times faster.
    pub fn renewal_period(&self) -> Duration {
        let often = if self.identity.is_emulated { 20 } else { 4 };
        RENEWED_LEASE / often
    }

    pub(super) fn client(&self) -> &HostClient<WireError> {
        &self.client
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
        ask::<E>(&self.client, request, message).await
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
        self.granted(request, self.ask::<E>(request, message).await?)
    }

    pub(super) fn granted<T>(
        &self,
        request: Request,
        reply: Result<T, Refusal>,
    ) -> Result<T, ToolError> {
        reply.map_err(|refusal| ToolError::Refused { request, refusal })
    }
}

/// The tasks that carry the link would go on otherwise, and the link would stay open.
impl Drop for Board {
    fn drop(&mut self) {
        self.client.close();
    }
}

/// Makes sure that nobody else could have put a socket there. Where there is none, connecting fails and says so.
fn check_place(found: &Found) -> Result<(), Untrusted> {
    let Place::Socket { path } = &found.place else {
        return Ok(());
    };
    match check_socket(path) {
        Err(Untrusted::Unseen { .. } | Untrusted::Kind { .. }) => Ok(()),
        checked => checked,
    }
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

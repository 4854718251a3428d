//! An open board: what is commanded.

use std::convert::Infallible;
use std::ops::Deref;
use std::time::Duration;

use board_sockets::{Untrusted, check_socket};
use mirror_protocol::{
    ClearEndpoint, CommandReply, Commanded, Compensate, CompensateEndpoint, Drives,
    EnterBootloaderEndpoint, OffEndpoint, Position, Refusal, RenewEndpoint, Renewal,
    SetDriveEndpoint, SetPose, SetPoseEndpoint, SetPositionEndpoint,
};
use postcard_rpc::Endpoint;
use postcard_rpc::postcard_schema::Schema;
use serde::Serialize;
use tokio::time::sleep;

use super::answer::Request;
use super::claim::Claim;
use super::find::{Found, Place};
use super::owner::Owner;
use super::stand_in::StandIn;
use super::stop_mark::StopMark;
use super::view::View;
use crate::error::ToolError;

/// What a tool that renews all the time asks for. When it dies, the board ramps to zero after this.
const RENEWED_LEASE: Duration = Duration::from_millis(100);
/// The same as it is asked for (ms).
pub const RENEWED_LEASE_MS: u32 = RENEWED_LEASE.as_millis() as u32;

/// An open board, which is this process's own until it is dropped; meanwhile others look at it through this process.
#[derive(Debug)]
pub struct Board {
    view: View,
    _stand_in: Option<StandIn>,
    /// Let go of last.
    claim: Option<Claim>,
}

/// What can be read of a board can be read of one that is open.
impl Deref for Board {
    type Target = View;

    fn deref(&self) -> &View {
        &self.view
    }
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

    pub(super) async fn greet(found: &Found, claim: Option<Claim>) -> Result<Self, ToolError> {
        let view = View::greet(found).await?;
        let is_ours = claim.is_some();
        Ok(Self {
            _stand_in: is_ours.then(|| StandIn::begin(found, &view)).flatten(),
            view,
            claim,
        })
    }

    /// Greets the board once more, after which it can be driven again although it was stopped.
    ///
    /// # Errors
    /// Where it does not answer.
    pub async fn greet_again(&self) -> Result<(), ToolError> {
        self.view.introduce().await.map(drop)
    }

    /// Who had the board when it was opened, and was waited for.
    pub fn waited_for(&self) -> Option<&Owner> {
        self.claim.as_ref()?.before.as_ref()
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
        let often = if self.identity().is_emulated { 20 } else { 4 };
        RENEWED_LEASE / often
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
}

/// Makes sure that nobody else could have put a socket there. Where there is none, connecting fails and says so.
pub(super) fn check_place(found: &Found) -> Result<(), ToolError> {
    let Place::Socket { path } = &found.place else {
        return Ok(());
    };
    match check_socket(path) {
        Err(Untrusted::Unseen { .. }) => Ok(()),
        // A file that is no board's gets no lock beside it.
        Err(Untrusted::Kind { .. }) => Err(ToolError::Open {
            board: found.name.clone(),
            reason: "it is no board's socket".to_owned(),
        }),
        checked => Ok(checked?),
    }
}

//! A board that clients share: opened for the first of them, let go of after the last, driven by one at a time.

use std::fmt;
use std::net::SocketAddr;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use calibration::PlatePose;
use chrono::{SecondsFormat, Utc};
use mirror_protocol::{Commanded, Drives, Refusal};
use quantities::Span;
use tokio::task::AbortHandle;
use tokio::time::sleep;

use crate::board::{Board, Found, RENEWED_LEASE_MS, Reconnecting};
use crate::commands::pose::request;
use crate::error::ToolError;
use crate::scpi::{Error, Kind, Status};
use crate::serve::failure::told;

/// A client, as others are told of it, and where it is told of what happens to it.
#[derive(Debug)]
pub(super) struct Client {
    pub(super) address: SocketAddr,
    pub(super) status: Mutex<Status>,
}

impl Client {
    /// Errors and states of this client.
    pub(super) fn status(&self) -> MutexGuard<'_, Status> {
        lock(&self.status)
    }
}

/// What is driven.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Asked {
    /// A pose; a position is one without tilts.
    Pose(PlatePose),
    /// Volts, actuator by actuator.
    Drives([f64; 4]),
}

/// The last command that drives: when the mirror has settled after it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Moved {
    pub(super) asked: Asked,
    pub(super) tick: u32,
    /// As the client said; `None`: as the board foresees.
    pub(super) settling: Option<Span>,
}

/// Who drives.
struct DrivingClient {
    client: Arc<Client>,
    since: String,
    moved: Option<Moved>,
    /// Renews the lease of what is driven.
    keeper: Option<AbortHandle>,
}

impl Drop for DrivingClient {
    fn drop(&mut self) {
        if let Some(keeper) = &self.keeper {
            keeper.abort();
        }
    }
}

impl fmt::Display for DrivingClient {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} since {}", self.client.address, self.since)
    }
}

/// A board that clients share.
pub(super) struct Device {
    link: Reconnecting,
    /// A board sends one stream at a time.
    pub(super) tracing: tokio::sync::Mutex<()>,
    driver: Mutex<Option<DrivingClient>>,
    /// How often the board was stopped beside this process: each client that was there has to say that it goes on.
    stops: Mutex<u32>,
}

/// Nobody panics while it is locked; if somebody did, what it holds is whole.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Device {
    pub(super) fn new(found: Found) -> Self {
        Self {
            link: Reconnecting::new(found),
            tracing: tokio::sync::Mutex::default(),
            driver: Mutex::default(),
            stops: Mutex::default(),
        }
    }

    /// Where the board is found.
    pub(super) fn found(&self) -> &Found {
        self.link.found()
    }

    /// The board, opened where it is not.
    ///
    /// # Errors
    /// As of [`Reconnecting::board`].
    pub(super) async fn board(&self) -> Result<Arc<Board>, ToolError> {
        self.link.board().await
    }

    /// What comes of asking `board`. Where it is gone it is opened anew the next time.
    pub(super) async fn heard<T>(
        &self,
        board: &Arc<Board>,
        answer: Result<T, ToolError>,
    ) -> Result<T, Error> {
        match answer {
            Ok(answer) => Ok(answer),
            Err(error) => {
                self.link.is_gone(board, &error).await;
                Err(told(&error))
            }
        }
    }

    /// Who drives, and since when.
    pub(super) fn driver(&self) -> Option<String> {
        lock(&self.driver).as_ref().map(DrivingClient::to_string)
    }

    /// Whether `client` drives.
    pub(super) fn is_driven_by(&self, client: &Arc<Client>) -> bool {
        let driver = lock(&self.driver);
        driver
            .as_ref()
            .is_some_and(|driver| Arc::ptr_eq(&driver.client, client))
    }

    /// The last command that drives, if what it asked for is still held.
    pub(super) fn moved(&self) -> Option<Moved> {
        lock(&self.driver).as_ref()?.moved
    }

    /// How often the board was stopped beside this process.
    pub(super) fn stops(&self) -> u32 {
        *lock(&self.stops)
    }

    /// From now on `client` drives, and nobody else.
    ///
    /// # Errors
    /// Where another does.
    pub(super) fn take(&self, client: &Arc<Client>) -> Result<(), Error> {
        let mut driver = lock(&self.driver);
        match &*driver {
            Some(driver) if Arc::ptr_eq(&driver.client, client) => Ok(()),
            Some(driver) => {
                let said = format!("driven by {driver}; OUTPut OFF turns it off nevertheless");
                Err(Error::new(Kind::CommandProtected, said))
            }
            None => {
                *driver = Some(DrivingClient {
                    client: client.clone(),
                    since: Utc::now().to_rfc3339_opts(SecondsFormat::Secs, true),
                    moved: None,
                    keeper: None,
                });
                Ok(())
            }
        }
    }

    /// Greets the board after it was stopped, so that it can be driven again.
    ///
    /// # Errors
    /// Where it does not answer.
    pub(super) async fn greet_again(&self) -> Result<(), Error> {
        let board = self.board().await.map_err(|error| told(&error))?;
        let answer = board.greet_again().await;
        self.heard(&board, answer).await
    }

    /// Drives for `client`, and goes on with it for as long as that is there.
    ///
    /// # Errors
    /// Where another drives, or the board refuses.
    pub(super) async fn drive(
        self: &Arc<Self>,
        client: &Arc<Client>,
        asked: Asked,
        settling: Option<Span>,
    ) -> Result<(), Error> {
        self.take(client)?;
        let board = self.board().await.map_err(|error| told(&error))?;
        let lease_ms = RENEWED_LEASE_MS;
        let answer = match asked {
            Asked::Pose(pose) => board.set_pose(request(pose, lease_ms)).await,
            Asked::Drives(volts) => {
                let drive_v = volts.map(|v| v as f32);
                board.set_drive(Drives { drive_v, lease_ms }).await
            }
        };
        if is_stopped(&answer) {
            self.count_stop();
        }
        let commanded = self.heard(&board, answer).await?;
        self.hold(client, &board, asked, &commanded, settling);
        Ok(())
    }

    fn hold(
        self: &Arc<Self>,
        client: &Arc<Client>,
        board: &Arc<Board>,
        asked: Asked,
        commanded: &Commanded,
        settling: Option<Span>,
    ) {
        let mut driver = lock(&self.driver);
        // Another client may have turned the channels off since the board answered.
        let Some(driver) = driver
            .as_mut()
            .filter(|one| Arc::ptr_eq(&one.client, client))
        else {
            return;
        };
        driver.moved = Some(Moved {
            asked,
            tick: commanded.tick,
            settling,
        });
        if driver.keeper.is_none() {
            let (device, board) = (self.clone(), board.clone());
            let keeper = tokio::spawn(async move { device.keep(&board).await });
            driver.keeper = Some(keeper.abort_handle());
        }
    }

    /// Renews the lease until the board says that nothing is driven any more, and tells who drove.
    async fn keep(&self, board: &Arc<Board>) {
        let answer = loop {
            match board.renew().await {
                Ok(_) => sleep(board.renewal_period()).await,
                ended => break ended,
            }
        };
        if is_stopped(&answer) {
            self.count_stop();
        }
        if let Err(error) = self.heard(board, answer).await {
            self.end_drive(error);
        }
    }

    /// The board was stopped by another process, or has started anew.
    fn count_stop(&self) {
        *lock(&self.stops) += 1;
    }

    /// Nobody drives any more; who did is told why.
    fn end_drive(&self, why: Error) {
        let driver = lock(&self.driver).take();
        if let Some(driver) = driver {
            driver.client.status().push(why);
        }
    }

    /// Turns the channels off for `client`, whoever drives.
    ///
    /// # Errors
    /// Where the board does not answer.
    pub(super) async fn off(&self, client: &Arc<Client>) -> Result<(), Error> {
        if self.is_driven_by(client) {
            let mut driver = lock(&self.driver);
            if let Some(driver) = driver.as_mut() {
                driver.moved = None;
                if let Some(keeper) = driver.keeper.take() {
                    keeper.abort();
                }
            }
        } else {
            let said = format!("{} turned the channels off", client.address);
            self.end_drive(Error::new(Kind::SettingsConflict, said));
        }
        let board = self.board().await.map_err(|error| told(&error))?;
        let answer = board.off().await;
        self.heard(&board, answer).await.map(drop)
    }

    /// What `client` drives ends, with the channels off, as after its connection.
    ///
    /// # Errors
    /// Where the board does not answer: it ramps to zero by itself.
    pub(super) async fn release(&self, client: &Arc<Client>) -> Result<(), Error> {
        match self.is_driven_by(client) {
            true => self.end().await,
            false => Ok(()),
        }
    }

    /// What is driven ends, with the channels off.
    ///
    /// # Errors
    /// Where the board does not answer: it ramps to zero by itself.
    pub(super) async fn end(&self) -> Result<(), Error> {
        let had_driver = lock(&self.driver).take().is_some();
        let board = self.link.opened().await;
        match board.filter(|_| had_driver) {
            Some(board) => {
                let answer = board.off().await;
                self.heard(&board, answer).await.map(drop)
            }
            None => Ok(()),
        }
    }
}

/// Whether the board refuses since it was stopped, or has started anew.
fn is_stopped<T>(answer: &Result<T, ToolError>) -> bool {
    let refusal = Refusal::NoHello;
    matches!(answer, Err(ToolError::Refused { refusal: found, .. }) if *found == refusal)
}

//! Carries out what the live view is told to do with the board, and goes on with what it drives.

use std::cell::{Cell, RefCell};
use std::convert::Infallible;

use calibration::PlatePose;
use mirror_protocol::Refusal;
use tokio::sync::Notify;
use tokio::sync::mpsc::UnboundedReceiver;
use tokio::time::sleep;

use super::state::{Order, State};
use crate::board::{Board, Found, RENEWED_LEASE_MS, announce_stop, stop};
use crate::commands::pose::request;
use crate::error::ToolError;

/// Who drives the board for a view.
pub(super) struct Driver<'a> {
    pub(super) board: &'a Board,
    pub(super) found: &'a Found,
    pub(super) state: &'a RefCell<State>,
    /// A stop, which overtakes every order.
    pub(super) stop: &'a Notify,
    /// Whether the board drives for the view, under a lease that must be renewed.
    pub(super) is_driving: Cell<bool>,
}

impl Driver<'_> {
    /// Carries out orders for as long as the board answers.
    ///
    /// # Errors
    /// Where it does not.
    pub(super) async fn carry_out(
        &self,
        orders: &mut UnboundedReceiver<Order>,
    ) -> Result<Infallible, ToolError> {
        loop {
            tokio::select! {
                biased;
                () = self.stop.notified() => {
                    // What was asked before the stop is not done after it.
                    while orders.try_recv().is_ok() {}
                    self.turn_off().await?;
                    self.let_go("stopped: channels are off");
                }
                done = self.step(orders) => done?,
            }
        }
    }

    /// The next order, or the next renewal.
    async fn step(&self, orders: &mut UnboundedReceiver<Order>) -> Result<(), ToolError> {
        let done = tokio::select! {
            order = orders.recv() => match order {
                Some(Order::Move(pose)) => self.move_to(pose).await,
                Some(Order::Clear) => self.clear().await,
                _ => Ok(()),
            },
            () = sleep(self.board.renewal_period()), if self.is_driving.get() => self.board.renew().await.map(drop),
        };
        match done {
            Err(ToolError::Refused { refusal, request }) => {
                self.refused(refusal, request);
                Ok(())
            }
            done => done,
        }
    }

    async fn move_to(&self, pose: PlatePose) -> Result<(), ToolError> {
        self.board.set_pose(request(pose, RENEWED_LEASE_MS)).await?;
        self.is_driving.set(true);
        self.state.borrow_mut().drives(pose);
        Ok(())
    }

    async fn clear(&self) -> Result<(), ToolError> {
        self.board.greet_again().await?;
        self.board.clear().await?;
        "cleared: the board can be driven again".clone_into(&mut self.state.borrow_mut().notice);
        Ok(())
    }

    fn refused(&self, refusal: Refusal, request: &'static str) {
        let why = match refusal {
            Refusal::NoHello => {
                "turned off by another tool; c lets this one drive again".to_owned()
            }
            Refusal::NoLease => "the lease has ended: the board ramped to zero".to_owned(),
            refusal => ToolError::Refused { request, refusal }.to_string(),
        };
        self.let_go(why);
    }

    fn let_go(&self, why: impl Into<String>) {
        self.is_driving.set(false);
        self.state.borrow_mut().lets_go(why);
    }

    /// Turns all channels off, by the way that nothing on the link can keep.
    async fn turn_off(&self) -> Result<(), ToolError> {
        announce_stop(self.found);
        if stop(self.found).await? {
            // The board refuses who drove before a stop.
            return self.board.greet_again().await;
        }
        self.board.off().await.map(drop)
    }
}

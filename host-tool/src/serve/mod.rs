//! `serve`: boards as an instrument on a socket, which speaks SCPI.
//!
//! `commands` is the table of all commands, `session` carries them out for one client, `device` is a board that clients
//! share, and `connection` is a client's socket.

mod action;
mod answers;
mod boards;
mod commands;
mod connection;
mod device;
mod failure;
mod reference;
mod session;
mod states;
mod takes;
mod trace;

use std::fmt;
use std::io;
use std::net::SocketAddr;
use std::sync::Arc;

use serde::Serialize;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::Semaphore;

use crate::error::ToolError;
use crate::report;
use crate::serve::boards::Boards;
pub(crate) use crate::serve::reference::page as reference;
use crate::serve::session::Session;
use crate::system::Interrupts;
use crate::verbosity::say;

/// Clients at a time: a bench has a few, and each takes some megabytes at most while it is sent a trace.
const MOST_CLIENTS: usize = 32;

#[derive(Serialize)]
struct Listening {
    /// Address and port.
    listening: SocketAddr,
}

impl fmt::Display for Listening {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "listening  on {}; Ctrl-C ends it", self.listening)
    }
}

/// Serves until it is told to end; what a client drives is off then.
pub(crate) async fn run(
    listen: &str,
    board: Option<String>,
    end_with_input: bool,
    json: bool,
) -> Result<(), ToolError> {
    let cannot_listen = |source| ToolError::Listen {
        address: listen.to_owned(),
        source,
    };
    let listener = TcpListener::bind(listen).await.map_err(cannot_listen)?;
    let listening = listener.local_addr().map_err(cannot_listen)?;
    let mut interrupts = Interrupts::listen().map_err(ToolError::Runtime)?;
    report::print(&Listening { listening }, json);
    if !listening.ip().is_loopback() {
        say(format_args!(
            "warning: whoever reaches this machine at {listening} drives the mirror, without a password; \
             --listen 127.0.0.1:{} lets in this machine only",
            listening.port()
        ));
    }
    let boards = Arc::new(Boards::new(board));
    let places = Arc::new(Semaphore::new(MOST_CLIENTS));
    tokio::select! {
        () = accept(&listener, &boards, &places) => {}
        _ = interrupts.next() => {}
        () = end_of_input(), if end_with_input => {}
    }
    for device in boards.devices() {
        // A board that does not answer ramps to zero by itself.
        let _ = device.end().await;
    }
    Ok(())
}

async fn accept(listener: &TcpListener, boards: &Arc<Boards>, places: &Arc<Semaphore>) {
    loop {
        // Out of file handles, for example: those that are connected go on, and end some day.
        let Ok((stream, address)) = listener.accept().await else {
            tokio::time::sleep(connection::PAUSE).await;
            continue;
        };
        match places.clone().try_acquire_owned() {
            Ok(place) => {
                let session = Session::new(boards.clone(), address);
                tokio::spawn(async move {
                    connection::converse(stream, session).await;
                    drop(place);
                });
            }
            Err(_) => refuse(&stream),
        }
    }
}

/// Tells a client for whom there is no place, as far as that goes at once.
fn refuse(stream: &TcpStream) {
    let said = format!("-200,\"Execution error;there are {MOST_CLIENTS} clients already\"\n");
    let _ = stream.try_write(said.as_bytes());
}

/// Waits for the end of the standard input, on a thread of its own: it may never come.
async fn end_of_input() {
    let (ended, end) = tokio::sync::oneshot::channel();
    std::thread::spawn(move || {
        let _ = io::copy(&mut io::stdin(), &mut io::sink());
        let _ = ended.send(());
    });
    let _ = end.await;
}

//! From frames to commands: the endpoints of `mirror-protocol`, and their answers.

mod calibrations;
mod session;

use core::cell::RefCell;
use core::hint::black_box;
use core::sync::atomic::Ordering;

use control_core::{Micrometre, Pose, Radian, Setpoint, Volt};
use embassy_futures::yield_now;
use embassy_time::{Duration, Instant, Timer};
use mirror_protocol::usb::IMAGE_MARK;
use mirror_protocol::{
    CalibrationEndpoint, CalibrationReadEndpoint, CalibrationRevertEndpoint,
    CalibrationUseEndpoint, CalibrationWriteEndpoint, ClearEndpoint, CommandReply, Compensate,
    CompensateEndpoint, Drives, ENDPOINTS, EnterBootloaderEndpoint, EnterBootloaderReply,
    FaultLogEndpoint, FaultLogReply, Hello, HelloEndpoint, Identity, LEASE_FOREVER_MS,
    LoadPointsEndpoint, LoadReply, LogQuery, MAX_FRAME_BYTES, OffEndpoint, PROTOCOL_VERSION, Play,
    PlayEndpoint, Points, Position, Refusal, RenewEndpoint, Renewal, SenseEndpoint,
    SetDriveEndpoint, SetPose, SetPoseEndpoint, SetPositionEndpoint, SetSenseEndpoint, Status,
    StatusEndpoint, StatusReply, Stream, StreamEndpoint, StreamReply, Streaming, TOPICS_IN,
    TOPICS_OUT, TelemetryTopic,
};
use postcard_rpc::define_dispatch;
use postcard_rpc::header::{VarHeader, VarSeq};
use postcard_rpc::server::{Dispatch, Sender, Server, WireRx};
use protection::Lease;
use static_cell::ConstStaticCell;
use waveforms::Player;

use self::calibrations::{
    calibration, read_calibration, revert_calibration, sense, set_sense, use_calibration,
    write_calibration,
};
pub use self::session::Session;
use self::session::{refusal, text};
use crate::board::LinkTx;
use crate::fault_log::{FaultLog, LONG_RUN};
use crate::mailbox::{LinkSide, Order};
use crate::{TICK_HZ, TICKS_PER_MS, watchdog};

define_dispatch! {
    app: Endpoints;
    spawn_fn: no_endpoint_runs_as_a_task;
    tx_impl: LinkTx;
    spawn_impl: ();
    context: Session;

    endpoints: {
        list: ENDPOINTS;
        | EndpointTy          | kind     | handler      |
        | ----------          | ----     | -------      |
        | HelloEndpoint       | async    | hello        |
        | StatusEndpoint      | blocking | status       |
        | SetPositionEndpoint | async    | set_position |
        | SetPoseEndpoint     | async    | set_pose     |
        | SetDriveEndpoint    | async    | set_drive    |
        | OffEndpoint         | async    | off          |
        | EnterBootloaderEndpoint | async | enter_bootloader |
        | RenewEndpoint       | async    | renew        |
        | ClearEndpoint       | async    | clear        |
        | CompensateEndpoint  | async    | compensate   |
        | StreamEndpoint      | async    | stream       |
        | CalibrationEndpoint | blocking | calibration  |
        | CalibrationReadEndpoint | blocking | read_calibration |
        | CalibrationWriteEndpoint | blocking | write_calibration |
        | CalibrationUseEndpoint | async | use_calibration |
        | CalibrationRevertEndpoint | async | revert_calibration |
        | SenseEndpoint       | blocking | sense        |
        | SetSenseEndpoint    | async    | set_sense    |
        | LoadPointsEndpoint  | blocking | load_points  |
        | PlayEndpoint        | async    | play         |
        | FaultLogEndpoint    | blocking | fault_log    |
    };
    topics_in: {
        list: TOPICS_IN;
        | TopicTy | kind | handler |
        | ------- | ---- | ------- |
    };
    topics_out: {
        list: TOPICS_OUT;
    };
}

/// What an image of this firmware says of itself: [`IMAGE_MARK`], version and commit.
const IMAGE_SAYS: &str = concat!(
    "this is mirror firmware ",
    env!("CARGO_PKG_VERSION"),
    " ",
    env!("FIRMWARE_BUILD"),
    ";"
);

/// The commit that this was built from.
fn build() -> &'static str {
    // A text that the compiler sees through would be in the image in pieces, or not at all.
    let says = black_box(IMAGE_SAYS);
    let says = says.strip_prefix(IMAGE_MARK).unwrap_or_default();
    let (_, build) = says.split_once(' ').unwrap_or_default();
    build.trim_end_matches(';')
}

async fn hello(session: &mut Session, header: VarHeader, hello: Hello) -> Identity {
    session.tool = Some(hello.protocol_version);
    session.stops = session.mailbox.stops();
    // Of a tool that is gone. Where the control loop does not take it back, it says so to what is asked next.
    let _ = revert_calibration(session, header, ()).await;
    Identity {
        protocol_version: PROTOCOL_VERSION,
        firmware_version: text(env!("CARGO_PKG_VERSION")),
        build: text(build()),
        board: text(session.board),
        is_emulated: session.is_emulated,
        tick_hz: TICK_HZ,
    }
}

fn status(session: &mut Session, _header: VarHeader, (): ()) -> StatusReply {
    session.check_version()?;
    Ok(Status {
        telemetry: session.mailbox.latest(),
        health: session.mailbox.health(),
        max_position_um: session.calibration.max_position_um,
        max_drive_v: session.calibration.max_drive_v,
        dropped_samples: session.mailbox.dropped_samples(),
        stops: session.mailbox.stops(),
        last_stop: session.last_stop.clone(),
        option_bytes: session.option_bytes,
    })
}

async fn set_position(
    session: &mut Session,
    _header: VarHeader,
    position: Position,
) -> CommandReply {
    check_numbers(&[position.z_um])?;
    let setpoint = Setpoint::position(Micrometre(position.z_um));
    session
        .drive(Order::Drive(setpoint, lease(position.lease_ms)))
        .await
}

async fn set_pose(session: &mut Session, _header: VarHeader, asked: SetPose) -> CommandReply {
    check_numbers(&[asked.z_um, asked.tilt_x_rad, asked.tilt_y_rad])?;
    let pose = Pose {
        z: Micrometre(asked.z_um),
        tilt_x: Radian(asked.tilt_x_rad),
        tilt_y: Radian(asked.tilt_y_rad),
    };
    let order = Order::Drive(Setpoint::Position(pose), lease(asked.lease_ms));
    session.drive(order).await
}

async fn set_drive(session: &mut Session, _header: VarHeader, drives: Drives) -> CommandReply {
    check_numbers(&drives.drive_v)?;
    let setpoint = Setpoint::Drive(drives.drive_v.map(Volt));
    session
        .drive(Order::Drive(setpoint, lease(drives.lease_ms)))
        .await
}

async fn off(session: &mut Session, _header: VarHeader, (): ()) -> CommandReply {
    session.order(Order::Off).await
}

/// Once the answer is on its way, [`leave`] does it.
async fn enter_bootloader(
    session: &mut Session,
    header: VarHeader,
    (): (),
) -> EnterBootloaderReply {
    if session.bootloader.is_none() {
        return Err(Refusal::NoBootloader);
    }
    off(session, header, ()).await?;
    session.mailbox.request_bootloader();
    Ok(())
}

async fn renew(session: &mut Session, _header: VarHeader, renewal: Renewal) -> CommandReply {
    session.drive(Order::Renew(lease(renewal.lease_ms))).await
}

async fn clear(session: &mut Session, _header: VarHeader, (): ()) -> CommandReply {
    session.order(Order::Clear).await
}

async fn compensate(session: &mut Session, _header: VarHeader, asked: Compensate) -> CommandReply {
    session.order(Order::Compensate(asked.is_wanted)).await
}

async fn stream(session: &mut Session, _header: VarHeader, stream: Stream) -> StreamReply {
    session.check_version()?;
    check_period(&stream)?;
    let first_tick = session.mailbox.stream(stream).await;
    let first_tick = first_tick.map_err(refusal)?;
    Ok(Streaming { first_tick })
}

fn load_points(session: &mut Session, _header: VarHeader, points: Points) -> LoadReply {
    session.check_version()?;
    if session
        .mailbox
        .load_points(points.first.into(), &points.points)
    {
        Ok(())
    } else {
        Err(Refusal::TableEnd)
    }
}

async fn play(session: &mut Session, _header: VarHeader, play: Play) -> StreamReply {
    session.check_may_drive()?;
    let player = Player::new(play.waveform, TICK_HZ).map_err(Refusal::Waveform)?;
    check_period(&play.stream)?;
    let lease = lease(play.lease_ms);
    let first_tick = session.mailbox.play(player, play.stream, lease).await;
    let first_tick = first_tick.map_err(refusal)?;
    Ok(Streaming { first_tick })
}

fn fault_log(session: &mut Session, _header: VarHeader, query: LogQuery) -> FaultLogReply {
    session.check_version()?;
    Ok(session.fault_log.borrow_mut().page(query.most))
}

fn check_period(stream: &Stream) -> Result<(), Refusal> {
    if stream.period_ticks == 0 {
        Err(Refusal::ZeroPeriod)
    } else {
        Ok(())
    }
}

/// The lease of so many milliseconds; what would be too many ticks to count does not end.
fn lease(ms: u32) -> Lease {
    match ms.checked_mul(TICKS_PER_MS) {
        Some(ticks) if ms != LEASE_FOREVER_MS => Lease::ticks(ticks),
        _ => Lease::FOREVER,
    }
}

fn check_numbers(values: &[f32]) -> Result<(), Refusal> {
    if values.iter().all(|value| value.is_finite()) {
        Ok(())
    } else {
        Err(Refusal::NotANumber)
    }
}

/// Holds a frame while it is received. On USB the longest frame is followed by an empty packet, for
/// which there must be room, too.
pub type Frame = [u8; MAX_FRAME_BYTES + 64];

/// The frame of the one server of the image.
pub static FRAME: ConstStaticCell<Frame> = ConstStaticCell::new([0; MAX_FRAME_BYTES + 64]);

/// Answers requests on a link and sends it the samples of the stream, for ever.
pub async fn serve<Rx: WireRx>(tx: LinkTx, rx: Rx, frame: &mut Frame, session: Session) -> ! {
    let (mailbox, bootloader) = (session.mailbox, session.bootloader);
    let log = log_trips(mailbox, session.fault_log);
    let endpoints = Endpoints::new(session, ());
    let key_length = endpoints.min_key_len();
    let mut server = Server::new(tx, rx, frame.as_mut_slice(), endpoints, key_length);
    let samples = send_samples(server.sender(), mailbox);
    let requests = async {
        loop {
            // It returns when the link is lost, and is run again for the next connection.
            server.run().await;
            defmt::info!("link lost");
        }
    };
    let leave = leave(mailbox, bootloader);
    embassy_futures::join::join5(samples, requests, leave, log, check_in())
        .await
        .0
}

/// Logs what trips the board, for ever.
async fn log_trips(mailbox: LinkSide, log: &RefCell<FaultLog>) -> ! {
    let trips = async {
        loop {
            let trip = mailbox.next_trip().await;
            log.borrow_mut().trip(&trip, Instant::now());
        }
    };
    let long_run = async {
        Timer::after(LONG_RUN).await;
        log.borrow_mut().end_succession();
    };
    embassy_futures::join::join(trips, long_run).await.0
}

/// Tells the watchdog that the link is polled.
async fn check_in() -> ! {
    loop {
        watchdog::LINK.store(true, Ordering::Relaxed);
        Timer::after(watchdog::ROUND / 2).await;
    }
}

/// Time for an answer to reach the tool.
const ANSWER_TIME: Duration = Duration::from_millis(50);

/// Waits until the board is asked to leave for its bootloader, and does.
async fn leave(mailbox: LinkSide, bootloader: Option<fn() -> !>) -> ! {
    loop {
        mailbox.bootloader_requested().await;
        Timer::after(ANSWER_TIME).await;
        if let Some(enter) = bootloader {
            enter();
        }
    }
}

/// The sender's lock goes to whoever asks first, which a stream that fills the bus always is. After so many frames it lets an
/// answer ask that waits. To let it ask after every one costs samples of every tick on the driver board.
const FRAMES_BETWEEN_ANSWERS: u16 = 8;

async fn send_samples(sender: Sender<LinkTx>, mailbox: LinkSide) -> ! {
    let mut sequence: u16 = 0;
    loop {
        let samples = mailbox.next_samples().await;
        // Samples that find no listener are gone; the next ones may find it.
        let _ = sender
            .publish::<TelemetryTopic>(VarSeq::Seq2(sequence), &samples)
            .await;
        sequence = sequence.wrapping_add(1);
        if sequence.is_multiple_of(FRAMES_BETWEEN_ANSWERS) {
            yield_now().await;
        }
    }
}

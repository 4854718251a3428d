//! The board as an instrument on a socket: what one client says, what several do to each other, and what is left when they,
//! the board or the tool go.

mod calibrated;
mod client;

use std::io::Write;
use std::process::{Command, Stdio};
use std::time::Instant;

use emulated_board::{EmulatedBoard, PlantFault, Speed};
use hil::{Bench, Said, interrupt};
use virtual_mirror::MirrorConfig;

use client::{Client, PATIENCE, Serving};

#[test]
fn a_client_moves_the_mirror_waits_and_reads() {
    let serving = Serving::start();
    let mut client = serving.client();
    let said = client.ask("*IDN?");
    assert!(
        said.starts_with("host-tool,") && said.split(',').count() == 4,
        "{said}"
    );
    assert_eq!(client.ask("SYST:VERS?"), "1999.0");
    assert!(client.number("SOUR:POS?") > 9e37, "nothing was asked for");
    assert_eq!(client.ask("source:position 120um;*opc?"), "1");
    assert!((client.number("POS?") - 120e-6).abs() < 1e-12);
    let z_m = client.number("MEAS:POS?");
    assert_eq!(
        client.ask("OUTP?;:STAT:OPER:COND?"),
        "1;256",
        "driven, and settled"
    );
    let (volts, amperes) = (client.numbers("MEAS:VOLT?"), client.numbers("MEAS:CURR?"));
    let ohms = client.numbers("MEAS:RES?");
    assert_eq!((volts.len(), amperes.len(), ohms.len()), (4, 4, 4));
    // Each from a tick of its own. A conversion's noise is 1.2 of 4096 steps, 0.1 % of such currents; ten times that.
    assert!(
        (volts[0] / amperes[0] / ohms[0] - 1.0).abs() < 0.01,
        "{volts:?} {amperes:?} {ohms:?}"
    );

    let (columns, rows) = (client.ask("TRAC:COL?"), client.block("TRAC? 50,1ms"));
    let columns: Vec<&str> = columns.trim_matches('"').split(',').collect();
    let values: Vec<f32> = rows
        .chunks(4)
        .map(|bytes| f32::from_le_bytes(bytes.try_into().expect("four")))
        .collect();
    let rows: Vec<&[f32]> = values.chunks(columns.len()).collect();
    assert_eq!(rows.len(), 50);
    assert_eq!((columns[0], rows[0][0], rows[49][0]), ("t_s", 0.0, 0.049));
    let z = columns
        .iter()
        .position(|name| *name == "z_m")
        .expect("a column");
    let mean = rows.iter().map(|row| f64::from(row[z])).sum::<f64>() / 50.0;
    // Five times the sensor's noise, 20 nm on the bench mirror, and ten times that for what it still creeps.
    assert!((mean - z_m).abs() < 1e-6, "{mean} and {z_m}");
    client.is_content();

    // What the tool's own command comes to, which waits as long: the same again.
    drop(client);
    let said = serving.bench.json(&["set-z", "120um"]);
    let um = said["sensor_z_um"].as_f64().expect("a sensor");
    assert!((um * 1e-6 - z_m).abs() < 1e-6, "{um} um and {z_m} m");
}

#[test]
fn what_is_wrong_is_said_and_nothing_moves() {
    let serving = Serving::start();
    let mut client = serving.client();
    for (line, error) in [
        ("SOUR:POS 1m", "-222,"),
        ("SOUR:POS -1um", "-222,"),
        ("SOUR:POS 120V", "-131,"),
        ("SOUR:POS", "-109,"),
        ("SOUR:POSI 1um", "-113,"),
        ("POSE 1um,1deg,0", "-200,"),
        ("VOLT 99", "-222,"),
        ("OUTP ON", "-221,"),
        ("TRAC? 1000000,1ms", "-222,"),
        ("TRAC? 10,1us", "-222,"),
        ("TRAC? 10,0.15ms", "-222,"),
        ("SYST:BOAR \"none\"", "-241,"),
        ("\u{b5}", "-102,"),
        ("SYST:BOAR \"", "-102,"),
    ] {
        client.say(line);
        let said = client.error();
        assert!(said.starts_with(error), "{line}: {said}");
        client.is_content();
    }
    client.send(b"\xff\xfe\n");
    assert!(client.error().starts_with("-101,"));
    assert_eq!(
        client.ask("*ESR?"),
        "48",
        "of commands and of their execution"
    );
    assert_eq!(client.ask("*ESE 32;*SRE 36;*ESE?;*SRE?;:OUTP?"), "32;36;0");
    client.say("NONSENSE");
    assert_eq!(
        client.ask("*STB?"),
        "100",
        "an error, an event, and a request for service"
    );
    assert_eq!(client.ask("*CLS;*STB?"), "0");
}

#[test]
fn the_outputs_are_off_once_the_client_is_gone_however_it_goes() {
    // By the wall's clock, so that the board's tells how long it takes.
    let serving = Serving::of(Bench::changed(|new| new.speed = Speed::Times(1.0)));
    // It closes its socket.
    drop(serving.driver());
    let gone_s = serving.bench.simulated_s();
    serving.wait_for_zero();
    let took_s = serving.bench.simulated_s() - gone_s;
    println!("off {took_s:.3} s after the client went");
    assert!(took_s < 0.2, "{took_s} s");

    // It leaves an answer unread, which resets the connection, with a command under way.
    let mut client = serving.driver();
    client.say("SOUR:SETT 1h;VOLT 2V;*IDN?;*OPC?");
    drop(client);
    serving.wait_for_zero();

    // It is killed while it floods.
    serving.bench.controls().inject(None);
    let script = format!(
        "exec 3<>/dev/tcp/127.0.0.1/{}; while :; do echo 'SOUR:VOLT 2V' >&3; done",
        serving.address.port()
    );
    let flooding = Command::new("bash")
        .args(["-c", &script])
        .stderr(Stdio::null())
        .spawn();
    let mut flooding = flooding.expect("bash");
    serving.bench.wait_until_driven(100);
    flooding.kill().expect("it dies");
    flooding.wait().expect("it is gone");
    let killed_s = serving.bench.simulated_s();
    serving.wait_for_zero();
    let took_s = serving.bench.simulated_s() - killed_s;
    println!("off {took_s:.3} s after the client was killed");
    // A lease of 100 ms, a ramp of 50 ms from 2 V, and one more renewal under way.
    assert!(took_s < 0.2, "{took_s} s");
    assert!(serving.bench.is_off(), "and the board is free");
}

/// A lease of 100 ms and a ramp of as many, in ticks, and one more renewal under way.
const LEASE_AND_RAMP_TICKS: u64 = 2_000 + 250;

#[test]
fn the_board_ramps_to_zero_within_0_2_s_of_its_time_once_the_tool_is_killed() {
    let mut serving = Serving::start();
    let _client = serving.driver();
    serving.tool.kill().expect("it dies");
    serving.tool.wait().expect("it is gone");
    let ticks = || serving.bench.controls().observed().driven_ticks;
    let killed_at = ticks();
    serving.wait_for_zero();
    let driven = ticks() - killed_at;
    println!("driven for {:.3} s more", driven as f64 * 1e-4);
    assert!(driven <= LEASE_AND_RAMP_TICKS, "{driven} ticks");
}

#[test]
fn one_client_drives_and_the_others_read() {
    let serving = Serving::start();
    let mut first = serving.driver();
    let mut second = serving.client();
    assert!(second.numbers("MEAS:VOLT?")[0] > 1.9);
    second.say("SOUR:POS 50um");
    let said = second.error();
    let address = first.0.get_ref().local_addr().expect("an address");
    assert!(
        said.starts_with("-203,") && said.contains(&format!("driven by {address} since 2")),
        "{said}"
    );
    assert_eq!(second.ask("SYST:LOCK:REQ?"), "0");
    assert!(second.ask("SYST:LOCK:OWN?").contains(&address.to_string()));
    // Other tools read through it, and are told whose the board is.
    let status = serving.bench.json(&["status"]);
    let owner = status["owner"]["command"].as_str().expect("an owner");
    assert!(owner.starts_with("host-tool serve"), "{status}");
    assert!(
        status["drive_v"][0].as_f64().expect("volts") > 1.9,
        "{status}"
    );
    // Both go on with what they do.
    assert!(first.numbers("MEAS:VOLT?")[0] > 1.9);
    first.say("SYST:LOCK:REL");
    assert_eq!(first.ask("OUTP?"), "0");
    assert_eq!(second.ask("SYST:LOCK:OWN?"), "NONE");
    assert_eq!(second.ask("VOLT 1V;*OPC?;:OUTP?"), "1;1");
    // Everybody may turn it off, and who drove is told who did, and waits no longer for what does not settle any more.
    second.say("SOUR:SETT 100h;VOLT 1.5V;*OPC?");
    while first.numbers("SOUR:VOLT?")[0] < 1.4 {}
    assert_eq!(first.ask("OUTP OFF;OUTP?"), "0");
    assert_eq!(second.hear(), "1");
    let said = second.error();
    assert!(
        said.contains(&format!("{address} turned the channels off")),
        "{said}"
    );
    drop((first, second));
    serving.wait_for_zero();
}

#[test]
fn off_gets_through_and_nobody_drives_afterwards_who_has_not_said_so() {
    let serving = Serving::start();
    let mut client = serving.driver();
    let said = serving.bench.json(&["off"]);
    let owner = said["owner"]["command"].as_str().expect("an owner");
    assert!(owner.starts_with("host-tool serve"), "{owner}");
    serving.wait_for_zero();
    // The renewal finds it out by itself, or the next command that drives.
    client.say("VOLT 2V");
    let said = client.error();
    assert!(
        said.starts_with("-203,") && said.contains("SYSTem:LOCK:REQuest?"),
        "{said}"
    );
    client.say("*CLS;VOLT 2V");
    assert!(
        client.error().starts_with("-203,"),
        "it says so until it is meant"
    );
    assert_eq!(
        client.ask("OUTP?;:STAT:QUES:COND?"),
        "0;2304",
        "stopped, with the factory's calibration"
    );
    assert_eq!(
        client.ask("*CLS;:SYST:LOCK:REQ?;:VOLT 2V;*OPC?;:OUTP?"),
        "1;1;1"
    );
    client.is_content();
}

#[test]
fn a_fault_is_named_and_cleared_and_a_board_that_is_gone_is_found_again() {
    let mut emulation = None;
    let bench = Bench::changed(|new| emulation = Some(new.clone()));
    let mut serving = Serving::of(bench);
    let mut client = serving.driver();
    let fault = Some(PlantFault::OpenHeater(1));
    serving.bench.controls().inject(fault);
    serving.wait_for_zero();
    // Who drove is told by then or soon after, without having asked.
    let start = Instant::now();
    let said = loop {
        match client.error() {
            none if none.starts_with("0,") => {
                assert!(start.elapsed() < PATIENCE, "nothing is said")
            }
            said => break said,
        }
    };
    assert!(
        said.starts_with("-240,") && said.contains("open-heater"),
        "{said}"
    );
    assert_eq!(client.ask("OUTP:PROT:TRIP?"), "1");
    assert!(
        client
            .ask("STAT:CHAN?")
            .contains("\"tripped: open-heater\"")
    );
    serving.bench.controls().inject(None);
    client.say("OUTP:PROT:CLE");
    assert_eq!(client.ask("OUTP:PROT:TRIP?"), "0");

    serving.bench.kill_board();
    client.say("*CLS;:MEAS:CURR?");
    let said = client.error();
    assert!(said.starts_with("-241,"), "{said}");
    let again = EmulatedBoard::start(&emulation.expect("it was started"));
    let _again = again.expect("it is there again");
    let start = Instant::now();
    while !client
        .ask("*CLS;:MEAS:CURR?;:SYST:ERR:COUN?")
        .ends_with(";0")
    {
        assert!(start.elapsed() < PATIENCE);
    }
    // The same client drives it, as if nothing had happened.
    assert_eq!(client.ask("VOLT 2V;*OPC?;:OUTP?"), "1;1");
    client.is_content();
}

#[test]
fn floods_stalls_and_rubbish_of_one_client_are_its_own() {
    let serving = Serving::start();
    let mut good = serving.driver();
    // Half a line, and silence.
    let mut half = serving.client();
    half.send(b"SOUR:POS 1");
    // A line of a megabyte: told, and the next one is whole.
    let mut long = serving.client();
    long.send(&vec![b'x'; 1 << 20]);
    long.send(b"\n");
    assert!(long.error().starts_with("-363,"));
    long.is_content();
    // Rubbish, by a generator so that it is the same each time (Park and Miller 1988).
    let mut rubbish = serving.client();
    let mut state = 1_u64;
    let bytes: Vec<u8> = std::iter::repeat_with(|| {
        state = state * 16807 % 2_147_483_647;
        (state >> 8) as u8
    })
    .take(200_000)
    .collect();
    rubbish.send(&bytes);
    rubbish.send(b"\n*CLS\n");
    rubbish.is_content();
    // Questions without end whose answers nobody reads.
    let mut stalling = serving.client();
    let asked = stalling.0.get_mut();
    asked.set_nonblocking(true).expect("possible");
    let questions = "*IDN?\n".repeat(10_000);
    for _ in 0..100 {
        if asked.write(questions.as_bytes()).is_err() {
            break;
        }
    }
    assert!(good.numbers("MEAS:VOLT?")[0] > 1.9, "it drives on");
    assert_eq!(half.ask("um;:SYST:ERR:COUN?"), "1", "another drives");
    good.is_content();
    // As many clients as there is room for, and one more.
    let mut crowd: Vec<Client> = (0..40).map(|_| serving.client()).collect();
    let last = crowd.last_mut().expect("forty");
    assert!(last.hear().contains("clients already"));
}

#[test]
fn one_tool_serves_many_boards_and_lets_go_of_each_with_its_last_client() {
    let serving = Serving::start();
    let mut first = serving.driver();
    // Another board, in a folder of its own; its socket's path is its name.
    let other = Bench::emulated(MirrorConfig::bench());
    let mut second = serving.client();
    assert_eq!(
        second.ask(&format!("SYST:BOAR \"{}\";BOAR?", other.board())),
        format!("\"{}\"", other.board())
    );
    assert_eq!(
        second.ask("VOLT 1V;*OPC?;:OUTP?"),
        "1;1",
        "nobody drives that one"
    );
    assert!(first.numbers("MEAS:VOLT?")[0] > 1.9);
    let status = other.json(&["status"]);
    assert_eq!(status["is_in_use"], true, "{status}");
    assert_eq!(status["states"][0], "driving", "{status}");
    drop(second);
    let is_free = |bench: &Bench| bench.json(&["status"])["is_in_use"] == false;
    other.wait("it is kept without a client", is_free);
    assert!(other.is_off());
    first.is_content();
}

#[test]
fn a_tool_that_is_interrupted_turns_the_channels_off_and_one_on_the_network_says_so() {
    let mut serving = Serving::start();
    let _client = serving.driver();
    interrupt(&serving.tool);
    serving.wait_for_zero();
    assert_eq!(serving.tool.wait().expect("it ends").code(), Some(0));
    let words = ["serve", "--listen", "0.0.0.0:0", "--end-with-input"];
    let said = serving.bench.tool(&words);
    assert_eq!(said.code, 0, "its input has ended");
    assert!(
        said.sentence().contains("without a password"),
        "{}",
        said.err
    );
}

#[test]
fn a_port_that_is_taken_is_said() {
    let serving = Serving::start();
    let address = serving.address.to_string();
    let said: Said = serving.bench.tool(&["serve", "--listen", &address]);
    assert_eq!(said.code, 1);
    let sentence = said.sentence();
    assert!(
        sentence.contains(&format!("`{address}` cannot be listened on")),
        "{sentence}"
    );
    assert!(sentence.contains("port 0"), "{sentence}");
}

//! A page of `report` in Chromium, where `MIRROR_BROWSER` names one: it opens without a complaint, and its switches work. With
//! `MIRROR_WRITE_PAGES` the pictures of the book are written anew.

use std::ffi::{OsStr, OsString};
use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::{Child, Command, Stdio};

use serde_json::Value;

use crate::common::no_boards;
use crate::trial::{trial, written};
use crate::{lab, session};

/// What plays a reader.
const READER: &str = include_str!("browser.js");
/// Keeps a page from having loaded before it is ready, and a frame later.
const HOLD: &str = "
const image = new Image();
image.src = '/held';
(async () => {
  while (!document.body?.dataset.ready) await new Promise((go) => setTimeout(go, 20));
  requestAnimationFrame(() => requestAnimationFrame(() => fetch('/ready', { method: 'POST' })));
})();
";
/// A phone, a tablet, a screen.
const WIDTHS: [u32; 3] = [400, 800, 1280];
const HEIGHT: u32 = 1100;

/// A browser without a window, which ends with this.
struct Browser(Child);

impl Drop for Browser {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn browser(program: &OsStr, profile: &Path, words: &[&str]) -> Command {
    let mut command = Command::new(program);
    command
        .args([
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--hide-scrollbars",
        ])
        .arg(format!("--user-data-dir={}", profile.display()))
        .args(words)
        .stdout(Stdio::null())
        .stderr(Stdio::null());
    command
}

/// What a browser asks for.
struct Request {
    stream: TcpStream,
    /// Method and path.
    head: String,
    posted: Vec<u8>,
}

impl Request {
    /// The next one, passing over connections on which none comes.
    fn next(listener: &TcpListener) -> Self {
        loop {
            let (stream, _) = listener.accept().expect("a browser");
            if let Some(request) = Self::read(stream) {
                return request;
            }
        }
    }

    fn read(stream: TcpStream) -> Option<Self> {
        let mut reader = BufReader::new(stream.try_clone().expect("a socket"));
        let mut head = String::new();
        while reader.read_line(&mut head).is_ok_and(|read| read > 2) {}
        let length = head.lines().find_map(|line| {
            let (name, value) = line.split_once(':')?;
            name.eq_ignore_ascii_case("content-length")
                .then(|| value.trim().parse().ok())?
        });
        let mut posted = vec![0; length.unwrap_or(0)];
        reader.read_exact(&mut posted).ok()?;
        Some(Self {
            stream,
            head,
            posted,
        })
    }

    /// A browser that has gone meanwhile misses nothing.
    fn answer(mut self, body: &str) {
        let _ = write!(
            self.stream,
            "HTTP/1.1 200 OK\r\nContent-Type: text/html; charset=utf-8\r\nContent-Length: {}\r\nConnection: close\r\n\r\n{body}",
            body.len()
        );
    }
}

/// Hands out the page to whoever asks, until somebody posts what came of it.
fn serve(listener: &TcpListener, page: &str) -> Value {
    loop {
        let request = Request::next(listener);
        let said = serde_json::from_slice(&request.posted);
        let is_page = request.head.starts_with("GET / ");
        request.answer(if is_page { page } else { "" });
        if let Ok(said) = said {
            return said;
        }
    }
}

/// Hands out a page that says when it is ready, and keeps it from having loaded before.
fn serve_until_ready(listener: &TcpListener, page: &str) {
    let mut held = Vec::new();
    loop {
        let request = Request::next(listener);
        match request.head.split(' ').nth(1) {
            Some("/") => request.answer(page),
            Some("/held") => held.push(request),
            Some("/ready") => break,
            _ => request.answer(""),
        }
    }
    held.into_iter().for_each(|request| request.answer(""));
}

#[test]
fn a_page_lives_in_a_browser() {
    let Some(program): Option<OsString> = std::env::var_os("MIRROR_BROWSER") else {
        println!("MIRROR_BROWSER names no Chromium: not tried");
        return;
    };
    let place = no_boards();
    let path = place.path().join("report.html");
    let files = session("\"hysteresis\"");
    let trial = written(&trial(3.0, 0.03), place.path());
    let said = lab(&[
        "report",
        &files.to_string_lossy(),
        "--trial",
        &trial.to_string_lossy(),
        "-o",
        &path.to_string_lossy(),
    ]);
    assert_eq!(said.code, 0, "{}", said.err);
    let profile = place.path().join("profile");
    let page = fs::read_to_string(&path).expect("a page");
    if std::env::var_os("MIRROR_WRITE_PAGES").is_some() {
        pictures(&program, &profile, &page);
    }
    let played = page.replacen("<style>", &format!("<script>{READER}</script><style>"), 1);
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = format!("http://{}/", listener.local_addr().expect("an address"));
    let words = ["--remote-debugging-port=0", &address];
    let started = browser(&program, &profile, &words).spawn();
    let _browser = Browser(started.expect("MIRROR_BROWSER names a program"));
    let said = serve(&listener, &played);
    println!("{said:#}");

    assert_eq!(said["wrong"], Value::Array(vec![]), "errors on the console");
    assert_eq!(said["isSame"], "true", "the tool's numbers");
    assert_eq!(
        said["unnamed"], 0,
        "controls that a screen reader has no name for"
    );
    assert_eq!(
        said["overflows"], false,
        "the page is wider than its window"
    );
    let steps = said["steps"].as_array().expect("steps");
    assert_eq!(steps.len(), 4);
    let mut before = &said["first"];
    for step in steps {
        assert_eq!(step["isRedrawn"], true, "{step}");
        assert_ne!(step["error"], *before, "{step}");
        before = &step["error"];
    }
    // With nothing but what was fitted it is the error that the tool printed beside the model.
    let told = said["told"]
        .as_str()
        .expect("a number")
        .trim_matches(['(', ')']);
    assert_eq!(
        (&steps[1]["error"], &steps[3]["error"]),
        (&told.into(), &told.into())
    );
}

/// The page at three widths, for the book. A browser takes its picture once everything has loaded, an image among it that comes
/// when the page's code is ready.
fn pictures(program: &OsStr, profile: &Path, page: &str) {
    let page = page.replacen("<style>", &format!("<script>{HOLD}</script><style>"), 1);
    for width in WIDTHS {
        let picture = format!("../docs/pictures/report-{width}.png");
        let picture = Path::new(env!("CARGO_MANIFEST_DIR")).join(picture);
        let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
        let words = [
            format!("--screenshot={}", picture.display()),
            format!("--window-size={width},{HEIGHT}"),
            format!("http://{}/", listener.local_addr().expect("an address")),
        ];
        let words = words.each_ref().map(String::as_str);
        let started = browser(program, profile, &words).spawn();
        let mut browser = Browser(started.expect("MIRROR_BROWSER names a program"));
        serve_until_ready(&listener, &page);
        assert!(browser.0.wait().expect("it ends").success());
    }
}

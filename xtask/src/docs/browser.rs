//! A browser without a window, asked by the Chrome DevTools Protocol over a pipe
//! (<https://chromedevtools.github.io/devtools-protocol>).

use std::ffi::OsStr;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use anyhow::{Context, Result, bail};
use serde_json::{Value, json};

/// A Chromium reads questions from its file 3 and writes answers to its file 4, each ended by a zero byte.
const START: &str = r#"exec "$0" "$@" 3<&0 4>&1 </dev/null >/dev/null 2>&1"#;

/// A browser with one page, which ends with this.
pub(super) struct Browser {
    program: Child,
    to: ChildStdin,
    from: BufReader<ChildStdout>,
    asked: u64,
    session: Value,
    /// What pages complained of, and what they fetched that is no file.
    pub(super) complaints: Vec<String>,
    /// Pages that have loaded.
    loaded: usize,
}

impl Drop for Browser {
    fn drop(&mut self) {
        let _ = self.program.kill();
        let _ = self.program.wait();
    }
}

impl Browser {
    /// Starts `program`, which keeps what it remembers in `profile`.
    pub(super) fn start(program: &OsStr, profile: &Path) -> Result<Self> {
        let mut started = Command::new("sh")
            .args(["-c", START])
            .arg(program)
            .args(["--headless", "--no-sandbox", "--disable-gpu"])
            .args(["--remote-debugging-pipe", "about:blank"])
            .arg(format!("--user-data-dir={}", profile.display()))
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .with_context(|| format!("{} does not run", program.to_string_lossy()))?;
        let to = started.stdin.take().context("a pipe")?;
        let from = started.stdout.take().context("a pipe")?;
        let mut browser = Self {
            program: started,
            to,
            from: BufReader::new(from),
            asked: 0,
            session: Value::Null,
            complaints: Vec::new(),
            loaded: 0,
        };
        let target = browser.ask("Target.createTarget", json!({"url": "about:blank"}))?;
        let attach = json!({"targetId": target["targetId"], "flatten": true});
        browser.session = browser.ask("Target.attachToTarget", attach)?["sessionId"].take();
        for domain in ["Page", "Runtime", "Log", "Network"] {
            browser.ask(&format!("{domain}.enable"), json!({}))?;
        }
        Ok(browser)
    }

    /// Opens an address, and waits until it has loaded.
    pub(super) fn open(&mut self, address: &str) -> Result<()> {
        let before = self.loaded;
        let opened = self.ask("Page.navigate", json!({ "url": address }))?;
        if let Some(error) = opened["errorText"].as_str() {
            bail!("{address} does not open: {error}");
        }
        while self.loaded == before {
            let event = self.next()?;
            self.note(&event);
        }
        Ok(())
    }

    /// Types a word, key by key.
    pub(super) fn press(&mut self, keys: &str) -> Result<()> {
        for key in keys.chars() {
            let down = json!({"type": "keyDown", "key": key, "text": key});
            self.ask("Input.dispatchKeyEvent", down)?;
            let up = json!({"type": "keyUp", "key": key});
            self.ask("Input.dispatchKeyEvent", up)?;
        }
        Ok(())
    }

    /// The value of a JavaScript expression, waited for where it is a promise.
    pub(super) fn value(&mut self, expression: &str) -> Result<Value> {
        let evaluate =
            json!({"expression": expression, "awaitPromise": true, "returnByValue": true});
        let mut answer = self.ask("Runtime.evaluate", evaluate)?;
        if let Some(exception) = answer.get("exceptionDetails") {
            let said = &exception["exception"]["description"];
            bail!("the page answers: {}", said.as_str().unwrap_or(expression));
        }
        Ok(answer["result"]["value"].take())
    }

    fn ask(&mut self, method: &str, parameters: Value) -> Result<Value> {
        self.asked += 1;
        let mut question = json!({"id": self.asked, "method": method, "params": parameters});
        if !self.session.is_null() {
            question["sessionId"] = self.session.clone();
        }
        self.to.write_all(question.to_string().as_bytes())?;
        self.to.write_all(&[0])?;
        loop {
            let mut answer = self.next()?;
            if answer["id"] != self.asked {
                self.note(&answer);
            } else if let Some(error) = answer.get("error") {
                bail!("the browser refuses {method}: {error}");
            } else {
                return Ok(answer["result"].take());
            }
        }
    }

    fn next(&mut self) -> Result<Value> {
        let mut said = Vec::new();
        self.from.read_until(0, &mut said)?;
        if said.pop().is_none() {
            bail!("the browser has ended by itself");
        }
        Ok(serde_json::from_slice(&said)?)
    }

    fn note(&mut self, event: &Value) {
        let told = &event["params"];
        let complaint = match event["method"].as_str() {
            Some("Page.loadEventFired") => {
                self.loaded += 1;
                return;
            }
            Some("Runtime.exceptionThrown") => &told["exceptionDetails"],
            Some("Runtime.consoleAPICalled") if told["type"] == "error" => &told["args"],
            Some("Log.entryAdded") if told["entry"]["level"] == "error" => &told["entry"],
            Some("Network.requestWillBeSent") => {
                let address = &told["request"]["url"];
                let is_here = |address: &str| {
                    ["file:", "data:", "blob:"]
                        .iter()
                        .any(|here| address.starts_with(here))
                };
                match address.as_str() {
                    Some(text) if !is_here(text) => address,
                    _ => return,
                }
            }
            _ => return,
        };
        self.complaints.push(complaint.to_string());
    }
}

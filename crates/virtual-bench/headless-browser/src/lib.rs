//! A browser without a window, in which tests look at pages as their readers do. It is asked by the Chrome DevTools Protocol over a pipe
//! (<https://chromedevtools.github.io/devtools-protocol>).

use std::ffi::OsStr;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use anyhow::{Context, Result, bail, ensure};
use serde_json::{Value, json};

/// A Chromium reads questions from its file 3 and writes answers to its file 4, each ended by a zero byte.
const START: &str = r#"exec "$0" "$@" 3<&0 4>&1 </dev/null >/dev/null 2>&1"#;

/// A browser with one page, which ends with this.
pub struct Browser {
    program: Child,
    to: ChildStdin,
    from: BufReader<ChildStdout>,
    asked: u64,
    session: Value,
    /// What pages complained of, and what they fetched that is no file.
    pub complaints: Vec<String>,
    /// Pages that have loaded.
    loaded: usize,
}

/// A key.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Key {
    /// To the next control.
    Tab,
    /// Turns a switch.
    Space,
    /// Moves a slider.
    Right,
}

impl Drop for Browser {
    fn drop(&mut self) {
        let _ = self.program.kill();
        let _ = self.program.wait();
    }
}

impl Browser {
    /// Starts `program`, a Chromium, which keeps what it remembers in `profile`.
    ///
    /// # Errors
    /// Where it does not run, or answers otherwise than a Chromium.
    pub fn start(program: &OsStr, profile: &Path) -> Result<Self> {
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
    ///
    /// # Errors
    /// Where it does not open.
    pub fn open(&mut self, address: &str) -> Result<()> {
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

    /// Opens a file.
    ///
    /// # Errors
    /// Where it does not open, or its path has what an address would have to escape.
    pub fn open_file(&mut self, file: &Path) -> Result<()> {
        let path = file.canonicalize()?;
        let path = path.to_string_lossy();
        let is_plain = |c: char| c.is_ascii_graphic() && !matches!(c, '%' | '?' | '#');
        ensure!(
            path.chars().all(is_plain),
            "{path} cannot be written as an address; take another folder"
        );
        self.open(&format!("file://{path}"))
    }

    /// Waits until a condition holds, for 60 s: of a machine that is busy with other tests.
    ///
    /// # Errors
    /// Where it does not come to hold.
    pub fn wait_until(&mut self, condition: &str) -> Result<()> {
        self.value(&format!(
            "new Promise((done, fail) => {{
               const end = performance.now() + 60_000;
               const look = () => {condition} ? done() : performance.now() > end ? fail(new Error({condition:?})) : setTimeout(look, 5);
               look();
             }})"
        ))?;
        Ok(())
    }

    /// Types a word, key by key.
    ///
    /// # Errors
    /// Where the browser has ended.
    pub fn types(&mut self, word: &str) -> Result<()> {
        for key in word.chars() {
            self.strike(json!({"key": key, "text": key}))?;
        }
        Ok(())
    }

    /// Presses a key that types nothing or a blank, which has a name and a number
    /// (<https://www.w3.org/TR/uievents-code>; the numbers are those of Windows).
    ///
    /// # Errors
    /// Where the browser has ended.
    pub fn press(&mut self, key: Key) -> Result<()> {
        let (name, number, text) = match key {
            Key::Tab => ("Tab", 9, ""),
            Key::Space => ("Space", 32, " "),
            Key::Right => ("ArrowRight", 39, ""),
        };
        let key = if text.is_empty() { name } else { text };
        self.strike(
            json!({"key": key, "code": name, "windowsVirtualKeyCode": number, "text": text}),
        )
    }

    fn strike(&mut self, key: Value) -> Result<()> {
        for kind in ["keyDown", "keyUp"] {
            let mut event = key.clone();
            event["type"] = kind.into();
            if kind == "keyUp" {
                event["text"] = "".into();
            }
            self.ask("Input.dispatchKeyEvent", event)?;
        }
        Ok(())
    }

    /// The value of a JavaScript expression, waited for where it is a promise.
    ///
    /// # Errors
    /// What it throws.
    pub fn value(&mut self, expression: &str) -> Result<Value> {
        let evaluate =
            json!({"expression": expression, "awaitPromise": true, "returnByValue": true});
        let mut answer = self.ask("Runtime.evaluate", evaluate)?;
        if let Some(exception) = answer.get("exceptionDetails") {
            let said = &exception["exception"]["description"];
            bail!("the page answers: {}", said.as_str().unwrap_or(expression));
        }
        Ok(answer["result"]["value"].take())
    }

    /// Asks for whatever the protocol has.
    ///
    /// # Errors
    /// Where the browser refuses it.
    pub fn ask(&mut self, method: &str, parameters: Value) -> Result<Value> {
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

//! A browser for tests of pages: headless Chromium spoken to in its DevTools protocol over one web socket. It runs scripts
//! on a page and collects all that went wrong there.

use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// Names under which the browser is installed.
const NAMES: [&str; 4] = ["chromium", "chromium-browser", "google-chrome", "chrome"];
const PATIENCE: Duration = Duration::from_secs(60);

/// A page in a browser of its own, which ends with it.
pub struct Browser {
    child: Child,
    socket: BufReader<TcpStream>,
    session: Value,
    n_sent: u64,
    /// Errors, exceptions and warnings of the page, and what it wanted from the network.
    pub problems: Vec<String>,
    has_loaded: bool,
    _profile: tempfile::TempDir,
}

impl Browser {
    /// Opens the file in a window of `size` px; `None`, with a loud line, where no browser is installed.
    pub fn open(page: &Path, size: [u32; 2]) -> Option<Self> {
        let profile = tempfile::tempdir().unwrap();
        let Some(child) = NAMES.iter().find_map(|name| start(name, profile.path())) else {
            eprintln!("SKIPPED: no browser is installed (package chromium): the page was not opened");
            return None;
        };
        let socket = connect(profile.path());
        let (session, problems) = (Value::Null, Vec::new());
        let mut browser = Self { child, socket, session, n_sent: 0, problems, has_loaded: false, _profile: profile };
        let target = browser.call("Target.createTarget", json!({ "url": "about:blank" }));
        let attach = json!({ "targetId": target["targetId"], "flatten": true });
        browser.session = browser.call("Target.attachToTarget", attach)["sessionId"].clone();
        for domain in ["Page", "Runtime", "Log", "Network"] {
            browser.call(&format!("{domain}.enable"), json!({}));
        }
        browser.resize(size);
        browser.has_loaded = false;
        let address = format!("file://{}", page.canonicalize().unwrap().display());
        browser.call("Page.navigate", json!({ "url": address }));
        while !browser.has_loaded {
            browser.hear();
        }
        Some(browser)
    }

    /// Another window size.
    pub fn resize(&mut self, [width, height]: [u32; 2]) {
        let metrics = json!({ "width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 600 });
        self.call("Emulation.setDeviceMetricsOverride", metrics);
    }

    /// Dark or light, as the page is asked for.
    pub fn colours(&mut self, scheme: &str) {
        let features = json!([{ "name": "prefers-color-scheme", "value": scheme }]);
        self.call("Emulation.setEmulatedMedia", json!({ "features": features }));
    }

    /// The value of an expression on the page.
    pub fn value(&mut self, script: &str) -> Value {
        let answer = self.call("Runtime.evaluate", json!({ "expression": script, "returnByValue": true }));
        assert!(answer["exceptionDetails"].is_null(), "{script}: {answer}");
        answer["result"]["value"].clone()
    }

    /// A key pressed and released.
    pub fn press(&mut self, key: &str) {
        for kind in ["keyDown", "keyUp"] {
            self.call("Input.dispatchKeyEvent", json!({ "type": kind, "key": key, "code": key }));
        }
    }

    /// Sends a command and waits for its answer; what else is told meanwhile is noted.
    fn call(&mut self, method: &str, params: Value) -> Value {
        self.n_sent += 1;
        let mut message = json!({ "id": self.n_sent, "method": method, "params": params });
        if !self.session.is_null() {
            message["sessionId"] = self.session.clone();
        }
        send(self.socket.get_mut(), message.to_string().as_bytes());
        loop {
            let heard = self.hear();
            if heard["id"] == self.n_sent {
                assert!(heard["error"].is_null(), "{method}: {heard}");
                return heard["result"].clone();
            }
        }
    }

    /// The next message, noted.
    fn hear(&mut self) -> Value {
        let message: Value = serde_json::from_slice(&receive(&mut self.socket)).unwrap();
        let params = &message["params"];
        match message["method"].as_str().unwrap_or_default() {
            "Page.loadEventFired" => self.has_loaded = true,
            "Runtime.exceptionThrown" => self.problems.push(params["exceptionDetails"].to_string()),
            "Runtime.consoleAPICalled" => self.problems.push(params["args"].to_string()),
            "Log.entryAdded" => self.problems.push(params["entry"]["text"].to_string()),
            "Network.requestWillBeSent" => {
                let address = params["request"]["url"].as_str().unwrap_or_default();
                if !["file:", "data:", "about:"].iter().any(|local| address.starts_with(local)) {
                    self.problems.push(format!("it wants {address}"));
                }
            }
            _ => {}
        }
        message
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        let close = json!({ "id": 0, "method": "Browser.close" }).to_string();
        send(self.socket.get_mut(), close.as_bytes());
        let until = Instant::now() + Duration::from_secs(5);
        while Instant::now() < until {
            if let Ok(Some(_)) = self.child.try_wait() {
                return;
            }
            std::thread::sleep(Duration::from_millis(20));
        }
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn start(name: &str, profile: &Path) -> Option<Child> {
    let mut command = Command::new(name);
    command.args(["--headless=new", "--no-sandbox", "--disable-gpu", "--remote-debugging-port=0", "--no-first-run"]);
    command.args(["--disable-background-networking", "--disable-component-update", "--disable-dev-shm-usage"]);
    command.arg(format!("--user-data-dir={}", profile.display())).arg("about:blank");
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).spawn().ok()
}

/// Connects to the port that the browser writes into its profile.
fn connect(profile: &Path) -> BufReader<TcpStream> {
    let until = Instant::now() + PATIENCE;
    let told = loop {
        let told = std::fs::read_to_string(profile.join("DevToolsActivePort")).unwrap_or_default();
        if told.lines().count() == 2 {
            break told;
        }
        assert!(Instant::now() < until, "the browser does not start");
        std::thread::sleep(Duration::from_millis(20));
    };
    let (port, place) = told.split_once('\n').unwrap();
    let mut stream = TcpStream::connect(("127.0.0.1", port.parse().unwrap())).unwrap();
    stream.set_read_timeout(Some(PATIENCE)).unwrap();
    // RFC 6455, section 4.1; the key is the one of its example
    let request = format!(
        "GET {} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n\
         Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n\r\n",
        place.trim()
    );
    stream.write_all(request.as_bytes()).unwrap();
    let mut reader = BufReader::new(stream);
    let mut line = String::new();
    reader.read_line(&mut line).unwrap();
    assert!(line.contains("101"), "no web socket: {line}");
    while line != "\r\n" {
        line.clear();
        reader.read_line(&mut line).unwrap();
    }
    reader
}

/// One text frame (RFC 6455, section 5.2), masked with zeros.
fn send(stream: &mut TcpStream, text: &[u8]) {
    let mut frame = vec![0x81];
    match text.len() {
        n @ 0..126 => frame.push(0x80 | n as u8),
        n @ 126..=0xffff => {
            frame.push(0x80 | 126);
            frame.extend((n as u16).to_be_bytes());
        }
        n => {
            frame.push(0x80 | 127);
            frame.extend((n as u64).to_be_bytes());
        }
    }
    frame.extend([0; 4]);
    frame.extend(text);
    let _ = stream.write_all(&frame);
}

/// The next whole message.
fn receive(stream: &mut BufReader<TcpStream>) -> Vec<u8> {
    let mut message = Vec::new();
    loop {
        let mut head = [0; 2];
        stream.read_exact(&mut head).expect("the browser answers");
        let n = match head[1] & 0x7f {
            126 => {
                let mut long = [0; 2];
                stream.read_exact(&mut long).unwrap();
                u64::from(u16::from_be_bytes(long))
            }
            127 => {
                let mut long = [0; 8];
                stream.read_exact(&mut long).unwrap();
                u64::from_be_bytes(long)
            }
            n => u64::from(n),
        };
        let mut part = vec![0; n as usize];
        stream.read_exact(&mut part).unwrap();
        let is_text = head[0] & 0x0f <= 2;
        if is_text {
            message.extend(part);
        }
        if is_text && head[0] & 0x80 != 0 {
            return message;
        }
    }
}

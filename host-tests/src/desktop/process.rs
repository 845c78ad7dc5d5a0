//! Building, starting and ending the program.

use super::client::Client;
use super::web::Web;
use std::io::{BufRead, BufReader};
use std::net::{Ipv4Addr, SocketAddr, SocketAddrV4};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::sync::atomic::{AtomicU8, Ordering};
use std::sync::{Arc, Mutex, OnceLock};
use std::time::{Duration, Instant};
use std::{env, fs, process, thread};

/// The port of Line-us, which its clients do not let one choose.
pub const PORT: u16 = 1337;
/// The port of its page.
pub const WEB_PORT: u16 = 8080;
/// For what takes milliseconds on an idle computer.
const PATIENCE: Duration = Duration::from_secs(30);

/// Where cargo builds, `target` as a rule: two folders above the test that is running.
pub fn target_folder() -> PathBuf {
    profile_folder()
        .parent()
        .expect("a profile's folder lies in the target folder")
        .into()
}

fn profile_folder() -> PathBuf {
    let test = env::current_exe().expect("a running test has a file");
    let folder = test
        .parent()
        .expect("a file lies in a folder")
        .to_path_buf();
    match folder.ends_with("deps") {
        true => folder.parent().expect("deps lies in a folder").into(),
        false => folder,
    }
}

/// The desktop arm's program, built once with the profile of the test that is running.
///
/// # Panics
/// When it does not build.
pub fn binary() -> &'static Path {
    static BINARY: OnceLock<PathBuf> = OnceLock::new();
    BINARY.get_or_init(|| {
        let folder = profile_folder();
        let profile = match folder.file_name().and_then(|name| name.to_str()) {
            Some("debug") => "dev",
            Some(profile) => profile,
            None => "dev",
        };
        let built = Command::new(env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
            .current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
            .args([
                "build",
                "--quiet",
                "--package",
                "firmware",
                "--bin",
                "desktop",
            ])
            .args(["--profile", profile, "--target-dir"])
            .arg(target_folder())
            .status()
            .expect("cargo can be started");
        assert!(built.success(), "the desktop arm does not build");
        folder.join(format!("desktop{}", env::consts::EXE_SUFFIX))
    })
}

/// An address that no other arm of this computer's tests is likely to use.
pub fn own_address() -> SocketAddr {
    static NEXT: AtomicU8 = AtomicU8::new(1);
    let [_, .., high, low] = process::id().to_be_bytes();
    // 127.0 and 127.1 are what people and other programs use.
    let network = 2 + high % 250;
    let host = NEXT.fetch_add(1, Ordering::Relaxed);
    SocketAddrV4::new(Ipv4Addr::new(127, network, low, host), PORT).into()
}

/// A running desktop arm; it is killed when this is dropped.
pub struct Desktop {
    child: Child,
    address: SocketAddr,
    picture: PathBuf,
    log: Arc<Mutex<Vec<String>>>,
}

impl Desktop {
    /// Starts an arm that keeps its state and its picture in `folder`, and waits until it is ready.
    ///
    /// # Panics
    /// When it does not start.
    pub fn start(folder: &Path, arguments: &[&str]) -> Self {
        Self::start_with_picture(folder, "picture.svg", arguments)
    }

    /// The same with another name for the picture.
    ///
    /// # Panics
    /// When it does not start.
    pub fn start_with_picture(folder: &Path, picture: &str, arguments: &[&str]) -> Self {
        // An address may be taken after all.
        for _ in 0..3 {
            if let Some(arm) = Self::try_start(folder, picture, arguments) {
                return arm;
            }
        }
        panic!("the desktop arm does not start with {arguments:?}: it says why above");
    }

    fn try_start(folder: &Path, picture: &str, arguments: &[&str]) -> Option<Self> {
        let address = own_address();
        let picture = folder.join(picture);
        let mut child = Command::new(binary())
            .arg("--line-us")
            .arg(address.to_string())
            .arg("--web")
            .arg(SocketAddr::new(address.ip(), WEB_PORT).to_string())
            .arg("--state")
            .arg(folder.join("state"))
            .arg("--picture")
            .arg(&picture)
            .args(arguments)
            .stdout(Stdio::piped())
            .spawn()
            .expect("the desktop arm's program can be started");
        let log = Arc::new(Mutex::new(Vec::new()));
        let lines = BufReader::new(child.stdout.take().expect("stdout is piped")).lines();
        let writer = log.clone();
        thread::spawn(move || {
            for line in lines.map_while(Result::ok) {
                writer.lock().expect("no test dies with the log").push(line);
            }
        });
        let mut arm = Self {
            child,
            address,
            picture,
            log,
        };
        let deadline = Instant::now() + PATIENCE;
        while !arm.said("stop with Ctrl-C") {
            if arm.child.try_wait().is_ok_and(|ended| ended.is_some()) {
                return None;
            }
            assert!(Instant::now() < deadline, "the desktop arm is never ready");
            thread::sleep(Duration::from_millis(2));
        }
        Some(arm)
    }

    /// Where it listens.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Where its page is.
    pub fn web(&self) -> Web {
        Web::at(SocketAddr::new(self.address.ip(), WEB_PORT))
    }

    /// Its picture.
    pub fn picture(&self) -> &Path {
        &self.picture
    }

    /// A client that has connected, and has not read the greeting.
    pub fn connect(&self) -> Client {
        Client::connect(self.address)
    }

    /// A client that has read the greeting.
    pub fn client(&self) -> Client {
        let mut client = self.connect();
        let hello = client.reply();
        assert!(hello.starts_with("hello "), "greeted with {hello:?}");
        client
    }

    /// Whether it has printed a line that contains `text`.
    pub fn said(&self, text: &str) -> bool {
        let log = self.log.lock().expect("the log's thread lives");
        log.iter().any(|line| line.contains(text))
    }

    /// How many of the lines that it has printed contain `text`.
    pub fn count(&self, text: &str) -> usize {
        let log = self.log.lock().expect("the log's thread lives");
        log.iter().filter(|line| line.contains(text)).count()
    }

    /// Waits until `count` clients have left, as it prints.
    ///
    /// # Panics
    /// When they do not.
    pub fn wait_for_leavers(&self, count: usize) {
        wait_until(&format!("{count} clients to leave"), || {
            let log = self.log.lock().expect("the log's thread lives");
            log.iter().filter(|line| line.ends_with(" left")).count() >= count
        });
    }

    /// The program that it is by now.
    ///
    /// # Panics
    /// When it has ended.
    pub fn program(&self) -> PathBuf {
        fs::read_link(format!("/proc/{}/exe", self.child.id())).expect("the arm is running")
    }

    /// Waits until it has said a line with `text` for the `count`th time.
    ///
    /// # Panics
    /// When it does not.
    pub fn wait_to_say(&self, text: &str, count: usize) {
        wait_until(&format!("{text:?}, {count} times"), || {
            self.count(text) >= count
        });
    }

    /// Kilobytes of memory in use.
    pub fn memory_kb(&self) -> u64 {
        memory_kb(self.child.id(), "VmRSS:").expect("the arm is running")
    }

    /// Ends it as Ctrl-C does, and waits.
    ///
    /// # Panics
    /// When it does not end, or not well.
    pub fn stop(mut self) {
        let pid = self.child.id().to_string();
        let told = Command::new("kill").args(["-INT", &pid]).status();
        assert!(
            told.is_ok_and(|status| status.success()),
            "kill -INT {pid} fails"
        );
        let ended = self.child.wait().expect("the arm can be waited for");
        assert!(ended.success(), "the arm ended with {ended}");
    }

    /// Ends it as a power cut does: `kill -9`.
    pub fn cut_power(mut self) {
        self.end();
    }

    fn end(&mut self) {
        // It may have ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Drop for Desktop {
    fn drop(&mut self) {
        self.end();
        if thread::panicking() {
            let log = self.log.lock().map(|log| log.join("\n"));
            eprintln!("The arm said:\n{}", log.unwrap_or_default());
        }
    }
}

/// A line of `/proc/PID/status` in kilobytes, `None` when the process has ended.
fn memory_kb(pid: u32, line: &str) -> Option<u64> {
    let status = fs::read_to_string(format!("/proc/{pid}/status")).ok()?;
    let rest = status.lines().find_map(|text| text.strip_prefix(line))?;
    rest.trim().trim_end_matches(" kB").parse().ok()
}

/// Waits for something that comes soon.
///
/// # Panics
/// When it does not come.
pub fn wait_until(what: &str, mut done: impl FnMut() -> bool) {
    let deadline = Instant::now() + PATIENCE;
    while !done() {
        assert!(Instant::now() < deadline, "waited in vain for {what}");
        thread::sleep(Duration::from_millis(5));
    }
}

/// What `draw` did.
pub struct Run {
    /// 0 when every line was accepted.
    pub status: i32,
    /// The summary.
    pub stdout: String,
    /// The refused lines.
    pub stderr: String,
    /// Most memory it ever used, in kilobytes.
    pub peak_kb: u64,
}

impl Run {
    /// What stands behind `field` in the summary.
    ///
    /// # Panics
    /// When it is not there.
    pub fn field(&self, field: &str) -> &str {
        self.stdout
            .lines()
            .find_map(|line| line.strip_prefix(field))
            .unwrap_or_else(|| panic!("no {field:?} in the summary:\n{}", self.stdout))
            .trim()
    }
}

/// Draws a file with `desktop draw` and the arguments.
///
/// # Panics
/// When the program cannot be started.
pub fn draw(file: &Path, arguments: &[&str]) -> Run {
    let child = Command::new(binary())
        .arg("draw")
        .arg(file)
        .args(arguments)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the desktop arm's program can be started");
    let pid = child.id();
    let watch = thread::spawn(move || {
        let mut peak = 0;
        // Its peak only grows, so the last look is the best; after its end there is nothing to see.
        while let Some(now) = memory_kb(pid, "VmHWM:") {
            peak = now;
            thread::sleep(Duration::from_millis(10));
        }
        peak
    });
    let Output {
        status,
        stdout,
        stderr,
    } = child.wait_with_output().expect("draw can be waited for");
    let text = |bytes: Vec<u8>| String::from_utf8_lossy(&bytes).into_owned();
    Run {
        status: status.code().unwrap_or(-1),
        stdout: text(stdout),
        stderr: text(stderr),
        peak_kb: watch.join().expect("watching does not fail"),
    }
}

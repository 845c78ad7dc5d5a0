//! The emulated machine updates itself over its network from one build to another, stays there if that works,
//! and is back if it does not. The emulator's driver is bootloader and watchdog.

use host_tests::desktop::{Client, WEB_PORT, Web, own_address};
use host_tests::web_server::serve;
use protocol_core::update::Version;
use std::fs;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::thread;
use std::time::Duration;
use tempfile::TempDir;
use xtask::board::root;
use xtask::emulator::{Emulator, Options, RESTART, Time};
use xtask::{release, slots};

const PATIENCE: Duration = Duration::from_secs(120);
/// The version that `cargo xtask test` builds the other firmware as.
const NEW: &str = "9.0.0";

fn firmware(variable: &str) -> PathBuf {
    let file = std::env::var_os(variable);
    PathBuf::from(file.unwrap_or_else(|| {
        panic!("{variable} names a firmware: run these tests with `cargo xtask test`")
    }))
}

/// A machine with its disk, and a server with a newer firmware.
struct Bench {
    folder: TempDir,
    address: SocketAddr,
    web: SocketAddr,
    port: u16,
}

impl Bench {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let served = folder.path().join("served");
        let image = slots::flatten(&firmware("QUILL_VIRT_UPDATE")).unwrap();
        let key = release::read_key(&root().join(release::DEVELOPMENT_KEY)).unwrap();
        let version = Version::parse(NEW).unwrap();
        release::release("virt", version, &image, &key, &served).unwrap();
        let address = own_address();
        Self {
            address,
            web: SocketAddr::new(address.ip(), WEB_PORT),
            port: serve(move |name| fs::read(served.join(name)).ok()),
            folder,
        }
    }

    /// Switches the machine on.
    fn boot(&self) -> Emulator {
        let options = Options {
            line_us: self.address,
            flash: self.folder.path().join("flash"),
            time: Time::Wall,
            serial: None,
            web: Some(self.web),
        };
        Emulator::boot(&firmware("QUILL_VIRT_FIRMWARE"), &options).unwrap()
    }

    /// Switches the machine on, and waits until it can be used.
    fn start(&self) -> (Emulator, Client) {
        let mut emulator = self.boot();
        emulator.wait_for_line("Line-us clients", PATIENCE).unwrap();
        let mut client = Client::connect(self.address);
        let greeting = client.reply();
        assert!(greeting.starts_with("hello VERSION:"), "{greeting:?}");
        (emulator, client)
    }

    fn tell_address(&self, client: &mut Client) {
        let address = format!("http://10.0.2.2:{}/virt.txt", self.port);
        assert_eq!(client.say(&format!("M997 S\"{address}\"")), "ok ");
    }

    /// Updates the machine from the server, and waits until it has switched itself off.
    fn update_from_server(&self) {
        let (mut emulator, mut client) = self.start();
        assert!(!is_new(&mut client));
        self.tell_address(&mut client);
        assert_eq!(
            client.say("M997"),
            format!("ok INFO:\"{NEW} is in place and starts now\"")
        );
        let status = emulator.wait_off(PATIENCE).unwrap();
        assert_eq!(status.code(), Some(RESTART));
    }

    /// The same from a file, as a page hands it over: first one that is not what was signed.
    fn update_from_file(&self) {
        let (mut emulator, mut client) = self.start();
        assert!(!is_new(&mut client));
        let file = format!("served/quill-{NEW}-virt.update");
        let good = fs::read(self.folder.path().join(file)).unwrap();
        let mut wrong = good.clone();
        *wrong.last_mut().unwrap() ^= 1;
        let send = |file: &[u8]| Web::at(self.web).request("POST", "/api/update", "", file);
        let answer = send(&wrong);
        assert_eq!(answer.error(), (422, "refused_update".into()));
        assert_eq!(
            told(&mut client),
            "refused: the image is not the signed one"
        );
        let answer = send(&good);
        assert_eq!(
            (answer.status, &answer.json()["version"]),
            (200, &NEW.into())
        );
        let status = emulator.wait_off(PATIENCE).unwrap();
        assert_eq!(status.code(), Some(RESTART));
    }
}

fn is_new(client: &mut Client) -> bool {
    let reply = client.say("M122");
    assert!(reply.contains(" UpdateKey:development"), "{reply}");
    reply.contains(&format!("Quill {NEW}\""))
}

/// What M122 says of updates.
fn told(client: &mut Client) -> String {
    let reply = client.say("M122");
    let (_, told) = reply.split_once("Update:\"").unwrap();
    told.split('"').next().unwrap().to_owned()
}

#[test]
fn a_new_firmware_that_hangs_three_times_is_gone() {
    let bench = Bench::new();
    bench.update_from_server();
    for _ in 0..3 {
        let mut emulator = bench.boot();
        emulator.wait_for_line("Line-us clients", PATIENCE).unwrap();
        emulator.say("hang").unwrap();
        emulator
            .wait_for_line("asked for a hang", PATIENCE)
            .unwrap();
        // Here the watchdog bites.
    }
    let mut emulator = bench.boot();
    emulator
        .wait_for_line("back to the old one", PATIENCE)
        .unwrap();
    let status = emulator.wait_off(PATIENCE).unwrap();
    assert_eq!(status.code(), Some(RESTART));
    let (_emulator, mut client) = bench.start();
    assert!(!is_new(&mut client));
    assert_eq!(
        told(&mut client),
        format!("{NEW} did not confirm itself, back to this one")
    );
}

#[test]
fn a_new_firmware_that_works_stays() {
    let bench = Bench::new();
    bench.update_from_file();
    let (emulator, mut client) = bench.start();
    assert!(is_new(&mut client));
    // Ten good seconds, and some for a busy computer.
    let mut trial = told(&mut client);
    for _ in 0..600 {
        if trial == "none" {
            break;
        }
        assert_eq!(trial, "on trial, start 1 of 3");
        thread::sleep(Duration::from_millis(100));
        trial = told(&mut client);
    }
    assert_eq!(trial, "none");
    drop(emulator);
    for _ in 0..4 {
        let (_emulator, mut client) = bench.start();
        assert!(is_new(&mut client));
        assert_eq!(told(&mut client), "none");
    }
    // What runs already is not loaded again.
    let (_emulator, mut client) = bench.start();
    bench.tell_address(&mut client);
    assert_eq!(
        client.say("M997"),
        format!("error INFO:\"{NEW} is what runs already\"")
    );
}

//! Firmware that does not work is gone after its trial.

use super::{Bench, NEW, READY, told};
use crate::release::Release;
use firmware::boards::desktop::bootloader::Reset;
use host_tests::desktop::{Client, binary, own_address, wait_until};
use protocol_core::update::{BootChoice, ENTRY, PAGE, Slot};
use std::fs::{self, Permissions};
use std::io::{BufRead, BufReader, ErrorKind, Write};
use std::os::fd::OwnedFd;
use std::os::unix::fs::PermissionsExt;
use std::os::unix::net::UnixStream;
use std::process::{Child, Command, Stdio};

/// A process that ends with its test.
struct Killed(Child);

impl Drop for Killed {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// The slot that starts.
fn chosen(bench: &Bench) -> Slot {
    let choice = fs::read(bench.slot("choice")).expect("there is a choice");
    let entry = |at: usize| choice[at..at + ENTRY].try_into().expect("its length");
    BootChoice::read(&entry(0), &entry(PAGE as usize)).slot()
}

fn back() -> String {
    format!("{NEW} did not confirm itself, back to this one")
}

#[test]
fn three_cuts_of_power_during_the_trial_and_the_old_one_is_back() {
    let bench = Bench::new();
    let arm = bench.update(Release::script(""));
    arm.wait_to_say(READY, 2);
    assert_eq!(told(&mut arm.client()), "on trial, start 1 of 3");
    arm.cut_power();
    for start in 2..=3 {
        let arm = bench.start(&[]);
        assert!(arm.said("firmware second of "));
        let trial = format!("on trial, start {start} of 3");
        assert_eq!(told(&mut arm.client()), trial);
        arm.cut_power();
    }
    let arm = bench.start(&[]);
    assert!(arm.said("back to the old one") && arm.said("firmware first of "));
    assert_eq!(told(&mut arm.client()), back());
    arm.cut_power();
    let arm = bench.start(&[]);
    assert!(!arm.said("second"));
    assert_eq!(told(&mut arm.client()), back());
}

/// An image that is the arm's program with one more argument. What is started after it is the program without.
fn with(argument: &str, bench: &Bench) -> Release {
    let (program, built) = (binary().display(), bench.path().join("built"));
    let without = format!("#!/bin/sh\nshift\nexec '{program}' \"$@\"\n");
    fs::write(&built, without).expect("a file can be written");
    fs::set_permissions(&built, Permissions::from_mode(0o700)).expect("it is a file of ours");
    let built = built.display();
    Release::of(format!(
        "#!/bin/sh\nQUILL_BUILT='{built}' exec '{program}' '{argument}' \"$@\"\n"
    ))
}

#[test]
fn a_firmware_that_ends_with_an_error_three_times_is_gone_without_a_hand() {
    // A file that is not there, an option that it does not know.
    for argument in ["--air=/nowhere/at/all", "--no-such-option"] {
        let bench = Bench::new();
        let arm = bench.update(with(argument, &bench));
        arm.wait_to_say(READY, 2);
        assert_eq!(arm.count("back to the old one"), 1, "{argument}");
        assert_eq!(arm.count("firmware first of "), 2, "{argument}");
        let mut client = arm.client();
        assert_eq!(told(&mut client), back(), "{argument}");
    }
}

/// Nobody takes what it prints, so it hangs with its first line.
#[test]
fn a_firmware_that_hangs_three_times_is_gone_without_a_hand() {
    let bench = Bench::new();
    let arm = bench.update(Release::script(""));
    arm.wait_to_say(READY, 2);
    arm.cut_power();

    let (here, mut there) = UnixStream::pair().expect("there are sockets");
    there.set_nonblocking(true).expect("sockets have options");
    let full = loop {
        if let Err(error) = there.write(b"\n") {
            break error.kind();
        }
    };
    assert_eq!(full, ErrorKind::WouldBlock);
    there.set_nonblocking(false).expect("sockets have options");
    let address = own_address();
    let child = Command::new(binary())
        .args(["--line-us", &address.to_string(), "--web", "none"])
        // Its patience is shorter then: a second.
        .args(["--speed", "20", "--firmware"])
        .arg(bench.slot(""))
        .arg("--state")
        .arg(bench.path().join("state"))
        .arg("--picture")
        .arg(bench.path().join("picture.svg"))
        .stdout(Stdio::from(OwnedFd::from(there)))
        .spawn()
        .expect("the desktop arm's program can be started");
    let arm = Killed(child);
    // The second start and the third; the fourth finds that it has to go back, and hangs as it says so.
    wait_until("the end of the trial", || chosen(&bench) == Slot::First);
    let environment = fs::read(format!("/proc/{}/environ", arm.0.id()));
    let environment = environment.expect("the arm is running");
    let reset = format!("QUILL_RESET={}", Reset::Watchdog.name());
    assert!(
        environment
            .split(|byte| *byte == 0)
            .any(|variable| variable == reset.as_bytes())
    );
    // Now somebody listens.
    let mut said = BufReader::new(here).lines().map_while(Result::ok);
    for words in ["back to the old one", "firmware first of ", READY] {
        assert!(
            said.any(|line| line.contains(words)),
            "it does not say {words:?}"
        );
    }
    let mut client = Client::connect(address);
    client.reply();
    assert_eq!(told(&mut client), back());
}

#[test]
fn an_image_that_is_no_program_is_passed_over_and_given_up() {
    let bench = Bench::new();
    let trap = bench.path().join("trap");
    // No shell gets it, either.
    let image = format!("touch '{}'\n", trap.display());
    let arm = bench.update(Release::of(image));
    arm.wait_to_say(READY, 2);
    assert_eq!(arm.count("second: Exec format error"), 1);
    assert_eq!(arm.count("firmware first of "), 2);
    assert_eq!(chosen(&bench), Slot::First);
    assert!(!trap.exists());
    assert_eq!(told(&mut arm.client()), back());
    arm.cut_power();
    let arm = bench.start(&[]);
    assert!(!arm.said("second"));
    assert_eq!(told(&mut arm.client()), back());
}

//! The arm is found by name, by programs that others have written: the official Python client without an
//! address, zeroconf, and dnspython, which knows nothing of multicast. In setup it is found under every name.

use core::net::{Ipv4Addr, SocketAddr};
use edge_nal_std::Stack;
use embassy_futures::block_on;
use firmware::services::names;
use host_tests::desktop::binary;
use host_tests::python::{client, python, run};
use std::path::PathBuf;
use std::process::Command;
use std::thread;

fn environment() -> PathBuf {
    python("lineus-found", &["lineus==1.0.3", "dnspython==2.8.0"])
}

/// A network of its own, where that can be had: nothing is said to others, and no other arm answers.
fn alone(python: PathBuf) -> Command {
    let unshare = ["--user", "--map-root-user", "--net"];
    let can_be_had = Command::new("unshare").args(unshare).arg("true").status();
    if can_be_had.is_ok_and(|status| status.success()) {
        let mut command = Command::new("unshare");
        command.args(unshare).arg(python);
        return command;
    }
    println!("without a network of its own: arms beside this test's may disturb it");
    Command::new(python)
}

#[test]
fn clients_find_the_arm_without_an_address() {
    let folder = tempfile::tempdir().expect("there is room for a folder");
    run(alone(environment())
        .arg(client("found.py"))
        .arg(binary())
        .arg(folder.path()));
}

#[test]
fn in_setup_a_resolver_finds_the_machine_under_every_name() {
    let python = environment();
    // Free for a moment, and so most likely for the next one.
    let probe = std::net::UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).expect("a port is free");
    let address: SocketAddr = probe.local_addr().expect("it is bound");
    drop(probe);
    thread::spawn(move || block_on(names::serve(&Stack::new(), address)));
    run(Command::new(python)
        .arg(client("names.py"))
        .arg(address.port().to_string()));
}

//! Clients that send and send.

use host_tests::desktop::{Client, Desktop};
use std::io::{ErrorKind, Write};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread;
use std::time::{Duration, Instant};

/// Far more than a computer needs for a reply, and far less than a person's patience.
const PROMPT: Duration = Duration::from_secs(5);
/// A flood may cost the arm this much memory, in kilobytes.
const ROOM_KB: u64 = 8 * 1024;

fn arm(speed: &str) -> (tempfile::TempDir, Desktop) {
    let folder = tempfile::tempdir().expect("there is room for a folder");
    let arm = Desktop::start(folder.path(), &["--speed", speed]);
    (folder, arm)
}

#[test]
fn thousands_of_commands_are_answered_in_order_however_late_they_are_read() {
    const COUNT: usize = 6000;
    let (_folder, arm) = arm("max");
    let mut client = arm.client();
    let mut expected = Vec::with_capacity(COUNT);
    let mut flood = String::new();
    for index in 0..COUNT {
        match index % 3 {
            0 => {
                let x = 1000 + index % 500;
                flood += &format!("G01 X{x} Y900 Z1000\n");
                expected.push(format!("ok X:{x} Y:900 Z:1000"));
            }
            1 => {
                flood += &format!("Q{index}\n");
                expected.push(format!("error INFO:\"unknown command 'Q{index}'\""));
            }
            _ => {
                flood += "M550\n";
                expected.push("ok MACHINENAME:line-us".into());
            }
        }
    }
    client.send(&flood);
    for (index, expected) in expected.iter().enumerate() {
        assert_eq!(&client.reply(), expected, "reply {index} of {COUNT}");
    }
    assert!(client.hears_nothing_for(Duration::from_millis(50)));
}

#[test]
fn a_flood_in_real_time_waits_in_its_socket() {
    let (_folder, arm) = arm("1");
    let before = arm.memory_kb();
    let mut client = arm.client();
    // Minutes of drawing; the first replies come at the arm's pace.
    client.send("G01 X1100\nG01 X1000\n".repeat(5000));
    for _ in 0..3 {
        client.reply();
    }
    let grown = arm.memory_kb().saturating_sub(before);
    assert!(grown < ROOM_KB, "memory has grown by {grown} kB");
}

/// Sends `line` over and over until `stop`, without reading; gives how many bytes the arm took.
fn flood(client: &Client, line: &str, taken: &AtomicU64, stop: &AtomicBool) {
    let mut stream = client.stream();
    let options = stream.set_write_timeout(Some(Duration::from_millis(50)));
    options.expect("a connection has options");
    let block = line.repeat(4096 / line.len());
    while !stop.load(Ordering::Relaxed) {
        // Not write_all: what was taken of a block counts, wherever it was cut.
        match stream.write(block.as_bytes()) {
            Ok(length) => {
                taken.fetch_add(length as u64, Ordering::Relaxed);
            }
            Err(error) => assert!(
                matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut),
                "{error}"
            ),
        }
    }
}

#[test]
fn a_client_that_floods_and_never_reads_holds_nobody_up() {
    let (_folder, arm) = arm("1");
    let before = arm.memory_kb();
    let flooder = arm.connect();
    let mut other = arm.client();
    let (taken, stop) = (AtomicU64::new(0), AtomicBool::new(false));
    let mut slowest = Duration::ZERO;
    thread::scope(|scope| {
        scope.spawn(|| flood(&flooder, "M122\n", &taken, &stop));
        let begun = Instant::now();
        let mut x = 1000;
        // Long enough that the arm's patience with its unread replies ends.
        while begun.elapsed() < Duration::from_secs(4) {
            let asked = Instant::now();
            x = if x == 1000 { 1030 } else { 1000 };
            assert_eq!(
                other.say(&format!("G01 X{x}")),
                format!("ok X:{x} Y:1000 Z:1000")
            );
            other.wait_for_place(&format!("ok X:{x} Y:1000 Z:1000"));
            slowest = slowest.max(asked.elapsed());
        }
        stop.store(true, Ordering::Relaxed);
    });
    let grown = arm.memory_kb().saturating_sub(before);
    println!(
        "took {} kB from the flooder; the other's slowest move and question: {slowest:?}; memory grew by {grown} kB",
        taken.load(Ordering::Relaxed) / 1024
    );
    assert!(slowest < PROMPT, "the other client waited {slowest:?}");
    assert!(grown < ROOM_KB, "memory has grown by {grown} kB");
}

#[test]
fn a_client_that_floods_and_reads_holds_nobody_up() {
    let (_folder, arm) = arm("1");
    let mut flooder = arm.client();
    let mut other = arm.client();
    let (taken, stop) = (AtomicU64::new(0), AtomicBool::new(false));
    let sender = flooder
        .stream()
        .try_clone()
        .expect("a connection can be shared");
    let mut slowest = Duration::ZERO;
    let mut read = 0;
    thread::scope(|scope| {
        scope.spawn(|| {
            let mut sender = sender;
            let block = "M114\n".repeat(1000);
            while !stop.load(Ordering::Relaxed) && sender.write_all(block.as_bytes()).is_ok() {
                taken.fetch_add(1000, Ordering::Relaxed);
            }
            sender
                .write_all(b"the end\n")
                .expect("the arm is there still");
        });
        let reader = scope.spawn(|| {
            let mut count: u64 = 0;
            while !flooder.reply().starts_with("error") {
                count += 1;
            }
            count
        });
        let begun = Instant::now();
        while begun.elapsed() < Duration::from_secs(2) {
            let asked = Instant::now();
            other.send("M550\n");
            let silent = other.hears_nothing_for(PROMPT);
            slowest = slowest.max(asked.elapsed());
            if silent {
                break;
            }
            other.reply();
        }
        stop.store(true, Ordering::Relaxed);
        read = reader.join().expect("the reader reads to the end");
    });
    println!("{read} replies to the flooder; the other's slowest question: {slowest:?}");
    assert_eq!(read, taken.load(Ordering::Relaxed), "replies are missing");
    assert!(slowest < PROMPT, "the other client waited {slowest:?}");
}

#[test]
fn a_flooded_drawing_is_drawn_to_its_end_although_nobody_reads() {
    let (_folder, arm) = arm("max");
    let mut flooder = arm.connect();
    flooder.send("G01 X1100 Y900\nG01 X1000 Y900\n".repeat(1000));
    // 8 MB of replies, more than systems keep for a socket.
    flooder.send("M122\n".repeat(32_000));
    flooder.send("G01 X1234 Y567 Z1000\n");
    arm.client().wait_for_place("ok X:1234 Y:567 Z:1000");
}

/// A client that has sent more than its replies fit anywhere, read nothing, been given up on, and now wakes up.
fn sleeper(arm: &Desktop) -> Client {
    let mut sleeper = arm.connect();
    sleeper.send("M122\n".repeat(32_000));
    sleeper.send("G01 X1234 Y567 Z1000\n");
    arm.client().wait_for_place("ok X:1234 Y:567 Z:1000");
    sleeper
}

#[test]
fn replies_that_a_client_was_too_slow_for_are_lost_whole() {
    let (_folder, arm) = arm("max");
    let mut sleeper = sleeper(&arm);
    assert!(sleeper.reply().starts_with("hello "));
    let mut count = 0;
    let mut asked = false;
    loop {
        if !asked && !sleeper.has_whole_reply_within(Duration::from_millis(500)) {
            // The rest of a reply that went out in part comes before the next one.
            sleeper.send("M550\n");
            asked = true;
        }
        let reply = sleeper.reply();
        if reply == "ok MACHINENAME:line-us" {
            break;
        }
        assert!(
            reply.starts_with("ok name:") && reply.ends_with('"') || reply.starts_with("ok X:"),
            "reply {count} is torn: {reply:?}"
        );
        count += 1;
    }
    println!("{count} of 32001 replies reached a client that did not read");
    assert!(count < 32_001, "nothing was lost: this test tests nothing");
    // It reads again, so it is told everything again.
    for _ in 0..100 {
        assert_eq!(sleeper.say("M550"), "ok MACHINENAME:line-us");
    }
}

#[test]
fn a_reply_of_which_a_part_went_out_is_completed_when_the_client_reads_again() {
    let (_folder, arm) = arm("max");
    let mut sleeper = sleeper(&arm);
    assert!(sleeper.reply().starts_with("hello "));
    while !sleeper.hears_nothing_for(Duration::from_secs(1)) {
        assert!(
            sleeper.has_whole_reply_within(PROMPT),
            "the end of a reply does not come"
        );
        sleeper.reply();
    }
}

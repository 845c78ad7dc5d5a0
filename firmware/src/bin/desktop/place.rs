//! The arm with its place for a second firmware, if it has one: bootloader, firmware on trial, and the way to the next
//! start.

use crate::options::{Serve, Web};
use crate::serve;
use firmware::board::FirmwareSlots;
use firmware::boards::desktop::bootloader::{self, Reset, Running};
use firmware::boards::desktop::slots::{self, FileSlots};
use firmware::boards::desktop::trial;
use firmware::services::update;
use protocol_core::update::{KeyName, Standing};
use std::io;
use std::process::ExitCode;

/// The firmware that runs where there is place for two.
pub struct Firmware {
    pub running: Running,
    pub slots: FileSlots,
    pub standing: Standing,
}

impl Firmware {
    /// Counts the start of a firmware on trial, or starts the other one.
    pub fn start(running: Running) -> io::Result<Self> {
        let mut slots = FileSlots::open(&running)?;
        let standing = update::at_start(slots.choice(), running.slot);
        let Some(standing) = embassy_futures::block_on(standing) else {
            log::info!("the new firmware did not confirm itself: back to the old one");
            return Err(running.restart(Reset::Firmware));
        };
        if let Standing::Trial { .. } = standing {
            trial::begin(&running);
        }
        Ok(Self {
            running,
            slots,
            standing,
        })
    }
}

/// How serving ends.
pub enum End {
    Stopped,
    /// The firmware wants to be started again.
    Restart,
}

/// Serves until the program is told to stop. Where there is place for two firmwares, it is the bootloader
/// before that, unless it is the firmware in a slot already.
pub fn run(options: Serve, firmware: Option<Firmware>) -> io::Result<ExitCode> {
    let firmware = match (firmware, &options.firmware) {
        (Some(firmware), _) => firmware,
        (None, Some(folder)) => {
            keep_strangers_out(&options)?;
            Firmware::start(bootloader::boot(folder)?)?
        }
        (None, None) => {
            serve::until_end(options, None)?;
            return Ok(ExitCode::SUCCESS);
        }
    };
    let running = firmware.running.clone();
    if trial::lasts() {
        trial::observe(&running, options.speed);
    }
    log::info!(
        "firmware {} of {}",
        slots::name(running.slot),
        running.folder.display()
    );
    // An image may believe another key than the bootloader.
    let ended =
        keep_strangers_out(&options).and_then(|()| serve::until_end(options, Some(firmware)));
    let on_trial = trial::lasts();
    trial::end();
    match ended {
        Ok(End::Stopped) => Ok(ExitCode::SUCCESS),
        Ok(End::Restart) => Err(running.restart(Reset::Firmware)),
        Err(error) if on_trial => {
            eprintln!("error: {error}");
            Err(running.restart(Reset::Failure))
        }
        Err(error) => Err(error),
    }
}

/// Whoever has the sources can sign with the development key, and an update is a program that runs as this
/// user: then only those who are on this computer may ask for one.
fn keep_strangers_out(options: &Serve) -> io::Result<()> {
    if update::KEY_NAME != KeyName::Development {
        return Ok(());
    }
    let web = match options.web {
        Some(Web::At(address)) => Some(address),
        None | Some(Web::Nowhere) => None,
    };
    let open = [
        ("--line-us", Some(options.line_us)),
        ("--web", web),
        ("--serial-tcp", options.serial_tcp),
    ];
    for (option, address) in open {
        let strange = address.filter(|address| !address.ip().to_canonical().is_loopback());
        if let Some(address) = strange {
            return Err(io::Error::new(
                io::ErrorKind::PermissionDenied,
                format!(
                    "{option} {address} with --firmware: this firmware believes the published development \
                     key, so whoever reaches it could run programs here. Build it with a key of your own \
                     (QUILL_UPDATE_KEY, see docs/update.md), or take an address of 127.0.0.1"
                ),
            ));
        }
    }
    Ok(())
}

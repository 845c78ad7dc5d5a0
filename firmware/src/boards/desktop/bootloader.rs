//! The bootloader of a desktop arm with a place for a second firmware.
//!
//! The program that is started by hand is the bootloader, and becomes the image of the chosen slot
//! (`exec`), with the same arguments. As long as nothing has been written into the first slot it is that
//! slot's firmware itself. A restart is a start of that program again.

use super::flash::FileFlash;
use super::slots::{self, CHOICE_SIZE};
use crate::services::update;
use embassy_embedded_hal::adapter::BlockingAsync;
use nix::unistd::execve;
use protocol_core::update::Slot;
use std::convert::Infallible;
use std::env;
use std::ffi::{CString, OsString};
use std::fs::{self, DirBuilder};
use std::io;
use std::os::unix::ffi::OsStringExt;
use std::os::unix::fs::DirBuilderExt;
use std::path::{Path, PathBuf};

/// Names the program that was started by hand, for the firmware in a slot.
const BUILT: &str = "QUILL_BUILT";
/// Names the folder with the slots, for it.
const PLACE: &str = "QUILL_PLACE";
/// Names the slot whose firmware a process is. Whoever has none is the bootloader.
const SLOT: &str = "QUILL_SLOT";
/// Says why the bootloader starts again, for it and for the firmware.
const RESET: &str = "QUILL_RESET";

/// Why a firmware is started again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reset {
    /// It wants to.
    Firmware,
    /// It hangs.
    Watchdog,
    /// It panicked.
    Panic,
    /// It ended with an error.
    Failure,
}

impl Reset {
    const ALL: [Self; 4] = [Self::Firmware, Self::Watchdog, Self::Panic, Self::Failure];

    /// In the words of M122.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Firmware => "firmware",
            Self::Watchdog => "watchdog",
            Self::Panic => "panic",
            Self::Failure => "failure",
        }
    }
}

/// Why this process was started again; `None` where it was started by hand.
pub fn reset() -> Option<Reset> {
    let name = env::var_os(RESET)?;
    Reset::ALL.into_iter().find(|reset| *reset.name() == name)
}

/// Firmware that runs, and how it is started again.
#[derive(Clone, Debug)]
pub struct Running {
    /// Where the slots are.
    pub folder: PathBuf,
    /// The one whose firmware this is.
    pub slot: Slot,
    /// The program that was started by hand.
    built: PathBuf,
}

/// What this process is, where the bootloader has started it; `None` if it is the bootloader.
pub fn running() -> Option<Running> {
    let name = env::var_os(SLOT)?;
    let mut slots = [Slot::First, Slot::Second].into_iter();
    Some(Running {
        folder: env::var_os(PLACE)?.into(),
        slot: slots.find(|slot| *slots::name(*slot) == name)?,
        built: env::var_os(BUILT)?.into(),
    })
}

/// Makes this process the firmware that is chosen in `folder`, which is made if it does not exist. Returns
/// where it is that.
///
/// An image that does not start is passed over for the other one.
///
/// # Errors
/// When neither starts, or the choice cannot be read.
pub fn boot(folder: &Path) -> io::Result<Running> {
    // Whoever can write there decides what runs.
    DirBuilder::new()
        .recursive(true)
        .mode(0o700)
        .create(folder)
        .map_err(|error| naming(folder, &error))?;
    let built = env::current_exe()?;
    let choice = slots::choice_file(folder);
    let flash = FileFlash::open(&choice, CHOICE_SIZE).map_err(|error| naming(&choice, &error))?;
    let choice = embassy_futures::block_on(update::choice(&mut BlockingAsync::new(flash)));
    let chosen = choice.map_or(Slot::First, |choice| choice.slot());
    for slot in [chosen, chosen.other()] {
        let image = slots::image_file(folder, slot);
        if slot == Slot::First && is_unwritten(&image) {
            return Ok(Running {
                folder: folder.to_path_buf(),
                slot,
                built,
            });
        }
        let settings = [
            (SLOT, slots::name(slot).into()),
            (PLACE, folder.as_os_str().to_owned()),
            (BUILT, built.clone().into_os_string()),
        ];
        let Err(error) = replace_by(&image, settings);
        log::warn!("{}: {error}", image.display());
    }
    Err(io::Error::other(format!(
        "no firmware of {} starts",
        folder.display()
    )))
}

impl Running {
    /// Starts the firmware that is chosen by now. What is unwritten is lost; sockets and files are closed.
    /// Returns where that fails.
    pub fn restart(&self, why: Reset) -> io::Error {
        let Err(error) = replace_by(&self.built, [(RESET, why.name().into())]);
        naming(&self.built, &error)
    }
}

fn is_unwritten(image: &Path) -> bool {
    match fs::metadata(image) {
        Ok(file) => file.len() == 0,
        Err(error) => error.kind() == io::ErrorKind::NotFound,
    }
}

fn naming(path: &Path, error: &io::Error) -> io::Error {
    io::Error::new(error.kind(), format!("{}: {error}", path.display()))
}

/// Replaces this process by a program, with its arguments, its environment and some more of that.
///
/// Not `CommandExt::exec`: with glibc that hands a file which is no program to the shell.
fn replace_by<const N: usize>(
    program: &Path,
    settings: [(&str, OsString); N],
) -> io::Result<Infallible> {
    let is_new = |name: &OsString| {
        let new = settings.iter().map(|(new, _)| *new);
        [SLOT, PLACE, BUILT]
            .into_iter()
            .chain(new)
            .any(|new| name == new)
    };
    let kept = env::vars_os().filter(|(name, _)| !is_new(name));
    let kept: Vec<_> = kept.collect();
    let settings = settings.map(|(name, value)| (OsString::from(name), value));
    let environment = kept.into_iter().chain(settings).map(|(mut line, value)| {
        line.push("=");
        line.push(value);
        CString::new(line.into_vec())
    });
    let environment = environment.collect::<Result<Vec<_>, _>>()?;
    let path = CString::new(program.as_os_str().to_owned().into_vec())?;
    let arguments = env::args_os()
        .skip(1)
        .map(|argument| CString::new(argument.into_vec()));
    let arguments = std::iter::once(Ok(path.clone()))
        .chain(arguments)
        .collect::<Result<Vec<_>, _>>()?;
    Ok(execve(&path, &arguments, &environment)?)
}

//! A pseudo-terminal as the serial port: programs open it as they open one.

use async_io::Async;
use embassy_time::Timer;
use embedded_io_async::{ErrorType, Read, Write};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fd::{AsFd, OwnedFd};
use rustix::fs::{Mode, OFlags};
use rustix::io::Errno;
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};
use std::ffi::OsStr;
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};
use std::{fs, io};

/// How often it is seen whether somebody has opened the terminal; nobody tells.
const LOOK: u64 = 50;
/// How long a program has to set the terminal up before the banner comes, in milliseconds: many throw
/// away what they received before that. A board that is reset takes longer.
const SET_UP: u64 = 100;

/// The machine's end of the terminal.
pub struct Pty(Async<OwnedFd>);

/// The terminal's name in the file system, which goes with this.
pub struct Link {
    link: PathBuf,
    target: PathBuf,
}

/// Makes a terminal that can be opened as `link`. A link that is there already is replaced.
///
/// # Errors
/// When the system has no terminal left, or `link` is something else than a link.
pub fn open(link: &Path) -> io::Result<(Pty, Link)> {
    let master = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC)?;
    grantpt(&master)?;
    unlockpt(&master)?;
    let target = ptsname(&master, Vec::new())?;
    let target = PathBuf::from(OsStr::from_bytes(target.as_bytes()));
    // No echo, no lines: bytes. After the last user has closed it, the terminal is known to be unused.
    let terminal = rustix::fs::open(&target, OFlags::RDWR | OFlags::NOCTTY, Mode::empty())?;
    let mut settings = tcgetattr(&terminal)?;
    settings.make_raw();
    tcsetattr(&terminal, OptionalActions::Now, &settings)?;
    drop(terminal);
    if fs::symlink_metadata(link).is_ok_and(|there| there.is_symlink()) {
        fs::remove_file(link)?;
    }
    std::os::unix::fs::symlink(&target, link)?;
    let link = Link {
        link: link.to_path_buf(),
        target,
    };
    Ok((Pty(Async::new(master)?), link))
}

impl Drop for Link {
    fn drop(&mut self) {
        // Somebody else's, if it leads elsewhere by now.
        if fs::read_link(&self.link).is_ok_and(|target| target == self.target) {
            let _ = fs::remove_file(&self.link);
        }
    }
}

impl Pty {
    /// Waits until somebody has opened the terminal, and set it up.
    pub async fn opened(&self) {
        while !self.is_open() {
            Timer::after_millis(LOOK).await;
        }
        Timer::after_millis(SET_UP).await;
    }

    fn is_open(&self) -> bool {
        let mut fds = [PollFd::new(&self.0, PollFlags::IN)];
        let polled = poll(&mut fds, Some(&Timespec::default()));
        let [fd] = &fds;
        polled.is_ok() && !fd.revents().contains(PollFlags::HUP)
    }
}

/// What an unused terminal answers is the end of the connection.
fn end_of<T: Default>(result: rustix::io::Result<T>) -> io::Result<T> {
    match result {
        Err(Errno::IO) => Ok(T::default()),
        result => Ok(result?),
    }
}

impl ErrorType for &Pty {
    type Error = io::Error;
}

impl Read for &Pty {
    async fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let read = |fd: &OwnedFd| end_of(rustix::io::read(fd.as_fd(), &mut *buffer));
        self.0.read_with(read).await
    }
}

impl Write for &Pty {
    async fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let write = |fd: &OwnedFd| end_of(rustix::io::write(fd.as_fd(), bytes));
        self.0.write_with(write).await
    }

    async fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

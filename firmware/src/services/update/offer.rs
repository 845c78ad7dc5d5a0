//! An image that is handed over by another task, with its manifest: a file, through the web interface.

use super::body::{Body, Origin};
use super::{Outcome, Ticket, Update, now};
use core::cell::RefCell;
use embassy_futures::select::{Either, select};
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::pipe::Pipe;
use embassy_sync::signal::Signal;
use heapless::Vec;
use protocol_core::update::{Download, IMAGE_TIME, MAX_MANIFEST};

/// Bytes that are on their way from one task to the other.
const PIPE: usize = 512;

/// What is handed over, and how much of it is on its way.
pub(super) struct Offer {
    paper: Mutex<CriticalSectionRawMutex, RefCell<Paper>>,
    image: Pipe<CriticalSectionRawMutex, PIPE>,
    /// Nothing more comes.
    ended: Signal<CriticalSectionRawMutex, ()>,
}

struct Paper {
    manifest: Vec<u8, MAX_MANIFEST>,
    /// Bytes of the image.
    length: u32,
}

impl Offer {
    pub(super) const fn new() -> Self {
        let paper = Paper {
            manifest: Vec::new(),
            length: 0,
        };
        Self {
            paper: Mutex::new(RefCell::new(paper)),
            image: Pipe::new(),
            ended: Signal::new(),
        }
    }

    pub(super) fn put(&self, manifest: &[u8], length: u32) {
        self.image.clear();
        self.ended.reset();
        self.paper.lock(|paper| {
            let mut paper = paper.borrow_mut();
            paper.manifest.clear();
            // What does not fit is no manifest, and neither is what fits of it.
            let fits = manifest.get(..MAX_MANIFEST).unwrap_or(manifest);
            let _ = paper.manifest.extend_from_slice(fits);
            paper.length = length;
        });
    }

    pub(super) fn manifest<'b>(&self, text: &'b mut [u8; MAX_MANIFEST]) -> &'b [u8] {
        let length = self.paper.lock(|paper| {
            let paper = paper.borrow();
            for (place, byte) in text.iter_mut().zip(&paper.manifest) {
                *place = *byte;
            }
            paper.manifest.len()
        });
        text.get(..length).unwrap_or_default()
    }

    pub(super) fn image<S: embedded_io_async::Read>(&self) -> Body<'_, S> {
        let length = self.paper.lock(|paper| paper.borrow().length);
        let download = Download::begin(now(), IMAGE_TIME).of(length);
        Body::new(Origin::Offer(Bytes(self)), download)
    }
}

/// The bytes of the image, as the update service takes them.
pub(super) struct Bytes<'a>(&'a Offer);

impl Bytes<'_> {
    /// The next bytes, 0 when nothing more comes.
    pub(super) async fn read(&mut self, into: &mut [u8]) -> usize {
        // What is on its way still counts.
        match select(self.0.image.read(into), self.0.ended.wait()).await {
            Either::First(count) => count,
            Either::Second(()) => {
                self.0.ended.signal(());
                0
            }
        }
    }
}

/// The side of whoever hands over. Where it is dropped, nothing more comes.
pub struct Handover<'a> {
    update: &'a Update,
    ticket: Ticket,
}

impl<'a> Handover<'a> {
    pub(super) const fn new(update: &'a Update, ticket: Ticket) -> Self {
        Self { update, ticket }
    }

    /// Hands over bytes of the image; waits as long as the service takes none, which may be for ever: the
    /// outcome comes in any case.
    pub async fn push(&self, bytes: &[u8]) {
        self.update.offer.image.write_all(bytes).await;
    }

    /// The version that starts in a moment.
    ///
    /// # Errors
    /// A [`Rejection`](protocol_core::update::Rejection): nothing has changed then.
    pub async fn outcome(&self) -> Outcome {
        self.update.outcome(self.ticket).await
    }
}

impl Drop for Handover<'_> {
    fn drop(&mut self) {
        self.update.offer.ended.signal(());
    }
}

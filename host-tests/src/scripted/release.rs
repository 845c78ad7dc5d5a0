//! Signed images.

use super::server::{Answer, HOST, PORT, Server};
use super::slots::BOARD;
use crate::manifest::signed_part;
pub use crate::manifest::{SigningKey, development_key, sign};

/// Path of the manifest.
pub const MANIFEST: &str = "/quill/scripted.txt";
/// Path of the image.
pub const IMAGE: &str = "/quill/new.bin";

/// Of the manifest.
pub fn address() -> String {
    format!("http://{HOST}:{PORT}{MANIFEST}")
}

/// What a manifest says, before it is signed.
#[derive(Clone, Debug, PartialEq)]
pub struct Release {
    /// What it is for.
    pub board: String,
    /// Three numbers.
    pub version: String,
    /// What goes into a slot.
    pub image: Vec<u8>,
}

impl Release {
    /// Newer than anything that runs, of that size.
    pub fn of(size: usize) -> Self {
        Self::new("9.0.0", size)
    }

    /// Of that version and size; images of two versions differ from their first byte on.
    pub fn new(version: &str, size: usize) -> Self {
        let seed = version
            .bytes()
            .fold(0, |seed: usize, byte| (seed * 31 + usize::from(byte)) % 251);
        Self {
            board: BOARD.into(),
            version: version.into(),
            image: (0..size)
                .map(|at| (seed + at * 7 + at / 251) as u8)
                .collect(),
        }
    }

    /// The manifest before its last line.
    pub fn signed_part(&self) -> String {
        signed_part(&self.board, &self.version, &self.image, "new.bin")
    }

    /// The whole manifest, as development builds believe it.
    pub fn manifest(&self) -> String {
        sign(&self.signed_part(), &development_key())
    }

    /// A server that has it.
    pub fn served(&self) -> Server {
        let server = Server::default();
        self.put_on(&server);
        server
    }

    /// A server has it, instead of what it had.
    pub fn put_on(&self, server: &Server) {
        server.put(MANIFEST, Answer::file(self.manifest().as_bytes()));
        server.put(IMAGE, Answer::file(&self.image));
    }
}

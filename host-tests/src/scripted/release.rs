//! Signed images.

use super::server::{Answer, HOST, PORT, Server};
use super::slots::BOARD;
use ed25519_dalek::Signer;
pub use ed25519_dalek::SigningKey;
use sha2::{Digest, Sha256};

/// Path of the manifest.
pub const MANIFEST: &str = "/quill/scripted.txt";
/// Path of the image.
pub const IMAGE: &str = "/quill/new.bin";

/// Of the manifest.
pub fn address() -> String {
    format!("http://{HOST}:{PORT}{MANIFEST}")
}

/// As lower-case hexadecimal digits.
fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// The key of development builds.
pub fn development_key() -> SigningKey {
    let digits = include_str!("../../../firmware/keys/development.key").trim();
    let byte = |at| u8::from_str_radix(&digits[at..at + 2], 16).unwrap();
    let bytes: Vec<u8> = (0..digits.len()).step_by(2).map(byte).collect();
    SigningKey::from_bytes(&bytes.try_into().unwrap())
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
        format!(
            "Quill update 1\nboard: {}\nversion: {}\nsize: {}\nsha256: {}\nimage: new.bin\n",
            self.board,
            self.version,
            self.image.len(),
            hex(&Sha256::digest(&self.image)),
        )
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

/// A manifest of these lines.
pub fn sign(text: &str, key: &SigningKey) -> String {
    let signature = key.sign(text.as_bytes());
    format!("{text}signature: {}\n", hex(&signature.to_bytes()))
}

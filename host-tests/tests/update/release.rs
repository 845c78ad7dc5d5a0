//! Signed images.

use crate::machine::BOARD;
use crate::server::{Answer, HOST, PORT, Server};
use ed25519_dalek::{Signer, SigningKey};
use sha2::{Digest, Sha256};

/// Path of manifest and image.
pub const MANIFEST: &str = "/quill/scripted.txt";
pub const IMAGE: &str = "/quill/new.bin";

pub fn address() -> String {
    format!("http://{HOST}:{PORT}{MANIFEST}")
}

pub fn hex(bytes: &[u8]) -> String {
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
#[derive(Clone)]
pub struct Release {
    pub board: String,
    pub version: String,
    pub image: Vec<u8>,
}

impl Release {
    /// Newer than anything that runs, of that size.
    pub fn of(size: usize) -> Self {
        Self {
            board: BOARD.into(),
            version: "9.0.0".into(),
            image: (0..size).map(|at| (at * 7 + at / 251) as u8).collect(),
        }
    }

    pub fn signed_part(&self) -> String {
        format!(
            "Quill update 1\nboard: {}\nversion: {}\nsize: {}\nsha256: {}\nimage: new.bin\n",
            self.board,
            self.version,
            self.image.len(),
            hex(&Sha256::digest(&self.image)),
        )
    }

    pub fn manifest(&self) -> String {
        sign(&self.signed_part(), &development_key())
    }

    /// A server that has it.
    pub fn served(&self) -> Server {
        let server = Server::default();
        server.put(MANIFEST, Answer::file(self.manifest().as_bytes()));
        server.put(IMAGE, Answer::file(&self.image));
        server
    }
}

pub fn sign(text: &str, key: &SigningKey) -> String {
    let signature = key.sign(text.as_bytes());
    format!("{text}signature: {}\n", hex(&signature.to_bytes()))
}

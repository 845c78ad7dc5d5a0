//! A signed image, and a web server that has it.

use ed25519_dalek::{Signer, SigningKey};
use firmware::boards::desktop::slots;
use host_tests::desktop::binary;
use sha2::{Digest, Sha256};
use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::net::{TcpListener, TcpStream};
use std::thread;

/// The version of every image here: newer than anything that runs.
pub const NEW: &str = "9.0.0";

pub struct Release {
    pub board: String,
    pub image: Vec<u8>,
    pub key: SigningKey,
}

impl Release {
    /// Something for this computer, signed as development builds want it.
    pub fn of(image: impl Into<Vec<u8>>) -> Self {
        Self {
            board: slots::board().into(),
            image: image.into(),
            key: development_key(),
        }
    }

    /// The arm's program, without what is for debuggers.
    pub fn program() -> Self {
        let mut image = fs::read(binary()).expect("the program can be read");
        image.truncate(end_of_segments(&image).expect("the program is an ELF file of 64 bits"));
        Self::of(image)
    }

    /// Firmware that does what the arm's program does with some more arguments: a script, which is as good a
    /// program as any and has no 50 MB.
    pub fn script(arguments: &str) -> Self {
        let program = binary().display();
        Self::of(format!("#!/bin/sh\nexec '{program}' \"$@\" {arguments}\n"))
    }

    fn manifest(&self) -> String {
        let signed = format!(
            "Quill update 1\nboard: {}\nversion: {NEW}\nsize: {}\nsha256: {}\nimage: image\n",
            self.board,
            self.image.len(),
            hex(&Sha256::digest(&self.image)),
        );
        let signature = self.key.sign(signed.as_bytes());
        format!("{signed}signature: {}\n", hex(&signature.to_bytes()))
    }

    /// Serves it as long as the tests run, and gives the manifest's address.
    pub fn serve(self) -> String {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let port = listener.local_addr().unwrap().port();
        thread::spawn(move || {
            for stream in listener.incoming() {
                // The arm may have heard enough.
                let _ = stream.and_then(|stream| self.answer(stream));
            }
        });
        // A name, so that one is looked up.
        format!("http://localhost:{port}/manifest")
    }

    fn answer(&self, mut stream: TcpStream) -> std::io::Result<()> {
        let mut lines = BufReader::new(stream.try_clone()?).lines();
        let request = lines.next().transpose()?.unwrap_or_default();
        while lines
            .next()
            .transpose()?
            .is_some_and(|line| !line.is_empty())
        {}
        let manifest = self.manifest();
        let content = match request.split(' ').nth(1) {
            Some("/manifest") => manifest.as_bytes(),
            _ => &self.image,
        };
        write!(
            stream,
            "HTTP/1.1 200 OK\r\nContent-Length: {}\r\n\r\n",
            content.len()
        )?;
        stream.write_all(content)
    }
}

/// Where what is loaded of an ELF file ends: sections of a debug build lie behind it.
fn end_of_segments(file: &[u8]) -> Option<usize> {
    let number = |at: usize, length: usize| {
        let mut bytes = [0; 8];
        bytes[..length].copy_from_slice(file.get(at..at + length)?);
        usize::try_from(u64::from_le_bytes(bytes)).ok()
    };
    if !file.starts_with(b"\x7fELF\x02\x01") {
        return None;
    }
    let (table, entry, count) = (number(0x20, 8)?, number(0x36, 2)?, number(0x38, 2)?);
    let ends = (0..count).map(|index| {
        let header = table + index * entry;
        Some(number(header + 0x08, 8)? + number(header + 0x20, 8)?)
    });
    ends.collect::<Option<Vec<_>>>()?.into_iter().max()
}

fn development_key() -> SigningKey {
    let digits = include_str!("../../../firmware/keys/development.key").trim();
    SigningKey::from_bytes(&protocol_core::update::hexadecimal(digits.as_bytes()).unwrap())
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

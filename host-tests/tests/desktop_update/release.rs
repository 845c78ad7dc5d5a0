//! A signed image, and a web server that has it.

use firmware::boards::desktop::slots;
use host_tests::desktop::binary;
use host_tests::manifest::{SigningKey, development_key, sign, signed_part};
use host_tests::web_server::serve;
use std::fs;

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
        let signed = signed_part(&self.board, NEW, &self.image, "image");
        sign(&signed, &self.key)
    }

    /// The file for a page.
    pub fn file(&self) -> Vec<u8> {
        [self.manifest().as_bytes(), &self.image].concat()
    }

    /// Serves it as long as the tests run, and gives the manifest's address.
    pub fn serve(self) -> String {
        let manifest = self.manifest();
        let port = serve(move |name| match name {
            "manifest" => Some(manifest.clone().into()),
            _ => Some(self.image.clone()),
        });
        // A name, so that one is looked up.
        format!("http://localhost:{port}/manifest")
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

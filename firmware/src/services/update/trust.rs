//! Whose signature is believed.

use ed25519_dalek::VerifyingKey;
use protocol_core::update::{KeyName, Manifest, Rejection, Signature, Unverified, hexadecimal};

/// The key of development builds. Its private half is beside it, published on purpose.
const DEVELOPMENT: [u8; 32] = key(include_str!("../../../keys/development.pub"));
/// The key that is built in: `QUILL_UPDATE_KEY` of the build's environment, or the development key.
const KEY: [u8; 32] = match option_env!("QUILL_UPDATE_KEY") {
    Some(digits) => key(digits),
    None => DEVELOPMENT,
};
/// What M122 says of it.
pub const KEY_NAME: KeyName = key_name();

/// Reads a manifest whose signature is good.
pub fn read(text: &[u8]) -> Result<Manifest<'_>, Rejection> {
    Unverified::parse(text)?.verify(is_signature)
}

fn is_signature(signature: &Signature, signed: &[u8]) -> bool {
    let signature = ed25519_dalek::Signature::from_bytes(signature);
    VerifyingKey::from_bytes(&KEY).is_ok_and(|key| key.verify_strict(signed, &signature).is_ok())
}

const fn key_name() -> KeyName {
    let mut at = 0;
    let mut same = true;
    while at < KEY.len() {
        #[expect(clippy::indexing_slicing, reason = "at compile time, within both")]
        let differs = KEY[at] != DEVELOPMENT[at];
        same &= !differs;
        at += 1;
    }
    let [a, b, c, d, ..] = KEY;
    if same {
        KeyName::Development
    } else {
        KeyName::Own([a, b, c, d])
    }
}

/// 64 hexadecimal digits, with or without an end of line.
#[expect(clippy::panic, reason = "evaluated at compile time alone")]
const fn key(text: &str) -> [u8; 32] {
    match hexadecimal(text.as_bytes().trim_ascii()) {
        Some(key) => key,
        None => panic!("the update key is not 64 lower-case hexadecimal digits"),
    }
}

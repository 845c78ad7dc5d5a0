//! Manifests of images, made here as the documentation says, and not by what makes them for arms.

use ed25519_dalek::Signer;
pub use ed25519_dalek::SigningKey;
use sha2::{Digest, Sha256};

/// The key of development builds.
///
/// # Panics
/// Never: it is in the sources.
pub fn development_key() -> SigningKey {
    let digits = include_str!("../../firmware/keys/development.key").trim();
    let byte = |at| u8::from_str_radix(&digits[at..at + 2], 16).expect("hexadecimal digits");
    let bytes: Vec<u8> = (0..digits.len()).step_by(2).map(byte).collect();
    SigningKey::from_bytes(&bytes.try_into().expect("32 bytes"))
}

/// What is signed of the manifest of an image.
pub fn signed_part(board: &str, version: &str, image: &[u8], name: &str) -> String {
    format!(
        "Quill update 1\nboard: {board}\nversion: {version}\nsize: {}\nsha256: {}\nimage: {name}\n",
        image.len(),
        hex(&Sha256::digest(image)),
    )
}

/// A manifest of these lines.
pub fn sign(text: &str, key: &SigningKey) -> String {
    let signature = key.sign(text.as_bytes());
    format!("{text}signature: {}\n", hex(&signature.to_bytes()))
}

/// As lower-case hexadecimal digits.
fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

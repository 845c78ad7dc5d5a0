//! New firmware over the network: what is taken, what is refused, and how an arm comes back from one that
//! does not work (`docs/update.md`). Values only; the firmware's service does what they say.

mod address;
mod boot;
mod download;
mod manifest;
mod probation;
mod rejection;
mod status;
mod version;

pub use address::{ImageName, MAX_ADDRESS, MAX_HOST, MAX_IMAGE_NAME, MAX_PATH, ManifestAddress};
pub use boot::{BootChoice, ENTRY, PAGE, STARTS, Slot, Standing, Start, Step, Steps};
pub use download::{
    ARM_TIME, Download, Head, IMAGE_TIME, MANIFEST_TIME, MAX_HEAD, MAX_HEADERS, SILENCE,
};
pub use manifest::{
    Hash, MAX_BOARD, MAX_MANIFEST, Manifest, Running, Signature, Unverified, hexadecimal,
    manifest_end,
};
pub use probation::{PATIENCE, Probation, STEADY, Signs, Verdict};
pub use rejection::Rejection;
pub use status::{KeyName, Progress, Status};
pub use version::Version;

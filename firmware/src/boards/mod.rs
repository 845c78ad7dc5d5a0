//! The boards: the only places with a chip's name in them.

#[cfg(feature = "desktop")]
pub mod desktop;

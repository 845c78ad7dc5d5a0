//! The core of Quill: what a drawing arm has to know, and nothing it has to touch.
//!
//! No I/O, no clock, no allocation, no `unsafe`, and no floating point on the way of a set-point:
//! bytes and the time go in, replies and set-points come out. The same code runs on the chip, in the
//! emulator and on a desktop. The rooms follow the path of a drawing:
//!
//! ```text
//! bytes -> line -> command -> session -> move -> steps -> drawing area -> angles -> pulses
//!          \_______ text, lineus ______/ \_______ motion, machine _____/ \_____ arm _____/
//! ```

#![no_std]
#![forbid(unsafe_code)]

pub mod arm;
pub mod drawings;
pub mod lasaur;
pub mod lineus;
pub mod machine;
pub mod motion;
pub mod panel;
pub mod settings;
pub mod text;
pub mod update;
pub mod wifi;

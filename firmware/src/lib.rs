//! The tasks of Quill, generic over a board.
//!
//! What the arm knows lives in `protocol-core`; here it is wired to servos, network and memory. A
//! board brings implementations of the traits in [`board`] and of the ecosystem's (edge-nal,
//! embedded-storage-async), spawns the services, and is the only place with a chip's name in it.

#![cfg_attr(not(feature = "desktop"), no_std)]

mod log;

pub mod board;
pub mod boards;
pub mod services;

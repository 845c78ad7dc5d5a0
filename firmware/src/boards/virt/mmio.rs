//! One 32-bit device register: the only place where this board touches raw addresses of its own.
#![allow(unsafe_code)]

/// A 32-bit register at a fixed address.
#[derive(Clone, Copy)]
pub struct Register(*mut u32);

impl Register {
    /// Names the register at `address`.
    ///
    /// # Safety
    /// `address` must be that of a device register that takes aligned 32-bit accesses for as long as the program runs.
    pub const unsafe fn at(address: usize) -> Self {
        Self(core::ptr::without_provenance_mut(address))
    }

    /// Reads the register.
    pub fn read(self) -> u32 {
        // SAFETY: `at` was promised a device register.
        unsafe { self.0.read_volatile() }
    }

    /// Writes the register.
    pub fn write(self, value: u32) {
        // SAFETY: `at` was promised a device register.
        unsafe { self.0.write_volatile(value) }
    }
}

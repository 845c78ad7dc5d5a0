//! Where the devices of QEMU's `virt` machine are (QEMU 7.2, `hw/riscv/virt.c`).

/// Power-off device ("sifive test").
pub const POWER: usize = 0x0010_0000;
/// Core-local interruptor: software interrupt and timer.
pub const CLINT: usize = 0x0200_0000;
/// Rate of the CLINT's `mtime`, in Hz.
pub const MTIME_HZ: u64 = 10_000_000;
/// Platform-level interrupt controller; context 0 is machine mode of hart 0.
pub const PLIC: usize = 0x0c00_0000;
/// 16550 serial port, registers one byte apart.
pub const UART: usize = 0x1000_0000;
/// PLIC source of the serial port.
pub const UART_SOURCE: u32 = 10;
/// First virtio slot; the others follow at [`VIRTIO_STEP`].
pub const VIRTIO: usize = 0x1000_1000;
/// Distance between virtio slots, and size of one.
pub const VIRTIO_STEP: usize = 0x1000;
/// Number of virtio slots.
pub const VIRTIO_SLOTS: usize = 8;
/// PLIC source of virtio slot 0; the others follow.
pub const VIRTIO_SOURCE: u32 = 1;

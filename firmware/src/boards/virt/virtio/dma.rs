//! Memory for virtqueues: whole pages, taken once at start-up and never given back, as the devices stay for ever.
//! No heap: nothing is allocated per packet, and nothing can run out after start-up.
#![allow(unsafe_code)]

use core::{
    cell::{Cell, UnsafeCell},
    ptr::NonNull,
};

use critical_section::Mutex;
use virtio_drivers::{BufferDirection, Hal, PAGE_SIZE, PhysAddr};

/// Two pages for each virtqueue: network 2 queues, disk 1, outside world 2, and three to spare.
const PAGES: usize = 16;

#[repr(C, align(4096))]
struct Arena(UnsafeCell<[[u8; PAGE_SIZE]; PAGES]>);

// SAFETY: pages are handed out once each, under a critical section.
unsafe impl Sync for Arena {}

static ARENA: Arena = Arena(UnsafeCell::new([[0; PAGE_SIZE]; PAGES]));
static TAKEN: Mutex<Cell<usize>> = Mutex::new(Cell::new(0));

/// The board as `virtio-drivers` sees it: physical addresses are addresses, and there is no cache to mind.
pub struct BoardHal;

// SAFETY: `dma_alloc` returns zeroed pages, page aligned, that nobody else has or gets; sharing is the identity because
// the machine has neither an MMU in use nor an IOMMU.
unsafe impl Hal for BoardHal {
    fn dma_alloc(pages: usize, _direction: BufferDirection) -> (PhysAddr, NonNull<u8>) {
        let first = critical_section::with(|cs| {
            let taken = TAKEN.borrow(cs);
            let first = taken.get();
            if pages > PAGES - first {
                return None;
            }
            taken.set(first + pages);
            Some(first)
        });
        let Some(first) = first else {
            // Address 0 is how the crate is told; it answers `Error::DmaError`.
            return (0, NonNull::dangling());
        };
        // SAFETY: `first` is within the arena.
        let page = unsafe { ARENA.0.get().cast::<u8>().add(first * PAGE_SIZE) };
        (
            page.addr() as PhysAddr,
            NonNull::new(page).expect("inside a static"),
        )
    }

    unsafe fn dma_dealloc(_paddr: PhysAddr, _vaddr: NonNull<u8>, _pages: usize) -> i32 {
        // Reached only when a device could not be set up; its pages are lost, and the board panics anyway.
        0
    }

    unsafe fn mmio_phys_to_virt(_paddr: PhysAddr, _size: usize) -> NonNull<u8> {
        unreachable!("only PCI devices have such memory")
    }

    unsafe fn share(buffer: NonNull<[u8]>, _direction: BufferDirection) -> PhysAddr {
        buffer.cast::<u8>().addr().get() as PhysAddr
    }

    unsafe fn unshare(_paddr: PhysAddr, _buffer: NonNull<[u8]>, _direction: BufferDirection) {}
}

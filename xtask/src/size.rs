//! How much of a chip a program takes.

use anyhow::{Context, Result};
use object::{Object, ObjectSection, SectionFlags};
use std::path::Path;

/// Flash and memory of a program, in bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Size {
    /// Code, constants, and what is copied into memory at the start.
    pub flash: u64,
    /// Memory that is taken for good: code that runs from memory, variables, heap.
    pub memory: u64,
}

impl Size {
    /// Measures an ELF file.
    ///
    /// By section, because totals mislead: esp-hal keeps places free for what the memory map shows twice
    /// (`..._dummy`, `.text_gap`), and calls all memory that is left the stack.
    pub fn of(file: &Path) -> Result<Self> {
        let data = std::fs::read(file).with_context(|| file.display().to_string())?;
        let elf = object::File::parse(&*data)?;
        let mut size = Self::default();
        for section in elf.sections() {
            let name = section.name()?;
            let SectionFlags::Elf { sh_flags } = section.flags() else {
                continue;
            };
            let allocated = sh_flags & u64::from(object::elf::SHF_ALLOC) != 0;
            if !allocated
                || name.contains("dummy")
                || name.contains("gap")
                || name.starts_with(".stack")
            {
                continue;
            }
            // Memory that the bootloader used before, the same for every program.
            if name.starts_with(".dram2") || name.contains("heap") {
                continue;
            }
            let in_memory = [".trap", ".rwtext", ".data", ".rtc_fast"]
                .iter()
                .any(|start| name.starts_with(start));
            let cleared = section.file_range().is_none();
            if !cleared {
                size.flash += section.size();
            }
            if in_memory || cleared {
                size.memory += section.size();
            }
        }
        Ok(size)
    }
}

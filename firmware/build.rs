//! The page, compressed; and linker scripts, by board: here and not in `.cargo/config.toml`, so that the
//! desktop's programs in the same workspace are linked as usual.

use flate2::{Compression, Crc, write::GzEncoder};
use std::error::Error;
use std::io::Write;
use std::path::PathBuf;

fn main() -> Result<(), Box<dyn Error>> {
    let has = |feature: &str| std::env::var_os(format!("CARGO_FEATURE_{feature}")).is_some();
    println!("cargo:rerun-if-changed=build.rs");
    compress_page()?;
    if has("ESP") {
        // esp-hal's memory map, and the strings of defmt, which stay in the ELF file.
        println!("cargo:rustc-link-arg-bins=-Tlinkall.x");
        println!("cargo:rustc-link-arg-bins=-Tdefmt.x");
    }
    if has("VIRT") {
        let here = std::env::var("CARGO_MANIFEST_DIR").unwrap_or_default();
        println!("cargo:rustc-link-search={here}/src/boards/virt");
        println!("cargo:rerun-if-changed=src/boards/virt/memory.x");
        println!("cargo:rustc-link-arg-bins=-Tmemory.x");
        println!("cargo:rustc-link-arg-bins=-Tlink.x");
    }
    Ok(())
}

/// Browsers get the page as it lies in flash: as gzip, with a tag by which they know it again.
fn compress_page() -> Result<(), Box<dyn Error>> {
    const PAGE: &str = "web/index.html";
    println!("cargo:rerun-if-changed={PAGE}");
    let page = std::fs::read(PAGE)?;
    let mut compressed = GzEncoder::new(Vec::new(), Compression::best());
    compressed.write_all(&page)?;
    let target = PathBuf::from(std::env::var("OUT_DIR")?).join("index.html.gz");
    std::fs::write(target, compressed.finish()?)?;
    let mut tag = Crc::new();
    tag.update(&page);
    println!("cargo:rustc-env=QUILL_PAGE_TAG=\"{:08x}\"", tag.sum());
    Ok(())
}

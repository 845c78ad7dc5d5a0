//! Linker scripts, by board: here and not in `.cargo/config.toml`, so that the desktop's programs in the
//! same workspace are linked as usual.

fn main() {
    let has = |feature: &str| std::env::var_os(format!("CARGO_FEATURE_{feature}")).is_some();
    println!("cargo:rerun-if-changed=build.rs");
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
}

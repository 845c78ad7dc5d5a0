//! The version that the firmware says it is: the package's, or `QUILL_VERSION` where a release or a test sets
//! another one.

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-env-changed=QUILL_VERSION");
    let version = std::env::var("QUILL_VERSION")
        .or_else(|_| std::env::var("CARGO_PKG_VERSION"))
        .unwrap_or_default();
    println!("cargo:rustc-env=QUILL_VERSION={version}");
}

//! Hands the board to the compiler and its memory map to the linker.

use std::{env, fs, path::PathBuf};

/// What the linker must find room in. The map's state is checked in `src/state.rs`.
const BUDGETS: &str = r#"
ASSERT(SIZEOF(.vector_table) + SIZEOF(.text) + SIZEOF(.rodata) + SIZEOF(.data) <= 256K, "flash: more than its 256 KB");
ASSERT(SIZEOF(.data) <= 1K, "initialised data: more than its 1 KB");
ASSERT(_stack_start - _stack_end <= 16K, "stack: more than its 16 KB");
"#;

fn main() {
    let name = env::var("BHM_BOARD").unwrap_or_else(|_| String::from("mps2-an500"));
    println!("cargo:rerun-if-env-changed=BHM_BOARD");
    let root = PathBuf::from(env::var("CARGO_MANIFEST_DIR").expect("cargo sets it"));
    let out = PathBuf::from(env::var("OUT_DIR").expect("cargo sets it"));
    let board = root.join("boards").join(&name).with_extension("rs");
    println!("cargo:rerun-if-changed={}", board.display());
    let source = fs::read_to_string(&board).unwrap_or_else(|cause| {
        let known = fs::read_dir(root.join("boards")).into_iter().flatten().flatten();
        let known: Vec<_> =
            known.map(|file| file.path().with_extension("").file_name().map(|n| n.to_owned())).collect();
        panic!("BHM_BOARD={name}: cannot read {}: {cause}; there are {known:?}", board.display());
    });

    // The memory map stands in the board's own documentation, in a block that is marked as a linker script.
    let map: Vec<_> = source
        .lines()
        .skip_while(|line| line.trim() != "//! ```memory.x")
        .skip(1)
        .take_while(|line| line.trim() != "//! ```")
        .map(|line| line.trim_start_matches("//!"))
        .collect();
    assert!(!map.is_empty(), "{}: no ```memory.x block in the module's documentation", board.display());
    fs::write(out.join("memory.x"), format!("{}\n{BUDGETS}", map.join("\n"))).expect("OUT_DIR can be written");
    let path = board.display();
    fs::write(out.join("board.rs"), format!("#[path = {:?}]\nmod selected;\npub use selected::*;\n", path.to_string()))
        .expect("OUT_DIR can be written");

    // Levels below are not compiled in.
    println!("cargo:rerun-if-env-changed=DEFMT_LOG");
    println!("cargo:rustc-env=DEFMT_LOG={}", env::var("DEFMT_LOG").unwrap_or_else(|_| String::from("info")));

    println!("cargo:rustc-link-search={}", out.display());
    for argument in ["-Tlink.x", "-Tdefmt.x", "--nmagic"] {
        println!("cargo:rustc-link-arg-bins={argument}");
    }
}

use std::fs;

use object::{Object, ObjectSection, ObjectSymbol};

use crate::{THREE_PASSES, emulator::program};

/// What lies in flash, and what in memory.
pub(crate) struct Image {
    pub(crate) flash_bytes: u64,
    pub(crate) data_bytes: u64,
    pub(crate) bss_bytes: u64,
}

pub(crate) fn image() -> Option<Image> {
    let bytes = fs::read(program(THREE_PASSES.program)?).expect("a program");
    let file = object::File::parse(&*bytes).expect("an ELF file");
    let size = |name: &str| file.section_by_name(name).map_or(0, |section| section.size());
    Some(Image {
        flash_bytes: [".vector_table", ".text", ".rodata", ".data"].iter().map(|name| size(name)).sum(),
        data_bytes: size(".data"),
        bss_bytes: size(".bss"),
    })
}

/// Routines for what the processor has no instructions for: the names that the compiler calls them by.
fn is_double_precision(name: &str) -> bool {
    let routines =
        ["__aeabi_d", "__aeabi_f2d", "__aeabi_i2d", "__aeabi_ui2d", "__aeabi_l2d", "__aeabi_ul2d", "__aeabi_cd"];
    routines.iter().any(|routine| name.starts_with(routine) && !name.starts_with("__aeabi_div"))
        || ["df2", "df3", "sidf", "didf", "sfdf2", "dfsf2", "dfsi", "dfdi"]
            .iter()
            .any(|end| name.starts_with("__") && name.ends_with(end))
}

fn is_allocator(name: &str) -> bool {
    ["__rust_alloc", "__rust_realloc", "__rustc::__rust_alloc", "malloc", "realloc", "calloc", "_sbrk"]
        .iter()
        .any(|known| name.contains(known))
        || name.contains("alloc::alloc")
}

#[test]
fn the_program_has_no_allocator_and_no_double_precision() {
    let Some(program) = program(THREE_PASSES.program) else { return };
    let bytes = fs::read(program).expect("a program");
    let file = object::File::parse(&*bytes).expect("an ELF file");
    let names: Vec<_> = file.symbols().filter_map(|symbol| symbol.name().ok()).collect();
    assert!(names.contains(&"main") && names.len() > 100, "a program without its symbols: {}", names.len());
    for name in names {
        assert!(!is_double_precision(name) && !is_allocator(name), "{name}");
    }
}

#[test]
fn the_names_that_must_not_be_there_are_known() {
    for name in ["__aeabi_dmul", "__aeabi_f2d", "__muldf3", "__adddf3", "__floatsidf", "__extendsfdf2", "__divdf3"] {
        assert!(is_double_precision(name), "{name}");
    }
    for name in ["__aeabi_fmul", "__aeabi_memcpy", "__aeabi_uldivmod", "__aeabi_lmul"] {
        assert!(!is_double_precision(name), "{name}");
    }
    assert!(is_allocator("__rust_alloc") && is_allocator("_RNvNtCs_alloc::alloc::alloc"));
}

//! Writes shaders that sort the fragments of a pixel in registers, which WGSL has no loops or generics for: registers are
//! named variables, and what is done to each is written out.
//!
//! The networks are Batcher's odd-even merge sort (1968; Knuth, The Art of Computer Programming 3, section 5.2.2): 1, 5,
//! 19, 63 and 191 exchanges for 2, 4, 8, 16 and 32 fragments. Up to 8 there is none with fewer, for 16 the best known has 60, for 32 185.

use std::fmt::Write;

/// Fragments that are sorted in registers at once. The last is a block of more, sorted in place.
const SIZES: [usize; 5] = [2, 4, 8, 16, 32];

/// The module `package::shared::networks`.
///
/// A register without a fragment is 0 and lies behind all others: depths are stored plus one.
pub(crate) fn module() -> String {
    let mut text = String::from(
        "import package::lfb::{load, next_slot};
import package::shared::fragment::{is_in_front, stored_color};
import package::shared::resolve::{ResolveState, resolve_add_numbered};
@if(sorts) import package::shared::sorted::{captured_key, store_key};

const PLUS_ONE = vec4(0u, 0u, 1u, 0u);

// Leaves the nearer of two in the first.
fn order(a: ptr<function, vec4<u32>>, b: ptr<function, vec4<u32>>) {
    let first = *a;
    let second = *b;
    let swaps = is_in_front(second, first);
    *a = select(first, second, swaps);
    *b = select(second, first, swaps);
}
",
    );
    for size in SIZES {
        write_resolve(&mut text, size).expect("strings take all");
    }
    write_sort(&mut text, SIZES[SIZES.len() - 1]).expect("strings take all");
    text
}

/// Adds `fn add_sorted_N`, which adds up to N fragments of a pixel to a resolve, in order.
fn write_resolve(text: &mut String, size: usize) -> std::fmt::Result {
    writeln!(
        text,
        "\nfn add_sorted_{size}(resolve: u32, state: ptr<function, ResolveState>, pixel: u32, first: u32, count: u32) {{"
    )?;
    write_network(text, size, "load")?;
    for i in 0..size {
        writeln!(
            text,
            "    if {i}u < count {{
        resolve_add_numbered(resolve, state, {i}u, stored_color(f{i}), bitcast<f32>(f{i}.z - 1u));
    }}"
        )?;
    }
    writeln!(text, "}}")
}

/// Adds `fn sort_N_in_place`, which sorts up to N fragments from a slot on where they are, and returns the last slot.
fn write_sort(text: &mut String, size: usize) -> std::fmt::Result {
    writeln!(text, "\n@if(sorts)\nfn sort_{size}_in_place(pixel: u32, first: u32, count: u32) -> u32 {{")?;
    write_network(text, size, "captured_key")?;
    writeln!(text, "    slot = first;")?;
    for i in 0..size {
        let advance = advance(i);
        writeln!(text, "    if {i}u < count {{{advance} store_key(slot, f{i} - PLUS_ONE); }}")?;
    }
    writeln!(text, "    return slot;\n}}")
}

/// The module `package::shared::part_network`: a chunk of the parts of a block, put in order.
pub(crate) fn part_module() -> String {
    let mut text = String::from(
        "import package::technique::lucid::order::{Item, is_before, load_listed, store_listed};

// Leaves the nearer of two in the first.
fn order(a: ptr<function, Item>, b: ptr<function, Item>) {
    let first = *a;
    let second = *b;
    let swaps = is_before(second, first);
    *a = select(first, second, swaps);
    *b = select(second, first, swaps);
}

// Up to 32 parts from a place of the lists on.
fn sort_run(first: u32, count: u32, is_last: bool) {
",
    );
    let size = SIZES[SIZES.len() - 1];
    let mut write = |line: String| writeln!(text, "{line}").expect("strings take all");
    for i in 0..size {
        write(format!("    var f{i}: Item;\n    if {i}u < count {{ f{i} = load_listed(first + {i}u); }}"));
    }
    for (a, b) in exchanges(size) {
        write(format!("    order(&f{a}, &f{b});"));
    }
    for i in 0..size {
        write(format!("    if {i}u < count {{ store_listed(first + {i}u, f{i}, is_last); }}"));
    }
    text.push_str("}\n");
    text
}

fn write_network(text: &mut String, size: usize, load: &str) -> std::fmt::Result {
    writeln!(text, "    var slot = first;")?;
    for i in 0..size {
        writeln!(text, "    var f{i}: vec4<u32>;")?;
        let advance = advance(i);
        writeln!(text, "    if {i}u < count {{{advance} f{i} = {load}(slot) + PLUS_ONE; }}")?;
    }
    for (a, b) in exchanges(size) {
        writeln!(text, "    order(&f{a}, &f{b});")?;
    }
    Ok(())
}

/// From the slot of the fragment before to that of fragment `i`: nobody looks for one behind the last.
fn advance(i: usize) -> &'static str {
    if i == 0 { "" } else { " slot = next_slot(slot, pixel);" }
}

/// Pairs of places, the lower of which gets the nearer, one after another. `size` is a power of two.
fn exchanges(size: usize) -> Vec<(usize, usize)> {
    let mut exchanges = Vec::new();
    let mut run = 1;
    while run < size {
        let mut distance = run;
        while distance > 0 {
            let starts = (distance % run..size - distance).step_by(2 * distance);
            for first in starts.flat_map(|start| start..(start + distance).min(size - distance)) {
                if first / (2 * run) == (first + distance) / (2 * run) {
                    exchanges.push((first, first + distance));
                }
            }
            distance /= 2;
        }
        run *= 2;
    }
    exchanges
}

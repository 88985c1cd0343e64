//! Columns of rows into order: sorting networks over eight columns at a time, and what makes them unnecessary.

use fearless_simd::{Bytes, Simd, SimdBase, SimdMask, f64x8, u64x8};

use crate::order::Row;

/// Rows that a network sorts in registers.
pub(crate) const BLOCK: usize = 8;

/// Sorts every column of `rows`, greatest first: blocks by networks, which are then merged.
#[inline(always)]
pub(crate) fn sort_rows<S: Simd>(simd: S, rows: &mut [Row], last: &mut Permutation) {
    if rows.len() > BLOCK {
        if falls(simd, rows) {
            return;
        }
        if rises(simd, rows) {
            rows.reverse();
            return;
        }
    }
    let many = rows.len() > Permutation::FEWEST_ROWS;
    if many && last.apply(simd, rows) {
        return;
    }
    if many {
        last.before(rows);
    }
    for block in rows.chunks_mut(BLOCK) {
        match block.len() {
            0 | 1 => {}
            2 => sort_2(simd, block),
            3 | 4 => sort_4(simd, block),
            _ => sort_8(simd, block),
        }
    }
    let mut sorted = BLOCK;
    while sorted < rows.len() {
        for pair in rows.chunks_mut(2 * sorted).filter(|pair| pair.len() > sorted) {
            merge(simd, pair, sorted);
        }
        sorted *= 2;
    }
    if many {
        last.after(rows);
    }
}

#[inline(always)]
fn load<S: Simd>(simd: S, row: &Row) -> f64x8<S> {
    u64x8::load_array_ref(simd, &row.0).bitcast()
}

#[inline(always)]
fn store<S: Simd>(keys: f64x8<S>, row: &mut Row) {
    keys.bitcast::<u64x8<S>>().store_array(&mut row.0);
}

/// Puts the greater of each two first, in registers.
macro_rules! compare {
    ($keys:ident, $($near:literal $far:literal),*) => {
        $(
            let (a, b) = ($keys[$near], $keys[$far]);
            ($keys[$near], $keys[$far]) = (a.max(b), a.min(b));
        )*
    };
}

/// Sorts up to so many rows in registers by Batcher's odd-even merge sort (1968).
macro_rules! network {
    ($name:ident, $count:literal, $($near:literal $far:literal),*) => {
        #[inline(always)]
        fn $name<S: Simd>(simd: S, rows: &mut [Row]) {
            let mut sorted = [f64x8::splat(simd, 0.0); $count];
            for (keys, row) in sorted.iter_mut().zip(rows.iter()) {
                *keys = load(simd, row);
            }
            compare!(sorted, $($near $far),*);
            for (row, keys) in rows.iter_mut().zip(sorted) {
                store(keys, row);
            }
        }
    };
}

network!(sort_2, 2, 0 1);
network!(sort_4, 4, 0 1, 2 3, 0 2, 1 3, 1 2);
network!(
    sort_8,
    8,
    0 1, 2 3, 4 5, 6 7, 0 2, 1 3, 4 6, 5 7, 1 2, 5 6, 0 4, 1 5, 2 6, 3 7, 2 4, 3 5, 1 2, 3 4, 5 6
);

/// Merges `sorted` sorted rows, a power of two, with the sorted rest: Batcher's bitonic merge, of which the first step
/// compares from both ends, so that the greater key always moves to the front, and rows that are not there behave like 0.
/// Three steps at a time are done in registers; the odd-even merge has fewer comparisons, but they fall into no such blocks.
#[inline(always)]
fn merge<S: Simd>(simd: S, rows: &mut [Row], sorted: usize) {
    let (near, far) = rows.split_at_mut(sorted);
    let first = sorted - far.len();
    for (near, far) in near[first..].iter_mut().zip(far.iter_mut().rev()) {
        exchange(simd, near, far);
    }
    let steps = sorted.ilog2();
    let mut step = sorted / 2;
    for _ in 0..steps % 3 {
        for block in rows.chunks_mut(2 * step).filter(|block| block.len() > step) {
            let (near, far) = block.split_at_mut(step);
            for (near, far) in near.iter_mut().zip(far) {
                exchange(simd, near, far);
            }
        }
        step /= 2;
    }
    // The rest is a multiple of three steps.
    while step >= 1 {
        let stride = step / 4;
        for block in rows.chunks_mut(2 * step) {
            for i in 0..stride.min(block.len()) {
                clean(simd, &mut block[i..], stride);
            }
        }
        step /= 8;
    }
}

/// The steps of 4, 2 and 1 between the first eight rows of those that are `stride` apart.
#[inline(always)]
fn clean<S: Simd>(simd: S, rows: &mut [Row], stride: usize) {
    let mut keys = [f64x8::splat(simd, 0.0); 8];
    for (keys, row) in keys.iter_mut().zip(rows.iter().step_by(stride)) {
        *keys = load(simd, row);
    }
    compare!(keys, 0 4, 1 5, 2 6, 3 7, 0 2, 1 3, 4 6, 5 7, 0 1, 2 3, 4 5, 6 7);
    for (keys, row) in keys.into_iter().zip(rows.iter_mut().step_by(stride)) {
        store(keys, row);
    }
}

/// Compares and exchanges two rows.
#[inline(always)]
fn exchange<S: Simd>(simd: S, near: &mut Row, far: &mut Row) {
    let (a, b) = (load(simd, near), load(simd, far));
    store(a.max(b), near);
    store(a.min(b), far);
}

/// Some bits of a key.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Bits {
    pub(crate) first: u32,
    pub(crate) count: u32,
}

impl Bits {
    #[inline(always)]
    fn of(self, key: u64) -> usize {
        ((key >> self.first) & ((1 << self.count) - 1)) as usize
    }
}

/// How a strip was brought into order. Where large surfaces lie behind each other the next strip shows the same ones, and
/// what ordered one orders the other, which takes a look at each row instead of a sort.
#[derive(Debug, Default)]
pub(crate) struct Permutation {
    /// Where in a key is what tells it from others of its pixel.
    numbers: Bits,
    /// From where the row in each place came.
    from: Vec<u32>,
    /// The row of each fragment of the first pixel, by that number.
    row_of: Vec<u32>,
    ordered: Vec<Row>,
    /// Strips on which it failed since it fitted one.
    failures: u32,
}

impl Permutation {
    /// Sorting fewer rows is as fast.
    const FEWEST_ROWS: usize = BLOCK;

    /// Strips that may fail one after another before no more are tried in a tile.
    const MOST_FAILURES: u32 = 4;

    /// Begins a tile in which keys have numbers less than `end`.
    pub(crate) fn begin(&mut self, numbers: Bits, end: usize) {
        self.numbers = numbers;
        self.from.clear();
        self.failures = 0;
        if self.row_of.len() < end {
            self.row_of.resize(end.next_power_of_two(), 0);
        }
    }

    /// Orders rows as the last ones were; `false`, with nothing done, if that is not their order.
    #[inline(always)]
    fn apply<S: Simd>(&mut self, simd: S, rows: &mut [Row]) -> bool {
        if self.from.len() != rows.len() {
            return false;
        }
        self.ordered.clear();
        let mut last = f64x8::splat(simd, f64::INFINITY);
        for &from in &self.from {
            let row = rows[from as usize];
            let keys = load(simd, &row);
            if !keys.simd_le(last).all_true() {
                self.failures += 1;
                return false;
            }
            last = keys;
            self.ordered.push(row);
        }
        rows.copy_from_slice(&self.ordered);
        self.failures = 0;
        true
    }

    /// Looks at rows before they are sorted ...
    #[inline(always)]
    fn before(&mut self, rows: &[Row]) {
        if self.failures < Self::MOST_FAILURES {
            for (i, row) in rows.iter().enumerate() {
                self.row_of[self.numbers.of(row.0[0])] = i as u32;
            }
        }
    }

    /// ... and afterwards.
    #[inline(always)]
    fn after(&mut self, rows: &[Row]) {
        self.from.clear();
        // Where the first pixel has fewer fragments than others, its keys do not tell all rows apart.
        if self.failures < Self::MOST_FAILURES && rows.last().is_some_and(|row| row.0[0] != 0) {
            self.from.extend(rows.iter().map(|row| self.row_of[self.numbers.of(row.0[0])]));
        }
    }

    pub(crate) fn bytes(&self) -> usize {
        (self.from.capacity() + self.row_of.capacity()) * 4 + self.ordered.capacity() * size_of::<Row>()
    }
}

/// Whether all columns fall, as those of surfaces drawn from front to back do.
#[inline(always)]
fn falls<S: Simd>(simd: S, rows: &[Row]) -> bool {
    for pair in rows.windows(2) {
        if !load(simd, &pair[1]).simd_le(load(simd, &pair[0])).all_true() {
            return false;
        }
    }
    true
}

/// Whether all columns rise, and have no empty place at the end.
#[inline(always)]
fn rises<S: Simd>(simd: S, rows: &[Row]) -> bool {
    for pair in rows.windows(2) {
        if !load(simd, &pair[1]).simd_ge(load(simd, &pair[0])).all_true() {
            return false;
        }
    }
    true
}

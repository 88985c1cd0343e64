//! Columns of rows into order: sorting networks over as many columns at a time as a vector has, and what makes them
//! unnecessary.

use fearless_simd::{Bytes, Simd, SimdBase, SimdMask, f64x8, u64x8};

use crate::order::{Row, STRIP};

/// Rows that a network sorts in registers.
pub(crate) const BLOCK: usize = 8;

/// Rows that have to be there for so many to be sorted: those beyond are 0.
pub(crate) fn padded(count: usize) -> usize {
    if count > BLOCK { count.next_multiple_of(BLOCK) } else { count }
}

/// Sorts every column of the first `count` rows, greatest first: blocks by networks, which are then merged. There are as many
/// rows as [`padded`] tells.
#[inline(always)]
pub(crate) fn sort_rows<S: Simd>(simd: S, rows: &mut [Row], count: usize, last: &mut Permutation) {
    if count <= BLOCK {
        return sort_few(simd, bytemuck::cast_slice_mut(rows));
    }
    let there = &mut rows[..count];
    if falls(simd, there) {
        return;
    }
    if rises(simd, there) {
        there.reverse();
        return;
    }
    if last.apply(simd, there) {
        return;
    }
    last.before(there);
    sort_many(simd, bytemuck::cast_slice_mut(rows));
    last.after(&rows[..count]);
}

/// The keys of a row as numbers of the same order.
type Keys = [f64; STRIP];

/// As many keys of a row as the level has in a vector: so more rows fit into registers.
#[inline(always)]
fn load<S: Simd>(simd: S, keys: &Keys, part: usize) -> S::f64s {
    S::f64s::from_slice(simd, &keys[part..part + S::f64s::LEN])
}

#[inline(always)]
fn store<S: Simd>(values: S::f64s, keys: &mut Keys, part: usize) {
    values.store_slice(&mut keys[part..part + S::f64s::LEN]);
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

/// Sorts so many rows in registers.
macro_rules! network {
    ($name:ident, $count:literal, $($near:literal $far:literal),*) => {
        #[inline(always)]
        fn $name<S: Simd>(simd: S, rows: &mut [Keys; $count]) {
            for part in (0..STRIP).step_by(S::f64s::LEN) {
                let mut sorted = [S::f64s::splat(simd, 0.0); $count];
                for (keys, row) in sorted.iter_mut().zip(rows.iter()) {
                    *keys = load(simd, row, part);
                }
                compare!(sorted, $($near $far),*);
                for (row, keys) in rows.iter_mut().zip(sorted) {
                    store::<S>(keys, row, part);
                }
            }
        }
    };
}

// As few comparisons as are known to do; of 2, 4 and 8 rows Batcher's odd-even merge sort (1968).
network!(sort_2, 2, 0 1);
network!(sort_3, 3, 0 2, 0 1, 1 2);
network!(sort_4, 4, 0 1, 2 3, 0 2, 1 3, 1 2);
network!(sort_5, 5, 0 3, 1 4, 0 2, 1 3, 0 1, 2 4, 1 2, 3 4, 2 3);
network!(sort_6, 6, 0 5, 1 3, 2 4, 1 2, 3 4, 0 3, 2 5, 0 1, 2 3, 4 5, 1 2, 3 4);
network!(sort_7, 7, 0 6, 2 3, 4 5, 0 2, 1 4, 3 6, 0 1, 2 5, 3 4, 1 2, 4 6, 2 3, 4 5, 1 2, 3 4, 5 6);
network!(
    sort_8,
    8,
    0 1, 2 3, 4 5, 6 7, 0 2, 1 3, 4 6, 5 7, 1 2, 5 6, 0 4, 1 5, 2 6, 3 7, 2 4, 3 5, 1 2, 3 4, 5 6
);

/// The last three steps of Batcher's bitonic merge.
macro_rules! clean_in_registers {
    ($keys:ident) => {
        compare!($keys, 0 4, 1 5, 2 6, 3 7, 0 2, 1 3, 4 6, 5 7, 0 1, 2 3, 4 5, 6 7)
    };
}

network!(clean, 8, 0 4, 1 5, 2 6, 3 7, 0 2, 1 3, 4 6, 5 7, 0 1, 2 3, 4 5, 6 7);

/// Sorts up to a block of rows.
#[inline(always)]
fn sort_few<S: Simd>(simd: S, rows: &mut [Keys]) {
    macro_rules! sort {
        ($network:ident) => {
            if let Ok(rows) = rows.try_into() {
                $network(simd, rows);
            }
        };
    }
    match rows.len() {
        2 => sort!(sort_2),
        3 => sort!(sort_3),
        4 => sort!(sort_4),
        5 => sort!(sort_5),
        6 => sort!(sort_6),
        7 => sort!(sort_7),
        8 => sort!(sort_8),
        _ => {}
    }
}

/// Sorts whole blocks of rows.
#[inline(always)]
fn sort_many<S: Simd>(simd: S, rows: &mut [Keys]) {
    for block in rows.as_chunks_mut().0 {
        sort_8(simd, block);
    }
    for pair in rows.as_chunks_mut().0 {
        merge_blocks(simd, pair);
    }
    let mut sorted = 2 * BLOCK;
    while sorted < rows.len() {
        for pair in rows.chunks_mut(2 * sorted).filter(|pair| pair.len() > sorted) {
            merge(simd, pair, sorted);
        }
        sorted *= 2;
    }
}

/// Merges two sorted blocks, as [`merge`] does, in registers.
#[inline(always)]
fn merge_blocks<S: Simd>(simd: S, rows: &mut [Keys; 2 * BLOCK]) {
    for part in (0..STRIP).step_by(S::f64s::LEN) {
        let mut keys = [S::f64s::splat(simd, 0.0); BLOCK];
        for (i, keys) in keys.iter_mut().enumerate() {
            let (near, far) = (load(simd, &rows[i], part), load(simd, &rows[2 * BLOCK - 1 - i], part));
            *keys = near.max(far);
            store::<S>(near.min(far), &mut rows[2 * BLOCK - 1 - i], part);
        }
        clean_in_registers!(keys);
        for (row, keys) in rows.iter_mut().zip(keys) {
            store::<S>(keys, row, part);
        }
        for (keys, row) in keys.iter_mut().zip(&rows[BLOCK..]) {
            *keys = load(simd, row, part);
        }
        clean_in_registers!(keys);
        for (row, keys) in rows[BLOCK..].iter_mut().zip(keys) {
            store::<S>(keys, row, part);
        }
    }
}

/// Merges `sorted` sorted rows, a power of two, with the sorted rest, all of whole blocks: Batcher's bitonic merge, of which the
/// first step compares from both ends, so that the greater key always moves to the front, and rows that are not there
/// behave like 0. Three steps at a time are done in registers; the odd-even merge has fewer comparisons, but they fall into
/// no such blocks.
#[inline(always)]
fn merge<S: Simd>(simd: S, rows: &mut [Keys], sorted: usize) {
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
    while step > BLOCK / 2 {
        let stride = step / 4;
        for block in rows.chunks_mut(2 * step) {
            for i in 0..stride.min(block.len()) {
                clean_far(simd, &mut block[i..], stride);
            }
        }
        step /= 8;
    }
    for block in rows.as_chunks_mut().0 {
        clean(simd, block);
    }
}

/// As [`clean`], of up to eight rows that are `stride` apart.
#[inline(always)]
fn clean_far<S: Simd>(simd: S, rows: &mut [Keys], stride: usize) {
    for part in (0..STRIP).step_by(S::f64s::LEN) {
        let mut keys = [S::f64s::splat(simd, 0.0); BLOCK];
        for (keys, row) in keys.iter_mut().zip(rows.iter().step_by(stride)) {
            *keys = load(simd, row, part);
        }
        clean_in_registers!(keys);
        for (keys, row) in keys.into_iter().zip(rows.iter_mut().step_by(stride)) {
            store::<S>(keys, row, part);
        }
    }
}

/// Compares and exchanges two rows.
#[inline(always)]
fn exchange<S: Simd>(simd: S, near: &mut Keys, far: &mut Keys) {
    for part in (0..STRIP).step_by(S::f64s::LEN) {
        let (a, b) = (load(simd, near, part), load(simd, far, part));
        store::<S>(a.max(b), near, part);
        store::<S>(a.min(b), far, part);
    }
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
            let keys = load_row(simd, &row);
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

/// The keys of a row as numbers of the same order.
#[inline(always)]
fn load_row<S: Simd>(simd: S, row: &Row) -> f64x8<S> {
    u64x8::load_array_ref(simd, &row.0).bitcast()
}

/// Whether all columns fall, as those of surfaces drawn from front to back do.
#[inline(always)]
fn falls<S: Simd>(simd: S, rows: &[Row]) -> bool {
    for pair in rows.windows(2) {
        if !load_row(simd, &pair[1]).simd_le(load_row(simd, &pair[0])).all_true() {
            return false;
        }
    }
    true
}

/// Whether all columns rise, and have no empty place at the end.
#[inline(always)]
fn rises<S: Simd>(simd: S, rows: &[Row]) -> bool {
    for pair in rows.windows(2) {
        if !load_row(simd, &pair[1]).simd_ge(load_row(simd, &pair[0])).all_true() {
            return false;
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use fearless_simd::{Level, dispatch};

    use super::*;
    use crate::simd::levels;

    /// Sorts columns of so many rows, a key told by its row and column, and compares with what sorting each one gives.
    fn check(level: Level, count: usize, key: impl Fn(usize, usize) -> u64) {
        let mut rows = vec![Row::default(); padded(count)];
        for (i, row) in rows[..count].iter_mut().enumerate() {
            row.0 = std::array::from_fn(|column| key(i, column));
        }
        let mut expected: [Vec<u64>; STRIP] =
            std::array::from_fn(|column| rows.iter().map(|row| row.0[column]).collect());
        let mut last = Permutation::default();
        last.begin(Bits { first: 0, count: 20 }, 1 << 20);
        dispatch!(level, simd => sort_rows(simd, &mut rows, count, &mut last));
        for (column, expected) in expected.iter_mut().enumerate() {
            expected.sort_unstable_by(|a, b| b.cmp(a));
            let sorted: Vec<u64> = rows.iter().map(|row| row.0[column]).collect();
            assert_eq!(&sorted, expected, "column {column} of {count} rows");
        }
    }

    /// A network that sorts all zeros and ones sorts everything (Knuth, volume 3, section 5.3.4).
    #[test]
    fn few_rows_of_zeros_and_ones_are_sorted() {
        for (_, level) in levels() {
            for count in 1..=BLOCK {
                for first in (0..1 << count).step_by(STRIP) {
                    check(level, count, |i, column| ((first + column) >> i & 1) as u64);
                }
            }
        }
    }

    #[test]
    fn rows_of_any_number_are_sorted() {
        for (_, level) in levels() {
            for count in (1..200).chain([255, 256, 257, 511, 513, 600]) {
                // Some columns are shorter than others.
                check(level, count, |i, column| match i + column * count / 16 < count {
                    true => ((i * 7919 + column * 31) as u64 * 2_654_435_761 % 1_000_003) << 20 | (i as u64 + 1),
                    false => 0,
                });
            }
        }
    }
}

//! Numbers as people read them.

/// A count in full, in groups of three: `1,234,567`.
pub(crate) fn full_count(count: u64) -> String {
    let digits = count.to_string();
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

/// A count at a glance: `853`, `12.4 k`, `1.2 M`.
pub(crate) fn short_count(count: u64) -> String {
    const UNITS: [(f64, &str); 4] = [(1e12, "T"), (1e9, "G"), (1e6, "M"), (1e3, "k")];
    // From where on the unit below would be rounded up to a thousand.
    let unit = UNITS.iter().find(|(unit, _)| count as f64 >= unit * 0.999_95 && count >= 10_000);
    match unit {
        Some((unit, name)) => format!("{:.1} {name}", count as f64 / unit),
        None => count.to_string(),
    }
}

/// A time in milliseconds at a glance: `3.5 ms`, `35 ms`, `12.3 s`.
pub(crate) fn duration(ms: f64) -> String {
    match ms {
        ..9.95 => format!("{ms:.1} ms"),
        ..9999.5 => format!("{ms:.0} ms"),
        _ => format!("{:.1} s", ms / 1e3),
    }
}

/// A figure with three digits that count: `0.0123`, `12.3`, `1,234`.
pub(crate) fn figure(value: f64) -> String {
    if value.abs() >= 999.5 {
        return full_count(value.round() as u64);
    }
    let magnitude = if value == 0.0 { 0 } else { value.abs().log10().floor() as i32 };
    // What is rounded up to the next power of ten has a digit more before its point.
    let magnitude = if (value.abs() / 10f64.powi(magnitude)) >= 9.995 { magnitude + 1 } else { magnitude };
    format!("{value:.*}", (2 - magnitude).clamp(0, 9) as usize)
}

/// An amount of memory at a glance: `853 B`, `12.4 KiB`, `1.2 GiB`.
pub(crate) fn memory(bytes: u64) -> String {
    const UNITS: [(u64, &str); 3] = [(1 << 30, "GiB"), (1 << 20, "MiB"), (1 << 10, "KiB")];
    match UNITS.iter().find(|(unit, _)| bytes >= *unit) {
        Some((unit, name)) => format!("{:.1} {name}", bytes as f64 / *unit as f64),
        None => format!("{bytes} B"),
    }
}

/// `1 picture`, `2 pictures`.
pub(crate) fn plural(count: u64, noun: &str) -> String {
    format!("{} {noun}{}", full_count(count), if count == 1 { "" } else { "s" })
}

/// Rows in columns two spaces apart: the first flush left, the others flush right. The first row is the heading.
pub(crate) fn table(rows: &[Vec<String>]) -> String {
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width = |i: usize| rows.iter().filter_map(|row| row.get(i)).map(|cell| cell.chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let line = |row: &Vec<String>| {
        let cells = row.iter().zip(&widths).enumerate().map(|(i, (cell, &width))| match i {
            0 => format!("{cell:width$}"),
            _ => format!("  {cell:>width$}"),
        });
        cells.collect::<String>().trim_end().to_owned() + "\n"
    };
    rows.iter().map(line).collect()
}

/// Names and texts in two columns, each line indented.
pub(crate) fn columns<'a>(rows: impl IntoIterator<Item = (&'a str, String)>) -> String {
    let rows: Vec<_> = rows.into_iter().collect();
    let width = rows.iter().map(|(name, _)| name.chars().count()).max().unwrap_or(0);
    rows.iter().map(|(name, text)| format!("  {name:width$}  {text}\n")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_in_full_and_at_a_glance() {
        for (count, full, short) in [
            (0, "0", "0"),
            (999, "999", "999"),
            (9_999, "9,999", "9999"),
            (10_000, "10,000", "10.0 k"),
            (999_949, "999,949", "999.9 k"),
            (999_950, "999,950", "1.0 M"),
            (1_234_567, "1,234,567", "1.2 M"),
            (12_345_678_901, "12,345,678,901", "12.3 G"),
        ] {
            assert_eq!((full_count(count).as_str(), short_count(count).as_str()), (full, short));
        }
    }

    #[test]
    fn figures_have_three_digits() {
        for (value, text) in [
            (0.0, "0.00"),
            (0.012_34, "0.0123"),
            (0.999_9, "1.00"),
            (9.994, "9.99"),
            (9.996, "10.0"),
            (99.96, "100"),
            (123.4, "123"),
            (999.6, "1,000"),
            (12_345.6, "12,346"),
        ] {
            assert_eq!(figure(value), text);
        }
    }

    #[test]
    fn tables_line_up() {
        let rows = [["a", "bb"], ["ccc", "d"]].map(|row| row.map(str::to_owned).to_vec());
        assert_eq!(table(&rows), "a    bb\nccc   d\n");
    }

    #[test]
    fn amounts_of_memory() {
        for (bytes, text) in
            [(0, "0 B"), (1023, "1023 B"), (1536, "1.5 KiB"), (5 << 20, "5.0 MiB"), (3 << 29, "1.5 GiB")]
        {
            assert_eq!(memory(bytes), text);
        }
    }

    #[test]
    fn times() {
        for (ms, text) in
            [(0.04, "0.0 ms"), (3.46, "3.5 ms"), (9.96, "10 ms"), (9999.4, "9999 ms"), (12_340.0, "12.3 s")]
        {
            assert_eq!(duration(ms), text);
        }
    }
}

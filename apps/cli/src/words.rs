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

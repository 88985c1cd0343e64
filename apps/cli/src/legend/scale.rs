//! Which numbers stand along a bar.

/// A number along the bar, in units from the bar's left end.
#[derive(Debug, PartialEq)]
pub(super) struct Tick {
    /// Middle of the number's share of the bar.
    pub(super) x: u32,
    /// Where its label starts; all of it lies between the bar's ends.
    pub(super) label_left: u32,
    pub(super) label: String,
}

/// Characters between two numbers at least.
const GAP: u32 = 1;

/// 0, the end of the scale, and as many round numbers between them as there is room for, under the middles of their shares
/// of a bar of this width.
pub(super) fn ticks(full_scale: u32, bar_width: u32, character_width: u32) -> Vec<Tick> {
    let (end, bar) = (u64::from(full_scale), u64::from(bar_width));
    let gap = GAP * character_width;
    let label_width = |count: u64| short(count).len() as u32 * character_width;
    let tick = |count: u64| {
        let x = ((2 * count + 1) * bar / (2 * (end + 1))) as u32;
        let label_left = x.saturating_sub(label_width(count) / 2).min(bar_width - label_width(count));
        Tick { x, label_left, label: short(count) }
    };
    let (first, last) = (tick(0), tick(end));
    let free = first.label_left + label_width(0) + gap..(last.label_left + 1).saturating_sub(gap);

    let widest = u64::from(label_width(end) + 2 * gap);
    let step = round_numbers().take_while(|&step| step < end).find(|&step| bar * step / (end + 1) >= widest);
    let between = step.into_iter().flat_map(|step| (1..).map(move |i| i * step).take_while(|&count| count < end));
    let between = between
        .map(|count| (tick(count), label_width(count)))
        .filter(|(tick, width)| free.contains(&tick.label_left) && free.contains(&(tick.label_left + width)))
        .map(|(tick, _)| tick);
    [first].into_iter().chain(between).chain([last]).collect()
}

/// 1, 2, 5, 10, 20, 50 ...
fn round_numbers() -> impl Iterator<Item = u64> {
    (0..10).flat_map(|power| [1, 2, 5].map(|digit| digit * 10u64.pow(power)))
}

/// A number in at most six characters, exact up to 99999.
fn short(count: u64) -> String {
    match count {
        0..100_000 => count.to_string(),
        100_000..1_000_000 => format!("{}k", count / 1_000),
        1_000_000..1_000_000_000 => format!("{:.1}M", count as f64 / 1e6),
        _ => format!("{:.1}G", count as f64 / 1e9),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_round_and_do_not_touch() {
        for full_scale in (1..200).chain([999, 1234, 65_536, 1_000_000, u32::MAX]) {
            for (bar_width, character_width) in [(120, 6), (180, 6), (300, 10)] {
                let ticks = ticks(full_scale, bar_width, character_width);
                assert_eq!(ticks.first().unwrap().label, "0");
                assert_eq!(ticks.last().unwrap().label, short(full_scale.into()));
                let mut free_from = 0;
                for tick in &ticks {
                    assert!(tick.label_left >= free_from, "{full_scale}: {ticks:?}");
                    free_from = tick.label_left + (tick.label.len() as u32 + GAP) * character_width;
                }
                assert!(free_from - GAP * character_width <= bar_width);
            }
        }
    }

    #[test]
    fn a_short_scale_shows_every_number() {
        let labels: Vec<String> = ticks(5, 300, 10).into_iter().map(|tick| tick.label).collect();
        assert_eq!(labels, ["0", "1", "2", "3", "4", "5"]);
        let labels: Vec<String> = ticks(23, 300, 10).into_iter().map(|tick| tick.label).collect();
        assert_eq!(labels, ["0", "5", "10", "15", "20", "23"]);
    }
}

//! Axes of plots, marked with round numbers, powers of ten, or names.

use std::ops::Range;

use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};

use crate::words::{figure, short_count};

/// Where values lie along an axis, and where it is marked.
#[derive(Debug, Clone)]
pub(super) struct Scale {
    /// Values at both ends.
    ends: (f64, f64),
    marks: Vec<f64>,
    kind: Kind,
}

#[derive(Debug, Clone)]
enum Kind {
    Straight,
    Logarithmic,
    /// Names from the top down, a unit apart.
    Names(Vec<String>),
}

impl Scale {
    /// An axis that holds all of some values: from 0, or if `is_log`, by powers of ten.
    pub(super) fn of(values: impl Iterator<Item = f64> + Clone, is_log: bool) -> Self {
        let least = values.clone().fold(f64::INFINITY, f64::min);
        let greatest = values.fold(0.0, f64::max);
        if is_log && least > 0.0 && greatest.is_finite() && least <= greatest {
            Self::logarithmic(least / 1.15, greatest * 1.15)
        } else {
            Self::straight(if greatest > 0.0 && greatest.is_finite() { greatest * 1.05 } else { 1.0 })
        }
    }

    /// A row for each name.
    pub(super) fn names(names: Vec<String>) -> Self {
        let marks = (0..names.len()).map(|i| Self::row(names.len(), i)).collect();
        Self { ends: (0.0, names.len() as f64), marks, kind: Kind::Names(names) }
    }

    /// Where the middle of a row is, out of so many.
    pub(super) fn row(count: usize, i: usize) -> f64 {
        (count - 1 - i) as f64 + 0.5
    }

    fn straight(high: f64) -> Self {
        let rough = high / 6.0;
        let decade = 10f64.powf(rough.log10().floor());
        let step = [1.0, 2.0, 5.0].map(|step| step * decade).into_iter().find(|&step| step >= rough);
        let step = step.unwrap_or(10.0 * decade);
        let marks = (0..).map(|i| f64::from(i) * step).take_while(|&mark| mark <= high).collect();
        Self { ends: (0.0, high), marks, kind: Kind::Straight }
    }

    fn logarithmic(low: f64, high: f64) -> Self {
        // Where there are few powers of ten, what lies between is marked too.
        let steps: &[f64] = match high / low {
            ..6.0 => &[1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0],
            ..150.0 => &[1.0, 2.0, 5.0],
            _ => &[1.0],
        };
        let decades = low.log10().floor() as i32..=high.log10().ceil() as i32;
        let marks = decades.flat_map(|decade| steps.iter().map(move |step| step * 10f64.powi(decade)));
        let marks = marks.filter(|mark| (low..=high).contains(mark)).collect();
        Self { ends: (low, high), marks, kind: Kind::Logarithmic }
    }

    /// 0 at the beginning, 1 at the end.
    fn part(&self, value: f64) -> f64 {
        let (low, high) = self.ends;
        match self.kind {
            Kind::Logarithmic => (value / low).ln() / (high / low).ln(),
            Kind::Straight | Kind::Names(_) => (value - low) / (high - low),
        }
    }
}

impl Ranged for Scale {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, (from, to): (i32, i32)) -> i32 {
        from + (self.part(*value) * f64::from(to - from)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, _: Hint) -> Vec<f64> {
        self.marks.clone()
    }

    fn range(&self) -> Range<f64> {
        self.ends.0..self.ends.1
    }
}

impl ValueFormatter<f64> for Scale {
    fn format_ext(&self, &value: &f64) -> String {
        match &self.kind {
            Kind::Names(names) => {
                names.iter().rev().nth(value as usize).map_or_else(String::new, |name| name.to_owned())
            }
            _ if value == 0.0 => "0".to_owned(),
            _ if value >= 10_000.0 => short_count(value.round() as u64).replace(".0 ", " "),
            _ => {
                let text = figure(value).replace(',', "");
                if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn marked(scale: &Scale) -> Vec<String> {
        scale.marks.iter().map(|mark| scale.format_ext(mark)).collect()
    }

    #[test]
    fn axes_are_marked_with_round_numbers() {
        let of = |values: &[f64], is_log| marked(&Scale::of(values.iter().copied(), is_log));
        assert_eq!(of(&[0.0, 20e6], false), ["0", "5 M", "10 M", "15 M", "20 M"]);
        assert_eq!(of(&[1.0, 4096.0], true), ["1", "10", "100", "1000"]);
        assert_eq!(of(&[0.15, 2.2], true), ["0.2", "0.5", "1", "2"]);
        assert_eq!(of(&[9.0, 16.5], true), ["10", "15"]);
        assert_eq!(of(&[], true)[0], "0");
    }

    #[test]
    fn values_lie_in_proportion_and_names_from_the_top_down() {
        let straight = Scale::of([0.0, 100.0 / 1.05].into_iter(), false);
        assert_eq!(straight.map(&50.0, (0, 1000)), 500);
        let logarithmic = Scale::logarithmic(1.0, 1e4);
        assert_eq!((logarithmic.map(&100.0, (0, 1000)), logarithmic.map(&1.0, (7, 1000))), (500, 7));
        let names = Scale::names(["first", "last"].map(str::to_owned).to_vec());
        assert_eq!(marked(&names), ["first", "last"]);
        assert!(Scale::row(2, 0) > Scale::row(2, 1));
    }
}

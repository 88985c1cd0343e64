//! Plots as SVG, to stand in the page. Lines and texts that belong to the page rather than to the figures carry its own
//! colours, by style sheet.

use anyhow::anyhow;
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::series::LineSeries;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::exhibit::{Form, Plot};
use super::scale::Scale;

/// Colours of variants, and of steps; told apart by most eyes, and on light and dark pages.
const COLORS: [RGBColor; 14] = [
    RGBColor(0x3a, 0x5b, 0xd9),
    RGBColor(0xe0, 0x7b, 0x1f),
    RGBColor(0x1f, 0x9d, 0x77),
    RGBColor(0xc9, 0x3d, 0x8f),
    RGBColor(0x8a, 0x6d, 0xd8),
    RGBColor(0xb8, 0x96, 0x1a),
    RGBColor(0x2f, 0xa7, 0xd0),
    RGBColor(0xd1, 0x49, 0x3f),
    RGBColor(0x6a, 0x8f, 0x3c),
    RGBColor(0x9a, 0x5f, 0x3b),
    RGBColor(0x7f, 0x86, 0x92),
    RGBColor(0x4f, 0x5a, 0x6b),
    RGBColor(0xf0, 0xa8, 0xb8),
    RGBColor(0x14, 0x6b, 0x6b),
];
const GREY: RGBColor = RGBColor(0x88, 0x88, 0x88);
const WIDTH: u32 = 760;
const FONT: (&str, u32) = ("sans-serif", 14);

/// A name with its colour.
pub(super) type Key = (String, String);

/// The plot, with what its colours mean. `names` is the order of colours: the same name has the same one in all plots of a
/// series.
pub(super) fn draw(plot: &Plot, names: &[String]) -> anyhow::Result<(String, Vec<Key>)> {
    let shown = plot.form.names();
    let names: Vec<String> = match plot.form {
        // Steps are other things than variants.
        Form::Bars { .. } => shown.clone(),
        // What is no variant comes after them.
        Form::Lines { .. } | Form::Rows { .. } => {
            names.iter().chain(shown.iter().filter(|name| !names.contains(name))).cloned().collect()
        }
    };
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, (WIDTH, plot.height())).into_drawing_area();
        let result = match &plot.form {
            Form::Lines { axis, is_log_axis, lines } => plot.lines(&area, (axis, *is_log_axis), lines, &names),
            Form::Rows { rows } => plot.rows(&area, rows, &names),
            Form::Bars { bars } => plot.bars(&area, bars, &names),
        };
        result.and_then(|()| area.present()).map_err(|error| anyhow!("cannot draw a plot: {error}"))?;
    }
    let keys = names.iter().filter(|name| shown.contains(name));
    Ok((svg, keys.map(|name| (name.clone(), hex(color(&names, name)))).collect()))
}

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Drawn<'a> = Result<(), DrawingAreaErrorKind<<SVGBackend<'a> as DrawingBackend>::ErrorType>>;

impl Form {
    fn names(&self) -> Vec<String> {
        let mut names: Vec<String> = Vec::new();
        let mut add = |name: &String| {
            if !names.contains(name) {
                names.push(name.clone());
            }
        };
        match self {
            Self::Lines { lines, .. } => lines.iter().for_each(|(name, _)| add(name)),
            Self::Rows { rows: all } | Self::Bars { bars: all } => {
                all.iter().flat_map(|(_, values)| values).for_each(|(name, _)| add(name));
            }
        }
        names
    }
}

impl Plot {
    fn height(&self) -> u32 {
        match &self.form {
            Form::Lines { .. } => 400,
            Form::Rows { rows: labels } | Form::Bars { bars: labels } => 70 + 30 * labels.len() as u32,
        }
    }

    fn lines<'a>(
        &self,
        area: &Area<'a>,
        (axis, is_log_axis): (&str, bool),
        lines: &[(String, Vec<(f64, f64)>)],
        names: &[String],
    ) -> Drawn<'a> {
        let all = || lines.iter().flat_map(|(_, points)| points);
        let across = Scale::of(all().map(|point| point.0), is_log_axis);
        let up = Scale::of(all().map(|point| point.1), self.is_log);
        let mut chart = ChartBuilder::on(area)
            .margin(12)
            .margin_right(28)
            .x_label_area_size(46)
            .y_label_area_size(64)
            .build_cartesian_2d(across, up)?;
        chart
            .configure_mesh()
            .x_desc(axis)
            .y_desc(&*self.values)
            .bold_line_style(GREY.mix(0.25))
            .light_line_style(TRANSPARENT)
            .axis_style(GREY.mix(0.6))
            .label_style(FONT)
            .axis_desc_style(FONT)
            .draw()?;
        for (name, points) in lines {
            let color = color(names, name);
            chart.draw_series(LineSeries::new(points.iter().copied(), color.stroke_width(2)))?;
            chart.draw_series(points.iter().map(|&point| Circle::new(point, 3, color.filled())))?;
        }
        Ok(())
    }

    fn rows<'a>(&self, area: &Area<'a>, rows: &[(String, Vec<(String, f64)>)], names: &[String]) -> Drawn<'a> {
        let values = rows.iter().flat_map(|(_, values)| values).map(|value| value.1);
        let across = Scale::of(values, self.is_log);
        let labels: Vec<String> = rows.iter().map(|(label, _)| label.clone()).collect();
        let count = labels.len();
        let mut chart = self.labelled(area, labels, across)?;
        for (i, (_, values)) in rows.iter().enumerate() {
            let y = Scale::row(count, i);
            let ends = [
                values.iter().map(|v| v.1).fold(f64::INFINITY, f64::min),
                values.iter().map(|v| v.1).fold(0.0, f64::max),
            ];
            if ends[0] < ends[1] {
                let line = ends.map(|end| (end, y));
                chart.draw_series([PathElement::new(line.to_vec(), GREY.mix(0.5))])?;
            }
            chart.draw_series(
                values.iter().map(|(name, value)| Circle::new((*value, y), 5, color(names, name).filled())),
            )?;
        }
        Ok(())
    }

    fn bars<'a>(&self, area: &Area<'a>, bars: &[(String, Vec<(String, f64)>)], names: &[String]) -> Drawn<'a> {
        const HALF_HEIGHT: f64 = 0.34;
        let sums = bars.iter().map(|(_, parts)| parts.iter().map(|part| part.1).sum::<f64>());
        let across = Scale::of([0.0].into_iter().chain(sums), false);
        let labels: Vec<String> = bars.iter().map(|(label, _)| label.clone()).collect();
        let count = labels.len();
        let mut chart = self.labelled(area, labels, across)?;
        for (i, (_, parts)) in bars.iter().enumerate() {
            let y = Scale::row(count, i);
            let mut left = 0.0;
            for (name, value) in parts {
                let corners = [(left, y - HALF_HEIGHT), (left + value, y + HALF_HEIGHT)];
                chart.draw_series([Rectangle::new(corners, color(names, name).filled())])?;
                left += value;
            }
        }
        Ok(())
    }

    /// A chart with a row for each label, the first at the top.
    fn labelled<'a, 'b>(
        &self,
        area: &'b Area<'a>,
        labels: Vec<String>,
        across: Scale,
    ) -> Result<Chart<'a, 'b>, DrawingAreaErrorKind<<SVGBackend<'a> as DrawingBackend>::ErrorType>> {
        let longest = labels.iter().map(|label| label.chars().count()).max().unwrap_or(0) as u32;
        let mut chart = ChartBuilder::on(area)
            .margin(12)
            .margin_right(28)
            .x_label_area_size(46)
            .y_label_area_size(24 + 8 * longest)
            .build_cartesian_2d(across, Scale::names(labels))?;
        chart
            .configure_mesh()
            .x_desc(&*self.values)
            .disable_y_mesh()
            .bold_line_style(GREY.mix(0.25))
            .light_line_style(TRANSPARENT)
            .axis_style(GREY.mix(0.6))
            .label_style(FONT)
            .y_label_style(TextStyle::from(FONT).pos(Pos::new(HPos::Right, VPos::Center)))
            .axis_desc_style(FONT)
            .draw()?;
        Ok(chart)
    }
}

type Chart<'a, 'b> = ChartContext<'b, SVGBackend<'a>, Cartesian2d<Scale, Scale>>;

fn color(names: &[String], name: &str) -> RGBColor {
    COLORS[names.iter().position(|known| known == name).unwrap_or(0) % COLORS.len()]
}

fn hex(RGBColor(r, g, b): RGBColor) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plot_of_every_form_is_drawn() {
        let values =
            |list: &[(&str, f64)]| list.iter().map(|&(name, value)| (name.to_owned(), value)).collect::<Vec<_>>();
        let lines = vec![("cpu".to_owned(), vec![(1.0, 2.0), (10.0, 30.0)]), ("alpha".to_owned(), vec![(1.0, 1.0)])];
        let rows = vec![("<b>".to_owned(), values(&[("cpu", 2.0), ("alpha", 0.5)]))];
        let names = ["cpu", "alpha"].map(str::to_owned);
        for form in [
            Form::Lines { axis: "n".into(), is_log_axis: true, lines },
            Form::Rows { rows: rows.clone() },
            Form::Bars { bars: rows },
        ] {
            let is_log = !matches!(form, Form::Bars { .. });
            let (svg, keys) = draw(&Plot { values: "ms".into(), is_log, form }, &names).unwrap();
            assert!(svg.starts_with("<svg ") && svg.trim_end().ends_with("</svg>") && !svg.contains("<b>"), "{svg}");
            assert_eq!(keys[0], ("cpu".to_owned(), "#3a5bd9".to_owned()));
            assert!(svg.to_lowercase().contains(&keys[1].1));
        }
    }
}

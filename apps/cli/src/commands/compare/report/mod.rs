//! The report: one page with everything in it, that needs no network and no other file.

use std::collections::BTreeMap;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use pellucid::core::heat_map;
use serde::Serialize;

use super::document::Document;
use crate::commands::folder::Folder;

const PAGE: &str = include_str!("page.html");
const STYLE: &str = include_str!("style.css");
const SCRIPT: &str = include_str!("script.js");

/// What the page's script is given.
#[derive(Serialize)]
struct Data<'a> {
    document: &'a Document,
    /// Pictures by file name: a data URI, or the name of another picture that is the same.
    pictures: BTreeMap<&'a str, String>,
    /// Colours of the heat map by depth complexity.
    scale: Vec<String>,
}

/// Colours of the histogram; deeper scales are thinned out.
const SCALE_COLORS: u32 = 96;

/// The page; pictures are read from the folder, where they are already.
pub(super) fn page(document: &Document, folder: &Folder) -> anyhow::Result<String> {
    let mut contents: BTreeMap<Vec<u8>, &str> = BTreeMap::new();
    let mut pictures = BTreeMap::new();
    for name in document.pictures() {
        let bytes = folder.read(name)?;
        let source = match contents.get(&bytes) {
            Some(&same) => same.to_owned(),
            None => format!("data:image/png;base64,{}", STANDARD.encode(&bytes)),
        };
        contents.entry(bytes).or_insert(name);
        pictures.insert(name, source);
    }
    let greatest = document.max_depth_complexity().max(1);
    let bins = greatest.min(SCALE_COLORS);
    let counts = (0..=bins).map(|i| (u64::from(i) * u64::from(greatest) / u64::from(bins)) as u32);
    let scale = counts.map(|count| heat_map::color(count, greatest)).map(|[r, g, b]| format!("#{r:02x}{g:02x}{b:02x}"));
    // Nothing in the data may end the element that holds it.
    let data = serde_json::to_string(&Data { document, pictures, scale: scale.collect() })?.replace('<', "\\u003c");
    // A scene's name last in its part, and data apart, so that whatever they hold is taken for text.
    let (before, after) = PAGE.split_once("{{data}}").expect("the page has a place for data");
    let before = before.replace("{{style}}", STYLE).replace("{{title}}", &escaped(document.scene()));
    Ok(before + &data + &after.replace("{{script}}", SCRIPT))
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_asks_for_nothing_from_elsewhere() {
        for part in [PAGE, STYLE, SCRIPT] {
            for word in ["http:", "https:", "@import", "fetch(", "src=\"/", "import("] {
                let there = part.replace("http://www.w3.org/2000/svg", "");
                assert!(!there.contains(word), "{word}");
            }
        }
    }

    #[test]
    fn names_of_scenes_are_text() {
        assert_eq!(escaped("<b>\"&"), "&lt;b&gt;&quot;&amp;");
    }
}

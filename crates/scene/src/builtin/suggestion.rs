//! "Did you mean ...?"

/// ` (did you mean '...'?)` if one of `known` is close to `asked`, otherwise nothing.
pub(super) fn did_you_mean(asked: &str, known: &[&str]) -> String {
    // Nobody mistypes a name at this length, and the distance takes quadratic time.
    if asked.len() > 64 {
        return String::new();
    }
    let asked = asked.to_ascii_lowercase();
    known
        .iter()
        .map(|name| (strsim::damerau_levenshtein(&asked, name), name))
        .filter(|(distance, name)| *distance <= name.len().div_ceil(3))
        .min()
        .map(|(_, name)| format!(" (did you mean '{name}'?)"))
        .unwrap_or_default()
}

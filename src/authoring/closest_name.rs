//! Did-you-mean suggestions: the known name that is closest to a misspelled one.

use strsim::osa_distance;

/// Returns the name among `known` that `word` was probably meant to be: equal except for case and separators, or a few
/// typing errors away. The number of errors is the optimal string alignment distance, which counts insertions,
/// deletions, replacements and swaps of neighboring letters.
///
/// One error is allowed per three letters of the known name, and at most two, so that short names do not match
/// unrelated words. An exact match is returned too; check for it first.
pub(super) fn closest_name<'a>(word: &str, known: &[&'a str]) -> Option<&'a str> {
    let word = normalized(word);
    known
        .iter()
        .map(|&name| (osa_distance(&word, &normalized(name)), name))
        .filter(|&(distance, name)| distance <= (name.len() / 3).min(2))
        .min_by_key(|&(distance, _)| distance)
        .map(|(_, name)| name)
}

/// Returns the letters and digits of `word` in lower case.
fn normalized(word: &str) -> String {
    word.chars().filter(|c| c.is_alphanumeric()).flat_map(char::to_lowercase).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const NAMES: &[&str] = &["MarkerAnchor", "WorldOrigin", "id"];

    #[test]
    fn case_separators_and_two_typing_errors_are_forgiven() {
        for word in ["markeranchor", "marker_anchor", "Marker Anchor", "MarkerAnchors", "MakrerAnchor", "MrkrAnchor"] {
            assert_eq!(closest_name(word, NAMES), Some("MarkerAnchor"), "{word}");
        }
        assert_eq!(closest_name("WorldOrgin", NAMES), Some("WorldOrigin"));
        assert_eq!(closest_name("ID", NAMES), Some("id"));
    }

    #[test]
    fn other_words_stay_strangers() {
        for word in ["", "Anchor", "MarkerAnc", "cycles", "iz", "World", "targetNames"] {
            assert_eq!(closest_name(word, NAMES), None, "{word}");
        }
    }

    #[test]
    fn a_swap_of_neighbors_is_one_typing_error() {
        let count = |a: &str, b: &str| osa_distance(&normalized(a), &normalized(b));
        assert_eq!(count("ball", "blal"), 1);
        assert_eq!(count("ball", ""), 4);
        assert_eq!(count("", "ball"), 4);
        assert_eq!(count("kitten", "sitting"), 3);
    }
}

//! Which known name a misspelled one is closest to.

/// The name among `known` that `word` nearly is: equal but for case and separators, or a few slips of the keyboard away.
///
/// One slip is allowed for every three letters of the known name, two at most, so that short names do not attract
/// strangers. An exact match is returned too; ask for it first.
pub(super) fn closest<'a>(word: &str, known: &[&'a str]) -> Option<&'a str> {
    let word = folded(word);
    known
        .iter()
        .map(|&name| (slips(&word, &folded(name)), name))
        .filter(|&(slips, name)| slips <= (name.len() / 3).min(2))
        .min_by_key(|&(slips, _)| slips)
        .map(|(_, name)| name)
}

/// Lower case, letters and digits only.
fn folded(word: &str) -> Vec<char> {
    word.chars().filter(|c| c.is_alphanumeric()).flat_map(char::to_lowercase).collect()
}

/// Optimal string alignment distance: insertions, deletions, replacements and swaps of neighbors that turn `a` into `b`.
fn slips(a: &[char], b: &[char]) -> usize {
    let mut before_last: Vec<usize> = Vec::new();
    let mut last: Vec<usize> = (0..=b.len()).collect();
    for i in 1..=a.len() {
        let mut row = vec![i];
        for j in 1..=b.len() {
            let replaced = last[j - 1] + usize::from(a[i - 1] != b[j - 1]);
            let mut least = replaced.min(last[j] + 1).min(row[j - 1] + 1);
            if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                least = least.min(before_last[j - 2] + 1);
            }
            row.push(least);
        }
        before_last = std::mem::replace(&mut last, row);
    }
    last[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    const NAMES: &[&str] = &["MarkerAnchor", "WorldOrigin", "id"];

    #[test]
    fn case_separators_and_two_slips_are_forgiven() {
        for word in ["markeranchor", "marker_anchor", "Marker Anchor", "MarkerAnchors", "MakrerAnchor", "MrkrAnchor"] {
            assert_eq!(closest(word, NAMES), Some("MarkerAnchor"), "{word}");
        }
        assert_eq!(closest("WorldOrgin", NAMES), Some("WorldOrigin"));
        assert_eq!(closest("ID", NAMES), Some("id"));
    }

    #[test]
    fn other_words_stay_strangers() {
        for word in ["", "Anchor", "MarkerAnc", "cycles", "iz", "World", "targetNames"] {
            assert_eq!(closest(word, NAMES), None, "{word}");
        }
    }

    #[test]
    fn a_swap_of_neighbors_is_one_slip() {
        let count = |a: &str, b: &str| slips(&folded(a), &folded(b));
        assert_eq!(count("ball", "blal"), 1);
        assert_eq!(count("ball", ""), 4);
        assert_eq!(count("", "ball"), 4);
        assert_eq!(count("kitten", "sitting"), 3);
    }
}

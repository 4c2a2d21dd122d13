//! "Did you mean ...?": the nearest of the words that would have been right.

/// The candidate that was probably meant by a word, if one is near enough.
///
/// Near is by Damerau-Levenshtein distance (insertions, deletions, substitutions, swaps of
/// neighbours), ignoring case: a third of the longer word's letters may be wrong.
pub(super) fn nearest<'c>(
    word: &str,
    candidates: impl IntoIterator<Item = &'c str>,
) -> Option<&'c str> {
    let word = word.to_lowercase();
    let letters = word.chars().count();
    candidates
        .into_iter()
        .filter_map(|candidate| {
            let length = candidate.chars().count();
            let allowed = (letters.max(length) / 3).max(1);
            // The distance is at least the difference in length: a long word costs no time.
            if letters.abs_diff(length) > allowed {
                return None;
            }
            let distance = strsim::damerau_levenshtein(&word, &candidate.to_lowercase());
            (distance <= allowed && distance < letters.max(length)).then_some((distance, candidate))
        })
        .min()
        .map(|(_, candidate)| candidate)
}

/// Words for a message: `a`, `b` and `c`, or with another conjunction.
pub(super) fn list<'w>(words: impl IntoIterator<Item = &'w str>, conjunction: &str) -> String {
    let mut words: Vec<_> = words.into_iter().map(|word| format!("`{word}`")).collect();
    let last = words.pop();
    match (words.is_empty(), last) {
        (_, None) => String::new(),
        (true, Some(last)) => last,
        (false, Some(last)) => format!("{} {conjunction} {last}", words.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn typing_errors_find_their_word() {
        let keys = ["center", "radius", "material", "priority"];
        for (typed, meant) in [
            ("radus", Some("radius")),
            ("raduis", Some("radius")),
            ("Radius", Some("radius")),
            ("centre", Some("center")),
            ("materials", Some("material")),
            ("colour", None),
            ("tedium", None),
            ("x", None),
            ("", None),
        ] {
            assert_eq!(nearest(typed, keys), meant, "{typed}");
        }
    }

    #[test]
    fn one_letter_is_no_suggestion_for_another() {
        assert_eq!(nearest("a", ["b"]), None);
        assert_eq!(nearest("A", ["a"]), Some("a"));
    }

    #[test]
    fn a_very_long_word_costs_no_time() {
        assert_eq!(nearest(&"x".repeat(10_000_000), ["radius"]), None);
    }

    #[test]
    fn lists_read_as_english() {
        assert_eq!(list([], "and"), "");
        assert_eq!(list(["a"], "and"), "`a`");
        assert_eq!(list(["a", "b", "c"], "or"), "`a`, `b` or `c`");
    }
}

//! What the table says of effects together: what they need, and what excludes what.

use std::collections::BTreeSet;

use super::Effect;

/// Of each of these lists every kernel has one at least.
const EVERY_KERNEL: [&[Effect]; 1] = [&[Effect::Baked, Effect::List, Effect::Bvh]];

/// Whether the two are in no kernel together.
fn excluded(a: Effect, b: Effect) -> bool {
    a.row().excludes.contains(&b) || b.row().excludes.contains(&a)
}

/// The first two of `all` that exclude each other.
fn rivals(all: &BTreeSet<Effect>) -> Option<[Effect; 2]> {
    let mut pairs = all.iter().flat_map(|a| all.iter().map(move |b| [*a, *b]));
    pairs.find(|[a, b]| excluded(*a, *b))
}

/// The lists of which one at least is in use where `all` are.
fn needed(all: &BTreeSet<Effect>) -> impl Iterator<Item = &'static [Effect]> {
    let of_rows = all.iter().flat_map(|effect| &effect.row().needs);
    // What rows need may be more than any of these.
    of_rows.map(Vec::as_slice).chain(EVERY_KERNEL)
}

/// The set with what its effects need: of each list the first that nothing excludes. `None` if that cannot be.
#[must_use]
pub fn completed(set: impl IntoIterator<Item = Effect>) -> Option<BTreeSet<Effect>> {
    let mut set: BTreeSet<Effect> = set.into_iter().collect();
    loop {
        if rivals(&set).is_some() {
            return None;
        }
        let missing = needed(&set).find(|list| !list.iter().any(|effect| set.contains(effect)));
        let Some(missing) = missing else {
            return Some(set);
        };
        let fits = |effect: &&Effect| !set.iter().any(|other| excluded(**effect, *other));
        let added = *missing.iter().find(fits)?;
        set.insert(added);
    }
}

/// Why `more` cannot be in a kernel that has the effects `used`; `None` if they can.
#[must_use]
pub fn conflict(used: &[Effect], more: &[Effect]) -> Option<String> {
    let with: BTreeSet<Effect> = used.iter().chain(more).copied().collect();
    for added in more {
        if let Some(other) = with.iter().find(|other| excluded(*added, **other)) {
            let (added, other) = (added.name(), other.name());
            return Some(format!("{added} and {other} are not in one kernel"));
        }
        let lists = &added.row().needs;
        let unmet = lists
            .iter()
            .find(|list| !list.iter().any(|e| with.contains(e)));
        if let Some(list) = unmet {
            let names: Vec<&str> = list.iter().map(|effect| effect.name()).collect();
            return Some(format!("{} needs {}", added.name(), names.join(" or ")));
        }
    }
    None
}

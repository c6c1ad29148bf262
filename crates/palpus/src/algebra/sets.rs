//! Disjoint sets of numbers (union–find).

/// Returns the representative of the set of `member`, and halves the path to it. `parents` has the
/// parent of each number; a representative is its own parent.
pub(crate) fn representative(parents: &mut [u32], mut member: u32) -> u32 {
    while parents[member as usize] != member {
        let above = parents[parents[member as usize] as usize];
        parents[member as usize] = above;
        member = above;
    }
    member
}

//! Groups the sides of triangles by edge.

/// The sides of all triangles, grouped by undirected edge. A side has the number `3 t + k`. The
/// groups are sorted by the vertices of their edge, and the sides of a group by their number.
pub(crate) struct EdgeUses {
    starts: Vec<u32>,
    sides: Vec<u32>,
}

impl EdgeUses {
    /// Groups the sides of `triangles`. All vertex indices must be less than `vertex_count`. Does a
    /// counting sort by the lower vertex of each edge, and then a small sort within the bucket of
    /// each vertex.
    pub(crate) fn new(vertex_count: usize, triangles: &[[u32; 3]]) -> Self {
        let ends = |side: usize| {
            let triangle = triangles[side / 3];
            let (p, q) = (triangle[side % 3], triangle[(side % 3 + 1) % 3]);
            (p.min(q), p.max(q))
        };
        let mut bucket_starts = vec![0_u32; vertex_count + 1];
        for side in 0..3 * triangles.len() {
            bucket_starts[ends(side).0 as usize + 1] += 1;
        }
        for v in 0..vertex_count {
            bucket_starts[v + 1] += bucket_starts[v];
        }
        // An entry combines the upper vertex and the side in one number. Sorting these numbers
        // sorts the edges.
        let mut entries = vec![0_u64; 3 * triangles.len()];
        let mut next = bucket_starts.clone();
        for side in 0..3 * triangles.len() {
            let (low, high) = ends(side);
            entries[next[low as usize] as usize] = (u64::from(high) << 32) | side as u64;
            next[low as usize] += 1;
        }
        let mut starts = Vec::with_capacity(entries.len() / 2 + 2);
        for bucket in bucket_starts.windows(2) {
            let (from, to) = (bucket[0] as usize, bucket[1] as usize);
            entries[from..to].sort_unstable();
            for i in from..to {
                if i == from || entries[i] >> 32 != entries[i - 1] >> 32 {
                    starts.push(i as u32);
                }
            }
        }
        starts.push(entries.len() as u32);
        Self { starts, sides: entries.iter().map(|&entry| entry as u32).collect() }
    }

    /// Returns the sides that use each edge, edge by edge.
    pub(crate) fn edges(&self) -> impl Iterator<Item = &[u32]> {
        self.starts.windows(2).map(|range| &self.sides[range[0] as usize..range[1] as usize])
    }
}

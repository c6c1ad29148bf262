//! Reads the bytes of an accessor.

use std::borrow::Cow;

use super::document::{Root, View};
use crate::mesh::fault::{Fault, MeshProblem, Place};

/// Component types of the glTF format.
pub(super) const U8: u32 = 5121;
pub(super) const U16: u32 = 5123;
pub(super) const U32: u32 = 5125;
pub(super) const F32: u32 = 5126;

/// The bytes of an accessor: `count` items, which start `stride` bytes apart.
pub(super) struct Items<'a> {
    bytes: &'a [u8],
    stride: usize,
    pub(super) count: u64,
}

impl Items<'_> {
    /// Returns the first `N` bytes of each item. The last item may be shorter than the stride.
    pub(super) fn each<const N: usize>(&self) -> impl Iterator<Item = [u8; N]> {
        let count = self.count as usize;
        self.bytes.chunks(self.stride).take(count).filter_map(|item| item.first_chunk().copied())
    }
}

/// Returns the items of an accessor. The accessor must have the given shape and one of the given
/// component types, which are listed with their item sizes in bytes.
pub(super) fn items<'b>(
    root: &Root,
    buffers: &'b [Option<Cow<'_, [u8]>>],
    index: usize,
    shape: &str,
    types: &[(u32, u64)],
) -> Result<Items<'b>, Fault> {
    let place = Place::Element("accessor", index as u64);
    let missing = |what: &str| Fault::malformed(place, format!("{what} does not exist; export the mesh again"));
    let accessor = root.accessors.get(index).ok_or_else(|| missing("the accessor"))?;
    let Some(&(_, size)) = types.iter().find(|&&(kind, _)| kind == accessor.component_type) else {
        let what = format!("component type {} cannot be used here; export the mesh again", accessor.component_type);
        return Err(Fault::malformed(place, what));
    };
    if &*accessor.shape != shape {
        let what = format!("its type is {:?} but should be {shape}; export the mesh again", accessor.shape);
        return Err(Fault::malformed(place, what));
    }
    let Some(view) = accessor.buffer_view.filter(|_| accessor.sparse.is_none()) else {
        let what = "it is sparse or compressed (Draco?), which is not supported; export the mesh without compression";
        return Err(Fault::unsupported(place, what));
    };
    let view = root.buffer_views.get(view).ok_or_else(|| missing("its buffer view"))?;
    let buffer = buffers.get(view.buffer).and_then(|buffer| buffer.as_ref()).ok_or_else(|| missing("its buffer"))?;
    let stride = view.byte_stride.unwrap_or(size);
    if stride < size || stride > 255 {
        let what = format!("its items have {size} bytes but start {stride} bytes apart; export the mesh again");
        return Err(Fault::malformed(place, what));
    }
    let needed = if accessor.count == 0 {
        Some(0)
    } else {
        stride.checked_mul(accessor.count - 1).and_then(|n| n.checked_add(size))
    };
    let bytes = view_bytes(view, buffer).and_then(|bytes| {
        let start = usize::try_from(accessor.byte_offset).ok()?;
        let end = start.checked_add(usize::try_from(needed?).ok()?)?;
        bytes.get(start..end)
    });
    match bytes {
        Some(bytes) => Ok(Items { bytes, stride: stride as usize, count: accessor.count }),
        None => {
            let problem = MeshProblem::AbsurdCount {
                element: "item".to_owned(),
                count: accessor.count,
                bytes: view.byte_length.saturating_sub(accessor.byte_offset),
            };
            Err(Fault::new(place, problem))
        }
    }
}

/// Returns the bytes of a buffer view.
fn view_bytes<'b>(view: &View, buffer: &'b [u8]) -> Option<&'b [u8]> {
    let start = usize::try_from(view.byte_offset).ok()?;
    buffer.get(start..start.checked_add(usize::try_from(view.byte_length).ok()?)?)
}

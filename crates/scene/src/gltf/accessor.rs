//! Typed elements out of buffers (glTF 2.0, section 3.6.2), also sparse ones and those of KHR_mesh_quantization.
//!
//! Everything an accessor may touch is checked once, when it is opened; elements are then decoded one by one where they
//! are needed, so that sharing an accessor between many primitives costs only what each of them uses.

use super::budget::Budget;
use super::buffers::Buffers;
use super::document::{self, Document};
use super::malformed;
use crate::LoadError;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    fn from_code(code: u32) -> Option<Self> {
        Some(match code {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            _ => return None,
        })
    }

    fn size_bytes(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }

    /// The number in the first bytes of `bytes`, which are there.
    fn float(self, bytes: &[u8], normalized: bool) -> f32 {
        let (value, most) = match self {
            Self::I8 => (f32::from(i8::from_le_bytes(first(bytes))), f32::from(i8::MAX)),
            Self::U8 => (f32::from(u8::from_le_bytes(first(bytes))), f32::from(u8::MAX)),
            Self::I16 => (f32::from(i16::from_le_bytes(first(bytes))), f32::from(i16::MAX)),
            Self::U16 => (f32::from(u16::from_le_bytes(first(bytes))), f32::from(u16::MAX)),
            Self::U32 => (u32::from_le_bytes(first(bytes)) as f32, u32::MAX as f32),
            Self::F32 => return f32::from_le_bytes(first(bytes)),
        };
        if normalized { (value / most).max(-1.0) } else { value }
    }

    fn unsigned(self, bytes: &[u8]) -> u32 {
        match self {
            Self::U8 => u32::from(bytes[0]),
            Self::U16 => u32::from(u16::from_le_bytes(first(bytes))),
            _ => u32::from_le_bytes(first(bytes)),
        }
    }
}

fn first<const N: usize>(bytes: &[u8]) -> [u8; N] {
    let mut array = [0; N];
    array.copy_from_slice(&bytes[..N]);
    array
}

/// Elements at a fixed distance from each other, all inside `bytes`.
struct Strided<'a> {
    bytes: &'a [u8],
    stride: usize,
}

impl<'a> Strided<'a> {
    fn new(
        (bytes, stride): (&'a [u8], Option<usize>),
        offset: usize,
        count: usize,
        element_bytes: usize,
        place: &str,
    ) -> Result<Self, LoadError> {
        let stride = stride.unwrap_or(element_bytes);
        if stride < element_bytes {
            return Err(malformed(format!(
                "{place}: elements of {element_bytes} bytes at a distance of {stride} overlap"
            )));
        }
        // Not count * stride: the last element needs no padding.
        let needed = match count.checked_sub(1) {
            Some(gaps) => gaps.checked_mul(stride).and_then(|start| start.checked_add(element_bytes)),
            None => Some(0),
        };
        let inside = bytes.get(offset..).filter(|inside| needed.is_some_and(|needed| needed <= inside.len()));
        let Some(inside) = inside else {
            return Err(malformed(format!(
                "{place}: {count} elements of {element_bytes} bytes, {stride} apart, from byte {offset} on do not fit \
                 into its buffer view of {} bytes",
                bytes.len()
            )));
        };
        Ok(Self { bytes: inside, stride })
    }

    fn element(&self, index: usize) -> &'a [u8] {
        &self.bytes[index * self.stride..]
    }
}

/// An accessor all of whose elements can be read.
pub(super) struct Accessor<'a> {
    pub(super) count: usize,
    pub(super) component: Component,
    pub(super) normalized: bool,
    /// Numbers an element.
    pub(super) width: usize,
    /// `None`: all zeros.
    base: Option<Strided<'a>>,
    /// Ascending element numbers and their values.
    replaced: Option<(Vec<u32>, Strided<'a>)>,
}

impl<'a> Accessor<'a> {
    pub(super) fn open(
        document: &Document,
        buffers: &'a Buffers<'_>,
        budget: &mut Budget,
        index: usize,
        place: &str,
    ) -> Result<Self, LoadError> {
        let Some(source) = document.accessors.get(index) else {
            let count = document.accessors.len();
            return Err(malformed(format!("{place}: accessor {index} does not exist; there are {count}")));
        };
        let place = format!("accessor {index}");
        let component = component(source.component_type, &place)?;
        let width = match source.shape.as_str() {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            "VEC4" => 4,
            "MAT2" | "MAT3" | "MAT4" => return Err(malformed(format!("{place}: a matrix where a vector belongs"))),
            other => return Err(malformed(format!("{place}: unknown type '{}'", super::buffers::shown(other)))),
        };
        let element_bytes = width * component.size_bytes();
        let base = match source.buffer_view {
            Some(view) => {
                let view = buffers.view(view, &place)?;
                Some(Strided::new(view, source.byte_offset, source.count, element_bytes, &place)?)
            }
            None => None,
        };
        let replaced = match &source.sparse {
            Some(sparse) => {
                budget.charge(sparse.count, size_of::<u32>(), || place.clone())?;
                Some(open_sparse(sparse, source.count, buffers, element_bytes, &place)?)
            }
            None => None,
        };
        Ok(Self { count: source.count, component, normalized: source.normalized, width, base, replaced })
    }

    /// Whether there are bytes behind it at all.
    pub(super) fn has_data(&self) -> bool {
        self.base.is_some() || self.replaced.is_some()
    }

    /// The first `N` numbers of an element below `count`; missing ones are 0.
    pub(super) fn floats<const N: usize>(&self, index: usize) -> [f32; N] {
        let mut numbers = [0.0; N];
        if let Some(bytes) = self.bytes(index) {
            let size = self.component.size_bytes();
            for (number, bytes) in numbers.iter_mut().zip(bytes.chunks_exact(size).take(self.width)) {
                *number = self.component.float(bytes, self.normalized);
            }
        }
        numbers
    }

    /// The first number of an element below `count` of an unsigned accessor.
    pub(super) fn unsigned(&self, index: usize) -> u32 {
        self.bytes(index).map_or(0, |bytes| self.component.unsigned(bytes))
    }

    fn bytes(&self, index: usize) -> Option<&'a [u8]> {
        if let Some((indices, values)) = &self.replaced
            && let Ok(at) = indices.binary_search_by(|&replaced| (replaced as usize).cmp(&index))
        {
            return Some(values.element(at));
        }
        self.base.as_ref().map(|base| base.element(index))
    }
}

fn component(code: u32, place: &str) -> Result<Component, LoadError> {
    Component::from_code(code).ok_or_else(|| malformed(format!("{place}: unknown component type {code}")))
}

fn open_sparse<'a>(
    sparse: &document::Sparse,
    count: usize,
    buffers: &'a Buffers<'_>,
    element_bytes: usize,
    place: &str,
) -> Result<(Vec<u32>, Strided<'a>), LoadError> {
    let kind = component(sparse.indices.component_type, place)?;
    if !matches!(kind, Component::U8 | Component::U16 | Component::U32) {
        return Err(malformed(format!("{place}: sparse indices are not unsigned integers")));
    }
    let view = buffers.view(sparse.indices.buffer_view, place)?;
    let indices = Strided::new(view, sparse.indices.byte_offset, sparse.count, kind.size_bytes(), place)?;
    let view = buffers.view(sparse.values.buffer_view, place)?;
    let values = Strided::new(view, sparse.values.byte_offset, sparse.count, element_bytes, place)?;
    let indices: Vec<u32> = (0..sparse.count).map(|at| kind.unsigned(indices.element(at))).collect();
    if !indices.is_sorted_by(|a, b| a < b) {
        return Err(malformed(format!("{place}: sparse indices do not ascend")));
    }
    if let Some(&last) = indices.last()
        && last as usize >= count
    {
        return Err(malformed(format!("{place}: sparse index {last}, but there are only {count} elements")));
    }
    Ok((indices, values))
}

//! Rows of textures that were copied from the GPU.

/// Alignment in bytes of the rows of textures that wgpu copies to the CPU.
const ROW_ALIGNMENT: usize = 256;

/// Bytes of a texture copied from the GPU, without the padding behind each of its rows, which are `row` bytes long.
pub(crate) fn unpad_rows(bytes: &[u8], row: usize) -> Vec<u8> {
    let padded_row = row.next_multiple_of(ROW_ALIGNMENT);
    bytes.chunks(padded_row).flat_map(|padded| &padded[..row.min(padded.len())]).copied().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn padding_behind_rows_is_dropped() {
        let mut bytes = vec![9; 2 * ROW_ALIGNMENT];
        bytes[..4].copy_from_slice(&[1, 2, 3, 4]);
        bytes[ROW_ALIGNMENT..ROW_ALIGNMENT + 4].copy_from_slice(&[5, 6, 7, 8]);
        assert_eq!(unpad_rows(&bytes, 4), [1, 2, 3, 4, 5, 6, 7, 8]);
    }
}

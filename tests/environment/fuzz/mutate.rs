//! Mutations of files.

/// Random numbers (Steele, Lea and Flood 2014, *Fast splittable pseudorandom number generators*).
pub(super) struct Random(pub(super) u64);

impl Random {
    pub(super) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// A number below `end`, which is above 0.
    pub(super) fn below(&mut self, end: usize) -> usize {
        (self.next() % end as u64) as usize
    }
}

/// Values at which arithmetic overflows or sizes explode.
const NUMBERS: [u32; 16] = [
    0,
    1,
    2,
    7,
    0x7F,
    0x80,
    0xFF,
    0x100,
    0x7FFF,
    0x8000,
    0xFFFF,
    0x1_0000,
    0x0FFF_FFFF,
    0x7FFF_FFFF,
    0x8000_0000,
    0xFFFF_FFFF,
];

pub(super) const IMAGE_WORDS: &[&str] = &[
    "EXPOSURE=1e30\n",
    "EXPOSURE=-1\n",
    "EXPOSURE=nan\n",
    "FORMAT=32-bit_rle_xyze\n",
    "-Y 65535 +X 65535\n",
    "-Y 1 +X 4000000000\n",
    "+X 8 -Y 4\n",
    "\n\n",
    "#?RGBE\n",
    "channels\0",
    "dataWindow\0",
    "displayWindow\0",
    "tiles\0",
    "chlist\0",
];
pub(super) const JSON_WORDS: &[&str] = &[
    "{}",
    "[]",
    "null",
    "true",
    "-1",
    "1e999",
    "-0.0",
    "18446744073709551616",
    "0.1e-400",
    "\"\"",
    "\"\\ud800\"",
    "{\"id\":",
    "[[[[[[[[[[[[[[[[",
    "\"MarkerAnchor\"",
    "\"PhantomObject\"",
    "\"extras\"",
    "\"mesh\"",
    "\"nodes\"",
    "\"fps\"",
    "\"exposures\"",
    "*",
    "\u{e4}\u{20ac}\u{1f600}",
];
pub(super) const RON_WORDS: &[&str] = &[
    "()",
    "[]",
    "(((((((((((((((((((((((",
    "inf",
    "-inf",
    "NaN",
    "1e999",
    "Some(",
    "None",
    "\"\\u{10FFFF}\"",
    "r#\"",
    "/*",
    "//",
    "'",
    "#![enable(implicit_some)]",
    "Directional",
    "Spot",
    "look_at:",
    "lights:",
    "0x7fffffffffffffffffff",
];

/// A copy of `bytes` with one to eight changes.
pub(super) fn mutated(
    bytes: &[u8],
    corpus: &[(&'static str, Vec<u8>)],
    dictionary: &[&str],
    random: &mut Random,
) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    for _ in 0..=random.below(8) {
        if bytes.is_empty() {
            bytes.push(0);
        }
        // Heads of files decide most.
        let range = if random.below(2) == 0 { bytes.len() } else { bytes.len().min(400) };
        let at = random.below(range);
        match random.below(9) {
            0 => bytes[at] ^= 1 << random.below(8),
            1 => bytes[at] = NUMBERS[random.below(NUMBERS.len())] as u8,
            2 => bytes[at] = random.next() as u8,
            3 | 4 => {
                let number = NUMBERS[random.below(NUMBERS.len())];
                let number = if random.below(2) == 0 { number.to_le_bytes() } else { number.to_be_bytes() };
                let width = [2, 4][random.below(2)].min(bytes.len() - at);
                bytes[at..at + width].copy_from_slice(&number[..width]);
            }
            5 => {
                let length = (1 + random.below(32)).min(bytes.len() - at);
                bytes.drain(at..at + length);
            }
            6 => {
                let length = (1 + random.below(64)).min(bytes.len() - at);
                let part = bytes[at..at + length].to_vec();
                let to = random.below(bytes.len() + 1);
                bytes.splice(to..to, part);
            }
            7 if !dictionary.is_empty() => {
                let word = dictionary[random.below(dictionary.len())].as_bytes();
                let replaced = [0, word.len().min(bytes.len() - at)][random.below(2)];
                bytes.splice(at..at + replaced, word.iter().copied());
            }
            _ if random.below(4) == 0 => bytes.truncate(at),
            _ => {
                let other = &corpus[random.below(corpus.len())].1;
                let from = random.below(other.len());
                let length = (1 + random.below(64)).min(other.len() - from);
                bytes.splice(at..at, other[from..from + length].iter().copied());
            }
        }
    }
    bytes
}

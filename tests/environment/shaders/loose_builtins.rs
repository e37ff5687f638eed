//! Builtins whose results differ between drivers, each with the reason why its use is harmless.

use super::shader_files;
use std::path::Path;

/// Builtins whose accuracy WGSL leaves wide open (WGSL, 15.7.4 "Floating Point Accuracy"), whose result depends on a
/// driver's filtering, or whose steps are those of neighboring invocations.
const LOOSE_BUILTINS: [&str; 27] = [
    "acos",
    "acosh",
    "asin",
    "asinh",
    "atan",
    "atan2",
    "atanh",
    "cos",
    "cosh",
    "dpdx",
    "dpdy",
    "exp",
    "exp2",
    "fwidth",
    "log",
    "log2",
    "pow",
    "sin",
    "sinh",
    "tan",
    "tanh",
    "textureGather",
    "textureGatherCompare",
    "textureSample",
    "textureSampleCompare",
    "textureSampleCompareLevel",
    "textureSampleLevel",
];

/// Each use of one of them: file, builtin, how often, and why it does no harm there.
const HARMLESS: [(&str, &str, usize, &str); 22] = [
    ("camera/background_pass.wgsl", "textureSampleLevel", 2, "one screen pixel per camera pixel falls on its middle"),
    ("debug/map_view/map_view_pass.wgsl", "cos", 2, "0.03° at a picture of 2° per pixel"),
    ("debug/map_view/map_view_pass.wgsl", "sin", 3, "0.03° at a picture of 2° per pixel"),
    ("prefilter/convolve.wgsl", "pow", 1, "a power of at most 26 of 0…1, the weight of one of 384 terms: off by 1e-5"),
    ("prefilter/downsample.wgsl", "textureSampleLevel", 1, "weights of 8 bits, summed over ten and more lookups"),
    ("prefilter/taps.wgsl", "log2", 1, "of 0.2 to 1, where it is off by 2⁻²¹ levels"),
    ("prefilter/taps.wgsl", "textureSampleLevel", 1, "weights of 8 bits, summed over ten and more lookups"),
    (
        "materials/grain/grain_pass.wgsl",
        "pow",
        2,
        "there and back: its error cancels but for that of the noise between",
    ),
    ("materials/phantom.wgsl", "textureSampleLevel", 1, "one screen pixel per camera pixel falls on its middle"),
    ("materials/view_environment.wgsl", "textureSampleLevel", 4, "weights of 8 bits, as in the engine's own lookups"),
    (
        "materials/classic/classic.wgsl",
        "pow",
        1,
        "a power of at most 1000 of 0…1: off by 3e-4 of a highlight where its base is near 1",
    ),
    ("materials/outline/outline.wgsl", "textureSample", 1, "compared with a cutoff, as in Bevy's own materials"),
    ("materials/toon/bands.wgsl", "fwidth", 1, "clamped; widens edges of bands by up to a pixel"),
    ("materials/toon/bands.wgsl", "pow", 1, "a cube root of 0.1…1: off by 1e-6 of a band's lightness"),
    (
        "materials/toon/toon.wgsl",
        "pow",
        1,
        "a power of at most 1000 of 0…1, of which an edge is shown: 1e-4 of the radius of a highlight",
    ),
    ("materials/planar/planar.wgsl", "textureSampleLevel", 1, "weights of 8 bits between neighbors of a soft shadow"),
    (
        "shadows/planar/render/planar_blur_pass.wgsl",
        "exp",
        1,
        "of −3.2…0, a weight among weights, whose sum is divided by: off by 1e-6",
    ),
    ("shadows/render/caster.wgsl", "textureSample", 1, "compared with a cutoff, as in Bevy's own materials"),
    (
        "shadows/render/maps.wgsl",
        "textureSampleCompareLevel",
        4,
        "weights of 8 bits of a share that many directions average",
    ),
    (
        "shadows/render/soft_shadow.wgsl",
        "textureSampleCompareLevel",
        2,
        "weights of 8 bits of a share that many samples average",
    ),
    ("shadows/render/receive.wgsl", "exp2", 1, "of −17…−1, an exponent of 1e-5…0.5 of an estimate"),
    (
        "shadows/render/receive.wgsl",
        "pow",
        1,
        "an estimate of how much of a reflection is hidden, smooth in both arguments",
    ),
];

/// How often a function is called in a shader, comments left out.
fn calls(source: &str, function: &str) -> usize {
    let code: String =
        source.lines().map(|line| line.split("//").next().unwrap_or_default().to_owned() + "\n").collect();
    let is_name = |c: char| c.is_alphanumeric() || c == '_';
    code.match_indices(&format!("{function}(")).filter(|(at, _)| !code[..*at].ends_with(is_name)).count()
}

#[test]
fn every_use_of_a_builtin_of_poor_accuracy_is_known_and_harmless() {
    let mut found = Vec::new();
    for path in shader_files(Path::new("src")) {
        let source = std::fs::read_to_string(&path).expect("a shader is text");
        let name = path.strip_prefix("src").expect("found there").to_str().expect("printable").replace('\\', "/");
        for builtin in LOOSE_BUILTINS {
            let count = calls(&source, builtin);
            let known = HARMLESS.iter().find(|(file, of, ..)| *file == name && *of == builtin);
            let allowed = known.map_or(0, |(_, _, count, _)| *count);
            if count != allowed {
                found.push(format!("src/{name}: {builtin} {count} times, {allowed} known"));
            }
        }
    }
    assert!(
        found.is_empty(),
        "{}\nUse `angle_of` and `unit_vector` of trigonometry.wgsl, tables from the CPU or algebra; or say in HARMLESS \
         why the picture does not hang on it",
        found.join("\n")
    );
}

#[test]
fn calls_are_told_from_names_that_end_alike_and_from_comments() {
    assert_eq!(calls("let a = sin(x) + asin(x); // sin(y)\nlet b = sin(cos(x));", "sin"), 2);
}

//! Camera intrinsics on the command line.

/// Parses `FX,FY,CX,CY`.
pub(crate) fn parse_intrinsics(text: &str) -> Result<[f32; 4], String> {
    let numbers: Result<Vec<f32>, _> = text.split(',').map(|number| number.trim().parse()).collect();
    match numbers.ok().and_then(|numbers| <[f32; 4]>::try_from(numbers).ok()) {
        Some(n) if n.iter().all(|n| n.is_finite()) && n[0] > 0.0 && n[1] > 0.0 => Ok(n),
        _ => Err("--intrinsics takes four numbers FX,FY,CX,CY in pixels, the focal lengths above 0".to_owned()),
    }
}

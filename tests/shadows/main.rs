//! What virtual objects do to the picture of a real desk: dome shadows, lamps, materials and the edges between real and virtual.

mod casters;
mod desk;
mod dome;
#[path = "../support/gpu.rs"]
mod gpu;
mod lamps;
mod ray_truth;
#[path = "../support/shared_data.rs"]
mod shared_data;
mod simple_scenes;
mod soft_edges;
mod toon;

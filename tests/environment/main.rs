//! Environment maps for the engine, the shaders of the crate, and the devices that run them.

#[path = "../support/cubes.rs"]
mod cubes;
mod device;
mod faulty_files;
mod filter_truth;
mod fuzz;
#[path = "../support/gpu.rs"]
mod gpu;
mod prefilter;
#[path = "../support/radiance_cube.rs"]
mod radiance_cube;
mod reflection;
mod scene_probe;
mod settle;
mod shaders;
#[path = "../support/shared_data.rs"]
mod shared_data;
#[path = "../support/sky_cube.rs"]
mod sky_cube;

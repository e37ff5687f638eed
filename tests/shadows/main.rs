//! What virtual objects do to the picture of a real desk: dome shadows, lamps, materials and the edges between real and
//! virtual.

mod bounce;
mod casters;
mod classic;
mod come_and_go;
mod composition;
mod desk;
mod dome;
mod drawing;
#[path = "../support/gpu.rs"]
mod gpu;
mod grain;
mod kept_lookups;
mod kept_layers;
mod lamps;
mod life_cycle;
#[path = "../support/logged.rs"]
mod logged;
mod long_run;
mod measured_light;
mod neighbors;
mod planar;
#[path = "../support/radiance_cube.rs"]
mod radiance_cube;
mod ray_truth;
mod several_cameras;
#[path = "../support/shared_data.rs"]
mod shared_data;
mod simple_scenes;
#[path = "../support/sky_cube.rs"]
mod sky_cube;
mod soft_edges;
mod studio;
mod style_changes;
mod style_fade;
mod toon;
mod unserved_cameras;

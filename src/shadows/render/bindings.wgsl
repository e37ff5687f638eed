// Bindings of the dome in materials and in the visibility pass.

#define_import_path bevy_mirrorball::shadows::render::bindings

#import bevy_mirrorball::shadows::render::dome::{Dome, DomeResults}

@group(#{MATERIAL_BIND_GROUP}) @binding(100) var atlas: texture_depth_2d;
@group(#{MATERIAL_BIND_GROUP}) @binding(101) var atlas_sampler: sampler_comparison;
@group(#{MATERIAL_BIND_GROUP}) @binding(102) var<storage, read> dome: Dome;
@group(#{MATERIAL_BIND_GROUP}) @binding(103) var<storage, read> results: DomeResults;

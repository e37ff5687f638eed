//! Classic surfaces against twins on the CPU, in a room of known light.

mod highlight;
mod models;
mod reflection;
mod shadows;
mod sphere_map;
mod surfaces;
mod switching;
mod twin;

//! Every shader of the crate composes and validates with the definitions of the pipelines that use it, without a GPU.
//!
//! Bevy's own [`ShaderCache`] does the work, with the very `naga` and `naga_oil` that run in the game; it validates in
//! builds with debug assertions, as test builds are.

use super::shader_files;
use bevy::{
    prelude::*,
    render::{
        RenderPlugin,
        render_resource::DownlevelFlags,
        settings::{Backends, WgpuFeatures, WgpuSettings},
    },
    shader::{ShaderCache, ShaderDefVal},
};
use bevy_mirrorball::headless;
use std::{
    path::Path,
    time::{Duration, Instant},
};

/// No new shader for this long means that all have been loaded, on threads that other tests keep busy too.
const QUIET: Duration = Duration::from_secs(1);

/// What Bevy defines for each pipeline: the group of material bindings, and what a desktop GPU can do.
fn common_defs() -> Vec<ShaderDefVal> {
    vec![
        ShaderDefVal::UInt("AVAILABLE_STORAGE_BUFFER_BINDINGS".into(), 8),
        ShaderDefVal::UInt("MATERIAL_BIND_GROUP".into(), 3),
        ShaderDefVal::UInt("CUTOUT_GROUP".into(), 2),
        ShaderDefVal::UInt("MAX_DIRECTIONAL_LIGHTS".into(), 10),
        ShaderDefVal::UInt("MAX_CASCADES_PER_LIGHT".into(), 4),
        ShaderDefVal::UInt("TONEMAPPING_LUT_TEXTURE_BINDING_INDEX".into(), 18),
        ShaderDefVal::UInt("TONEMAPPING_LUT_SAMPLER_BINDING_INDEX".into(), 19),
        ShaderDefVal::Int("SCREEN_SPACE_SPECULAR_TRANSMISSION_BLUR_TAPS".into(), 8),
    ]
}

const FORWARD: &[&str] = &[
    "MESH_PIPELINE",
    "VERTEX_OUTPUT_INSTANCE_INDEX",
    "VERTEX_POSITIONS",
    "VERTEX_NORMALS",
    "VIEW_PROJECTION_PERSPECTIVE",
    "SHADOW_FILTER_METHOD_GAUSSIAN",
    "DFG_LUT",
    "ENVIRONMENT_MAP",
];
/// As the main pass of an object with bones or morph targets; Bevy binds both in group 2 then.
const SKINNED: &[&str] = &["SKINNED"];
const MORPHED: &[&str] = &["MORPH_TARGETS"];
const TEXTURED: &[&str] = &["VERTEX_UVS", "VERTEX_UVS_A", "VERTEX_TANGENTS", "VERTEX_COLORS"];
const PREPASSED: &[&str] = &["DEPTH_PREPASS", "NORMAL_PREPASS"];
/// How shadow maps are read; bilinearly without any of these.
const FILTERS: [&[&str]; 5] = [&[], &["FILTER_NEAREST"], &["FILTER_GAUSS"], &["FILTER_PCF"], &["FILTER_PCSS"]];
/// What the engine defines for levels of detail, transparency sorted by depth, and motion vectors.
const CROSSFADED: &[&str] = &["VISIBILITY_RANGE_DITHER"];
const SORTED: &[&str] = &["OIT_ENABLED"];
const MOVING: &[&str] = &["MOTION_VECTOR_PREPASS", "MOTION_VECTOR_PREPASS_OR_DEFERRED_PREPASS"];
const TONEMAPPED: &[&str] = &["MULTISAMPLED", "TONEMAP_IN_SHADER", "TONEMAP_METHOD_REINHARD", "MAY_DISCARD"];

/// The definitions under which a shader is used; one empty set for those that ask for none.
fn variants(path: &Path) -> Vec<Vec<&'static str>> {
    let forward =
        [vec![FORWARD], vec![FORWARD, TEXTURED], vec![FORWARD, TONEMAPPED], vec![FORWARD, TEXTURED, TONEMAPPED]];
    let sets = match path.file_name().and_then(|name| name.to_str()) {
        // None is ever drawn in deferred passes.
        Some(name @ ("image_based.wgsl" | "toon.wgsl" | "classic.wgsl")) => {
            let filtered = FILTERS.map(|filter| vec![FORWARD, TEXTURED, PREPASSED, filter]);
            let multisampled = vec![FORWARD, TONEMAPPED, PREPASSED, &["KEY_LIGHTS", "SPOTS"] as &[&str]];
            let few = vec![FORWARD, TEXTURED, PREPASSED, &["SAMPLES_ONLY"] as &[&str]];
            let sorted = vec![FORWARD, TEXTURED, PREPASSED, SORTED, CROSSFADED];
            let fading = vec![FORWARD, TEXTURED, SORTED, &["FADES"] as &[&str]];
            let lit = vec![FORWARD, TEXTURED, PREPASSED, &["HAS_LAMPS", "RIM", "KEY_REAL_LIGHT"] as &[&str]];
            let ramps = vec![FORWARD, PREPASSED, &["DIFFUSE_RAMP", "SPECULAR_RAMP", "KEY_DIRECTION"] as &[&str]];
            let phong = vec![FORWARD, PREPASSED, &["PHONG", "SPECULAR_RAMP", "HAS_LAMPS"] as &[&str]];
            let mirrors = vec![FORWARD, TEXTURED, PREPASSED, &["NEIGHBORS"] as &[&str]];
            let by_ball = vec![FORWARD, TEXTURED, PREPASSED, &["SPHERE_MAP"] as &[&str]];
            let far = vec![FORWARD, TEXTURED];
            let shadowed = filtered.into_iter().chain([
                multisampled,
                few,
                sorted,
                fading,
                lit,
                ramps,
                phong,
                mirrors,
                by_ball,
                far,
            ]);
            // Only classic surfaces leave out the dome where there is none.
            let dome: &[&str] = if name == "classic.wgsl" { &["DOME"] } else { &[] };
            forward.iter().cloned().chain(shadowed.map(|set| [set.as_slice(), &[dome]].concat())).collect()
        }
        Some("surfel_pass.wgsl") => {
            FILTERS.iter().flat_map(|filter| [vec![*filter], vec![*filter, &["KEY_LIGHTS", "SPOTS"]]]).collect()
        }
        Some("visibility_pass.wgsl") => {
            let steps: [&[&str]; 4] = [&[], &["INTERLEAVED"], &["CACHED"], &["INTERLEAVED", "CACHED"]];
            let multisampled: &[&str] = &["MULTISAMPLED", "KEY_LIGHTS", "SPOTS"];
            let filtered = FILTERS.iter().flat_map(|filter| steps.map(|step| vec![*filter, step]));
            filtered.flat_map(|set| [set.clone(), [set.as_slice(), &[multisampled]].concat()]).collect()
        }
        Some("visibility_plan_pass.wgsl") => FILTERS
            .iter()
            .flat_map(|filter| {
                [vec![*filter, &["INTERLEAVED", "KEY_LIGHTS", "SPOTS"]], vec![*filter, &["MULTISAMPLED"]]]
            })
            .collect(),
        Some("background_pass.wgsl") => vec![vec![], vec![&["MARKS_REAL"] as &[&str]]],
        Some("grain_pass.wgsl") => vec![vec![&["RADIUS=0"] as &[&str]], vec![&["RADIUS=8"]]],
        Some("soft_edges_pass.wgsl") => vec![vec![], vec![&["MULTISAMPLED"] as &[&str]]],
        Some("convolve.wgsl") => vec![vec![], vec![&["COSINE"] as &[&str]]],
        Some("downsample.wgsl") => vec![vec![], vec![&["COPIES"] as &[&str]]],
        // The rings of taps in prefilter/lobe.rs.
        Some("taps.wgsl") => {
            let taps: [&[&str]; 3] = [
                &[],
                &["INNER_TAPS=5", "MIDDLE_TAPS=5", "OUTER_TAPS=0"],
                &["INNER_TAPS=5", "MIDDLE_TAPS=7", "OUTER_TAPS=8"],
            ];
            taps.into_iter().map(|taps| vec![taps]).collect()
        }
        Some("unwrap_pass.wgsl" | "frame_sampling.wgsl" | "lens.wgsl") => {
            let kinds: [&[&str]; 4] = [&[], &["BALL"], &["FISHEYE"], &["EQUIRECT"]];
            kinds.into_iter().map(|kind| vec![kind]).collect()
        }
        Some("depth_pass.wgsl" | "planar_mask_pass.wgsl" | "caster.wgsl") => {
            let (morphed, cut_out): (&[&str], &[&str]) = (&["MORPHED"], &["CUT_OUT"]);
            vec![vec![], vec![SKINNED], vec![morphed], vec![cut_out], vec![SKINNED, morphed, cut_out]]
        }
        // A rectangle of its own.
        Some("planar.wgsl") => vec![vec![FORWARD, &["VERTEX_UVS", "VERTEX_UVS_A"] as &[&str]]],
        Some("phantom_prepass.wgsl") => {
            let prepass: &[&str] = &["PREPASS_PIPELINE", "VERTEX_NORMALS", "VERTEX_POSITIONS"];
            let (normals, receiving): (&[&str], &[&str]) =
                (&["PREPASS_FRAGMENT", "NORMAL_PREPASS", "NORMAL_PREPASS_OR_DEFERRED_PREPASS"], &["RECEIVES_SHADOWS"]);
            let moving = vec![prepass, normals, receiving, MOVING, CROSSFADED];
            vec![vec![prepass], vec![prepass, normals], vec![prepass, normals, receiving], moving]
        }
        Some("phantom.wgsl") => {
            let receiving: &[&str] = &["RECEIVES_SHADOWS"];
            let with_shadows = forward.iter().map(|set| [set.as_slice(), &[receiving]].concat());
            let prepassed = vec![FORWARD, PREPASSED, receiving, &["KEY_LIGHTS", "SPOTS"] as &[&str]];
            let lit = vec![FORWARD, PREPASSED, receiving, &["HAS_LAMPS", "SAMPLES_ONLY"] as &[&str]];
            let crossfaded = vec![FORWARD, PREPASSED, receiving, CROSSFADED];
            forward.iter().cloned().chain(with_shadows).chain([prepassed, lit, crossfaded]).collect()
        }
        Some("near_reflections.wgsl" | "room_light.wgsl" | "key_light.wgsl" | "bands.wgsl") => forward.to_vec(),
        Some("view_environment.wgsl") => forward.iter().cloned().chain([vec![]]).collect(),
        Some("engine_features.wgsl") => vec![vec![FORWARD, TEXTURED], vec![FORWARD, TEXTURED, SORTED, CROSSFADED]],
        Some("outline.wgsl") => {
            let without_normals = vec!["MESH_PIPELINE", "VERTEX_POSITIONS", "MORPH_TARGETS"];
            let (masked, second): (&[&str], &[&str]) = (&["MASKED"], &["MASKED", "MASK_UV_B", "VERTEX_UVS_B"]);
            let shapes: [&[&[&str]]; 6] = [
                &[FORWARD, TEXTURED, masked],
                &[FORWARD, TEXTURED, SKINNED, second],
                &[FORWARD],
                &[FORWARD, TONEMAPPED, SKINNED],
                &[FORWARD, MORPHED],
                &[FORWARD, TEXTURED, SKINNED, MORPHED],
            ];
            return shapes.into_iter().map(<[_]>::concat).chain([without_normals]).collect();
        }
        _ => vec![vec![]],
    };
    sets.into_iter().map(|set| set.concat()).collect()
}

#[derive(Resource)]
struct KeptShader(#[expect(dead_code, reason = "keeps the asset loaded")] Handle<Shader>);

/// Bevy's shader library, as an app without a renderer loads it.
fn library() -> App {
    let no_gpu = WgpuSettings { backends: Option::<Backends>::None, ..default() };
    let plugins = headless::default_plugins().set(RenderPlugin { render_creation: no_gpu.into(), ..default() });
    let mut app = headless::build_app(plugins, |_| ()).expect("nothing asks for a GPU");
    // The only library module that is loaded by the renderer itself.
    let fullscreen = "embedded://bevy_core_pipeline/fullscreen_vertex_shader/fullscreen.wgsl";
    let fullscreen: Handle<Shader> = app.world().resource::<AssetServer>().load(fullscreen);
    app.insert_resource(KeptShader(fullscreen));
    let (mut changed, mut known) = (Instant::now(), 0);
    while changed.elapsed() < QUIET || known == 0 {
        app.update();
        std::thread::sleep(Duration::from_millis(2));
        let count = app.world().resource::<Assets<Shader>>().len();
        if count != known {
            (changed, known) = (Instant::now(), count);
        }
    }
    println!("{known} shaders of the engine");
    app
}

type Cache = ShaderCache<(), ()>;

fn cache(app: &App) -> Cache {
    let mut cache = Cache::new((), WgpuFeatures::default(), DownlevelFlags::all(), |(), _, _| Ok(()));
    for (id, shader) in app.world().resource::<Assets<Shader>>().iter() {
        let mut shader = shader.clone();
        shader.shader_defs.extend(common_defs());
        cache.set_shader(id, shader);
    }
    cache
}

/// What is wrong with a shader under some definitions, if anything.
fn complaint(cache: &mut Cache, id: AssetId<Shader>, defs: &[&str]) -> Option<String> {
    let value = |def: &&str| match def.split_once('=') {
        Some((name, value)) => ShaderDefVal::UInt(name.into(), value.parse().expect("definitions are numbers")),
        None => (*def).into(),
    };
    let defs: Vec<ShaderDefVal> = defs.iter().map(value).collect();
    let error = cache.get(0, id, &defs).err()?;
    Some(match error {
        bevy::shader::ShaderCacheError::ProcessShaderError(error) => error.emit_to_string(&cache.composer),
        other => other.to_string(),
    })
}

#[test]
fn every_shader_composes_and_validates() {
    let mut app = library();
    let files = shader_files(Path::new("src"));
    assert!(!files.is_empty(), "the crate has shaders");
    let mut shaders = app.world_mut().resource_mut::<Assets<Shader>>();
    let own: Vec<_> = files
        .iter()
        .map(|path| {
            let source = std::fs::read_to_string(path).expect("a shader is text");
            (path, shaders.add(Shader::from_wgsl(source, path.display().to_string())))
        })
        .collect();
    let mut cache = cache(&app);
    let mut complaints = Vec::new();
    let mut checked = 0;
    for (path, shader) in &own {
        for defs in variants(path) {
            checked += 1;
            complaints
                .extend(complaint(&mut cache, shader.id(), &defs).map(|text| format!("{path:?} {defs:?}: {text}")));
        }
    }
    println!("{} files, {checked} variants", files.len());
    assert!(complaints.is_empty(), "{}", complaints.join("\n"));
}

#[test]
fn a_wrong_shader_is_noticed() {
    let mut app = library();
    let wrong = [
        "fn f() -> f32 { return 1u; }",
        "#import bevy_mirrorball::nowhere::nothing\nfn f() -> f32 { return nothing(); }",
        "#import bevy_pbr::mesh_view_bindings::view\nfn f() -> f32 { return view.no_such_field; }",
    ];
    let mut shaders = app.world_mut().resource_mut::<Assets<Shader>>();
    let wrong: Vec<_> = wrong.iter().map(|text| shaders.add(Shader::from_wgsl(*text, "wrong.wgsl"))).collect();
    let mut cache = cache(&app);
    for shader in wrong {
        let complaint = complaint(&mut cache, shader.id(), FORWARD);
        println!("{complaint:?}");
        assert!(complaint.is_some());
    }
}

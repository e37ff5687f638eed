//! Draw functions of phantoms, which bind the frame of the camera that draws and skip cameras without one.

use super::{PhantomMaterial, phantom_views::PhantomBindGroup};
use bevy::{
    core_pipeline::{core_3d::Opaque3d, prepass::Opaque3dPrepass},
    ecs::{
        query::ROQueryItem,
        system::{SystemParamItem, lifetimeless::Read},
    },
    material::labels::{DrawFunctionLabel, InternedDrawFunctionLabel},
    pbr::{
        DrawMesh, MainPassOpaqueDrawFunction, PreparedMaterial, PrepassOpaqueDepthOnlyDrawFunction,
        PrepassOpaqueDrawFunction, SetMeshBindGroup, SetMeshViewBindGroup, SetMeshViewBindingArrayBindGroup,
        SetPrepassViewBindGroup, SetPrepassViewEmptyBindGroup,
    },
    prelude::*,
    render::{
        Render, RenderApp, RenderSystems,
        erased_render_asset::{ErasedRenderAssets, prepare_erased_assets},
        render_phase::{
            AddRenderCommand, DrawFunctionId, DrawFunctions, PhaseItem, RenderCommand, RenderCommandResult,
            SetItemPipeline, TrackedRenderPass,
        },
    },
};
use std::{any::TypeId, sync::Arc};

/// Draws a phantom in the main pass.
type DrawPhantom = (
    SetItemPipeline,
    SetMeshViewBindGroup<0>,
    SetMeshViewBindingArrayBindGroup<1>,
    SetMeshBindGroup<2>,
    SetPhantomBindGroup<3>,
    DrawMesh,
);

/// Draws a phantom in the prepass.
type DrawPhantomPrepass = (
    SetItemPipeline,
    SetPrepassViewBindGroup<0>,
    SetPrepassViewEmptyBindGroup<1>,
    SetMeshBindGroup<2>,
    SetPhantomBindGroup<3>,
    DrawMesh,
);

/// Sets the bind group that a view has for phantoms, in place of that of their material. Without one, nothing is drawn.
struct SetPhantomBindGroup<const I: usize>;

impl<P: PhaseItem, const I: usize> RenderCommand<P> for SetPhantomBindGroup<I> {
    type Param = ();
    type ViewQuery = Option<Read<PhantomBindGroup>>;
    type ItemQuery = ();

    fn render<'w>(
        _: &P,
        bind_group: ROQueryItem<'w, '_, Self::ViewQuery>,
        _: Option<()>,
        _: SystemParamItem<'w, '_, Self::Param>,
        pass: &mut TrackedRenderPass<'w>,
    ) -> RenderCommandResult {
        let Some(bind_group) = bind_group else {
            return RenderCommandResult::Skip;
        };
        pass.set_bind_group(I, &bind_group.bind_group, &[]);
        RenderCommandResult::Success
    }
}

/// Adds the draw functions. All of Bevy's plugins have been built by then.
pub(super) fn finish(app: &mut App) {
    let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
        return;
    };
    let world = render_app.world();
    let has_phases = world.contains_resource::<DrawFunctions<Opaque3d>>()
        && world.contains_resource::<DrawFunctions<Opaque3dPrepass>>();
    if !has_phases {
        return;
    }
    let replace = replace_draw_functions
        .in_set(RenderSystems::PrepareAssets)
        .after(prepare_erased_assets::<MeshMaterial3d<PhantomMaterial>>);
    render_app
        .add_render_command::<Opaque3d, DrawPhantom>()
        .add_render_command::<Opaque3dPrepass, DrawPhantomPrepass>()
        .add_systems(Render, replace);
}

/// Puts the draw functions of phantoms in place of those that the engine gives to every material.
fn replace_draw_functions(
    mut materials: ResMut<ErasedRenderAssets<PreparedMaterial>>,
    main: Res<DrawFunctions<Opaque3d>>,
    prepass: Res<DrawFunctions<Opaque3dPrepass>>,
) {
    let (main, prepass) = (main.read().id::<DrawPhantom>(), prepass.read().id::<DrawPhantomPrepass>());
    let functions: [(InternedDrawFunctionLabel, DrawFunctionId); 3] = [
        (MainPassOpaqueDrawFunction.intern(), main),
        (PrepassOpaqueDrawFunction.intern(), prepass),
        (PrepassOpaqueDepthOnlyDrawFunction.intern(), prepass),
    ];
    for (id, material) in materials.iter_mut() {
        // Materials that have just been made are not shared yet; all others have been changed already.
        if id.type_id() == TypeId::of::<PhantomMaterial>()
            && let Some(properties) = Arc::get_mut(&mut material.properties)
        {
            for (label, function) in &mut properties.draw_functions {
                if let Some((_, ours)) = functions.iter().find(|(known, _)| known == label) {
                    *function = *ours;
                }
            }
        }
    }
}

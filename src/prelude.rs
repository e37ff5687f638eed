//! What most games import: the components, what one reads back from them, the events and the run conditions.

#[cfg(target_arch = "wasm32")]
pub use crate::camera::{BrowserCameraOptions, CameraFacing};
#[cfg(feature = "webcam")]
pub use crate::camera::{DeviceExposure, DeviceId, DeviceOptions};
#[cfg(feature = "egui")]
pub use crate::debug::MirrorballPanelPlugin;
pub use crate::{
    MirrorballPlugins,
    camera::{
        ArCamera, CameraFeed, CameraFrame, FeedLost, FeedPace, FeedRecovered, FeedState, FrameFit, Intrinsics,
        any_feed_lost,
    },
    lighting::{RealLight, RealLightAppeared, RealLightVanished},
    materials::{
        CameraGrain, ClassicModel, ClassicStyle, CombinedModel, MeasuredLightWeight, MixedModel, NeighborReflections,
        NoNeighborReflections, PhongToon, ShowPhantoms, SoftPhantomEdges, SphereMapModel, StyleFade, SurfaceStyle,
        ToonKey, ToonModel, ToonRamps, ToonStyle,
    },
    phantom::PhantomObject,
    prefilter::{EnvironmentState, LiveEnvironment, Refresh, SpecularLobe},
    probe::{
        EnvironmentFallback, EnvironmentMeasured, EnvironmentOrigin, LightProbeCamera, LightProbeSphere,
        ProbeCameraState, ProbeLens, ProbeMeasurement, is_lit_by_measurement,
    },
    shadows::{DomeState, PlanarShadow, PlanarShadowState, ShadowDomeLight, ShadowFilter},
    tracking::{
        ButtonCovered, ButtonUncovered, FrameRecorder, MarkerAnchor, MarkerBoard, MarkerFound, MarkerLost, MarkerState,
        MarkerTracking, PoseFilter, VirtualButton, VirtualButtonState, WorldOrigin, any_marker_tracked,
        world_origin_tracked,
    },
};

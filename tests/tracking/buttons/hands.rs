//! Hands that tap on fields: fingers and the hand behind them, as capsules above the sheet.

use super::{
    random::Random,
    sheet_view::{FIELDS, SheetView},
};
use glam::{Vec2, Vec3, Vec3Swizzles};

/// A line with a radius, in meters above the sheet.
#[derive(Clone, Copy, Debug)]
pub(super) struct Capsule {
    pub(super) from: Vec3,
    pub(super) to: Vec3,
    pub(super) radius: f32,
}

/// Where a ray hits a capsule: distance along the ray, normal and position along the capsule.
pub(super) struct Hit {
    pub(super) distance: f32,
    pub(super) normal: Vec3,
    pub(super) along: f32,
}

impl Capsule {
    /// First hit of a ray. Its distance is that of the nearest point to the line, which is exact enough for thin
    /// capsules.
    pub(super) fn hit(&self, origin: Vec3, ray: Vec3) -> Option<Hit> {
        let (line, from) = (self.to - self.from, self.from - origin);
        let (on_ray, on_line) = (line.dot(ray), line.length_squared());
        let denominator = on_line - on_ray * on_ray;
        let along = (on_ray * from.dot(ray) - line.dot(from)) / denominator.max(1e-9);
        let along = along.clamp(0.0, 1.0);
        let middle = from + along * line;
        let distance = middle.dot(ray);
        let off = ray * distance - middle;
        let square = off.length_squared() / (self.radius * self.radius);
        (square < 1.0).then(|| Hit { distance, normal: off / self.radius - ray * (1.0 - square).sqrt(), along })
    }
}

/// What a hand is made of.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cover {
    /// Reflectance, linear.
    pub(super) albedo: Vec3,
    /// Width of the finger, in meters.
    pub(super) width: f32,
    /// Whether there is a hand behind it.
    pub(super) has_hand: bool,
}

impl Cover {
    pub(super) const LIGHT_SKIN: Self = Self { albedo: Vec3::new(0.5, 0.3, 0.21), width: 0.016, has_hand: true };
    pub(super) const DARK_SKIN: Self = Self { albedo: Vec3::new(0.13, 0.07, 0.045), width: 0.016, has_hand: true };
    pub(super) const BLACK_GLOVE: Self = Self { albedo: Vec3::splat(0.025), width: 0.018, has_hand: true };
    pub(super) const BLACK_SHOE: Self = Self { albedo: Vec3::splat(0.03), width: 0.045, has_hand: false };
}

/// One tap: down, rest, up.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tap {
    pub(super) field: usize,
    pub(super) cover: Cover,
    /// Where the tip of the finger goes, and where it comes from, on the sheet.
    target: Vec2,
    start: Vec2,
    /// Time at which it sets out, in seconds, and how long each part takes.
    pub(super) begin: f64,
    pub(super) down: f64,
    rest: f64,
    up: f64,
    /// Directions of the middle of the hand from the tip.
    side: f32,
}

impl Tap {
    /// A tap as players do it, on any part of a field.
    pub(super) fn natural(field: usize, begin: f64, cover: Cover, random: &mut Random) -> Self {
        let aim = Vec2::new(random.between(-0.014, 0.014), random.between(-0.012, 0.008));
        let mut tap = Self::at(field, aim, begin, cover);
        tap.start += Vec2::new(random.between(-0.015, 0.015), random.between(-0.01, 0.02));
        tap.down = f64::from(random.between(0.06, 0.09));
        tap.rest = f64::from(random.between(0.07, 0.18));
        tap.up = f64::from(random.between(0.08, 0.13));
        tap.side = random.between(-0.25, 0.25);
        tap
    }

    /// A tap whose tip comes to rest at a place in a field, in meters from its middle.
    pub(super) fn at(field: usize, place: Vec2, begin: f64, cover: Cover) -> Self {
        let target = FIELDS[field] + place;
        let start = Vec2::new(target.x, 0.175);
        Self { field, cover, target, start, begin, down: 0.075, rest: 0.12, up: 0.1, side: 0.0 }
    }

    pub(super) fn end(&self) -> f64 {
        self.begin + self.down + self.rest + self.up
    }

    /// How far it is down at a time, 0…1.
    fn depth(&self, seconds: f64) -> f32 {
        let t = seconds - self.begin;
        let down = (t / self.down).clamp(0.0, 1.0) as f32;
        let up = ((t - self.down - self.rest) / self.up).clamp(0.0, 1.0) as f32;
        let smooth = |x: f32| x * x * (3.0 - 2.0 * x);
        smooth(down) - smooth(up)
    }

    /// Capsules at a time; none before and after.
    pub(super) fn capsules(&self, seconds: f64, into: &mut Vec<Capsule>) {
        if seconds <= self.begin || seconds >= self.end() {
            return;
        }
        let depth = self.depth(seconds);
        let radius = 0.5 * self.cover.width;
        let tip = self.start.lerp(self.target, depth).extend(radius + 0.001 + 0.03 * (1.0 - depth));
        let back = Vec3::new(self.side, 1.0, 0.0);
        if !self.cover.has_hand {
            into.push(Capsule { from: tip, to: tip + back * 0.15 + Vec3::Z * 0.04, radius });
            return;
        }
        let joint = tip + back * 0.03 + Vec3::Z * 0.012;
        let knuckle = tip + back * 0.075 + Vec3::Z * 0.022;
        into.push(Capsule { from: tip, to: joint, radius });
        into.push(Capsule { from: joint, to: knuckle, radius: radius + 0.001 });
        // The other fingers are bent, and the hand's back follows.
        for aside in [-0.022, 0.02, 0.04] {
            let bent = knuckle + Vec3::new(aside, 0.004, -0.004);
            into.push(Capsule { from: bent + Vec3::new(0.0, -0.018, -0.012), to: bent, radius: 0.009 });
            into.push(Capsule { from: bent, to: bent + back * 0.07, radius: 0.012 });
        }
    }

    /// Fraction of its field that it hides from a camera at a time, by area.
    pub(super) fn hidden(&self, view: &SheetView, seconds: f64) -> f32 {
        let mut capsules = Vec::new();
        self.capsules(seconds, &mut capsules);
        hidden_fraction(self.field, view, &capsules)
    }
}

/// Fraction of a field that capsules hide from a camera, by area.
pub(super) fn hidden_fraction(field: usize, view: &SheetView, capsules: &[Capsule]) -> f32 {
    if capsules.is_empty() {
        return 0.0;
    }
    let size = super::sheet_view::grid().size;
    let (columns, rows) = (24, 32);
    let mut hidden = 0;
    for (x, y) in (0..rows).flat_map(|y| (0..columns).map(move |x| (x, y))) {
        let part = (Vec2::new(x as f32, y as f32) + 0.5) / Vec2::new(columns as f32, rows as f32) - 0.5;
        let ray = ((FIELDS[field] + part * size).extend(0.0) - view.position).normalize();
        hidden += usize::from(capsules.iter().any(|capsule| capsule.hit(view.position, ray).is_some()));
    }
    hidden as f32 / (columns * rows) as f32
}

/// Soft shadow of capsules at a place on the sheet: the fraction of the lamp's light that arrives.
pub(super) fn shadow(place: Vec2, capsules: &[Capsule], to_lamp: Vec3) -> f32 {
    let mut lit: f32 = 1.0;
    for capsule in capsules {
        let fall = |p: Vec3| p.xy() - to_lamp.xy() * (p.z / to_lamp.z);
        let (from, to) = (fall(capsule.from), fall(capsule.to));
        let line = to - from;
        let along = ((place - from).dot(line) / line.length_squared().max(1e-9)).clamp(0.0, 1.0);
        let height = capsule.from.z + along * (capsule.to.z - capsule.from.z);
        let softness = 0.002 + 0.3 * height;
        let off = (place - from - along * line).length() - capsule.radius;
        let t = (0.5 + 0.5 * off / softness).clamp(0.0, 1.0);
        lit = lit.min(t * t * (3.0 - 2.0 * t));
    }
    lit
}

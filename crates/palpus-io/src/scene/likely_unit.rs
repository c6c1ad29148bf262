//! The likely unit of a mesh file that does not state one, from the size of the mesh.

use glam::DVec3;

/// Likely sizes of probe and environment, m.
const LIKELY: [f64; 2] = [4e-3, 1.2];
/// Largest likely ratio of the sizes of two bodies.
const LIKELY_RATIO: f64 = 10.0;

/// A usual unit of length of mesh files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LikelyUnit {
    /// 1 mm.
    Millimetre,
    /// 1 m.
    Metre,
    /// 1 cm.
    Centimetre,
    /// 25.4 mm.
    Inch,
}

impl LikelyUnit {
    /// Units in the order of likelihood; a size may fit several.
    pub const ALL: [Self; 4] = [Self::Millimetre, Self::Metre, Self::Centimetre, Self::Inch];

    /// The name of the unit in a scene file.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Millimetre => "mm",
            Self::Metre => "m",
            Self::Centimetre => "cm",
            Self::Inch => "inch",
        }
    }

    /// The length of the unit, m.
    #[must_use]
    pub const fn metres(self) -> f64 {
        match self {
            Self::Millimetre => 1e-3,
            Self::Metre => 1.0,
            Self::Centimetre => 1e-2,
            Self::Inch => 25.4e-3,
        }
    }

    /// Returns the first unit with which a body suits an object that people hold or touch, else
    /// millimetres. `size`: the sides of its box, in the unit of the file.
    #[must_use]
    pub fn of(size: DVec3) -> Self {
        let largest = size.max_element();
        Self::ALL.into_iter().find(|unit| unit.fits(largest)).unwrap_or(Self::Millimetre)
    }

    /// Returns likely units of two bodies that touch each other. Each of the bodies suits a hand,
    /// their sizes are similar, and their units are equal if possible. `sizes`: the sides of their
    /// boxes, in the unit of each file; `selected`: units that are known. `None` if no units are
    /// likely.
    #[must_use]
    pub fn of_pair(sizes: [DVec3; 2], selected: [Option<Self>; 2]) -> Option<[Self; 2]> {
        let largest = sizes.map(DVec3::max_element);
        let is_likely = |units: &[Self; 2]| {
            let ratio = largest[0] * units[0].metres() / (largest[1] * units[1].metres());
            (0..2).all(|k| selected[k].map_or(units[k].fits(largest[k]), |unit| unit == units[k]))
                && (LIKELY_RATIO.recip()..=LIKELY_RATIO).contains(&ratio)
        };
        let equal = Self::ALL.map(|unit| [unit; 2]);
        let all = Self::ALL.into_iter().flat_map(|first| Self::ALL.map(|second| [first, second]));
        equal.into_iter().chain(all).find(is_likely)
    }

    /// Returns true if a body whose largest side has this length suits a person's hand.
    fn fits(self, largest: f64) -> bool {
        (LIKELY[0]..=LIKELY[1]).contains(&(largest * self.metres()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::metres;

    #[test]
    fn names_are_those_of_scene_files() {
        for unit in LikelyUnit::ALL {
            assert_eq!(metres(unit.name()), Ok(unit.metres()));
        }
    }

    #[test]
    fn units_are_guessed_from_sizes_of_things() {
        for (largest, unit) in [(80.0, "mm"), (0.12, "m"), (1.0, "m"), (2.0, "cm"), (1.2e3, "mm"), (9e9, "mm")] {
            assert_eq!(LikelyUnit::of(DVec3::new(0.5 * largest, largest, 0.1 * largest)).name(), unit, "{largest}");
        }
    }

    #[test]
    fn units_of_two_meshes_are_guessed_together() {
        let guess = |sizes: [f64; 2], selected| {
            LikelyUnit::of_pair(sizes.map(DVec3::splat), selected).map(|units| units.map(LikelyUnit::name))
        };
        // A piece of 1 unit and a part of 6 units: 1 m beside 6 mm is not likely.
        assert_eq!(guess([1.0, 6.0], [None; 2]), Some(["cm", "cm"]));
        assert_eq!(guess([80.0, 40.0], [None; 2]), Some(["mm", "mm"]));
        assert_eq!(guess([0.15, 120.0], [None; 2]), Some(["m", "mm"]));
        assert_eq!(guess([1.0, 6.0], [None, Some(LikelyUnit::Millimetre)]), Some(["cm", "mm"]));
        assert_eq!(guess([9e9, 1.0], [None; 2]), None);
    }
}

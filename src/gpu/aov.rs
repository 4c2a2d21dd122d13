//! Reads the sums for layers beside the image out of the kernel's `Partial`s.

use crate::film::AovSums;
use crate::placement::Placement;
use crate::settings::Rect;
use crate::shader::Kernel;

/// Where a `Partial` has what; members that the kernel does not have are none.
#[derive(Clone, Copy, Debug)]
pub(super) struct AovLayout {
    stride: usize,
    classes: Option<usize>,
    features: Option<usize>,
    /// Kernel radiance per radiance.
    radiance_scale: f64,
    /// Kernel lengths per scene length.
    scale: f64,
    /// Depth at which rays start, in kernel lengths.
    approach: f64,
}

impl AovLayout {
    /// That of `kernel`; `None` if it keeps no such sums.
    pub(super) fn of(kernel: &Kernel, placement: &Placement) -> Option<Self> {
        let (members, stride) = kernel.struct_members("Partial")?;
        let offset = |name: &str| {
            let member = members.iter().find(|(member, _)| member == name);
            member.map(|(_, offset)| *offset as usize)
        };
        let layout = Self {
            stride: stride as usize,
            classes: offset("classes"),
            features: offset("features_normal"),
            radiance_scale: placement.radiance_scale,
            scale: placement.scale,
            approach: placement.camera.approach,
        };
        (layout.classes.is_some() || layout.features.is_some()).then_some(layout)
    }

    /// The sums of the pixels of `region`, out of the bytes of their partials.
    pub(super) fn read(&self, bytes: &[u8], region: Rect) -> Vec<AovSums> {
        bytes
            .chunks_exact(self.stride)
            .take(region.pixels())
            .map(|partial| self.sums(partial))
            .collect()
    }

    fn sums(&self, partial: &[u8]) -> AovSums {
        let number =
            |at: usize| f64::from(bytemuck::pod_read_unaligned::<f32>(&partial[at..at + 4]));
        let vector = |at: usize| [number(at), number(at + 4), number(at + 8)];
        let mut sums = AovSums::default();
        if let Some(at) = self.classes {
            for (i, class) in sums.classes.iter_mut().enumerate() {
                *class = vector(at + 16 * i).map(|x| x / self.radiance_scale);
            }
        }
        // Two vectors, each followed by a number.
        if let Some(at) = self.features {
            sums.normal = vector(at);
            sums.hits = number(at + 12);
            sums.albedo = vector(at + 16);
            sums.depth = (number(at + 28) + self.approach * sums.hits) / self.scale;
        }
        sums
    }
}

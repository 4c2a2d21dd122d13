//! The structs that host and kernel share have the same layout on both sides.

mod fixed;
mod glsl;
mod material;
mod records;

use std::mem::offset_of;

use crate::common::scene;
use gpu_trace::effects::Effects;
use gpu_trace::placement::Placement;
use gpu_trace::records::layout::CameraRecord;
use gpu_trace::settings::Settings;
use gpu_trace::shader::{Kernel, Stage, link};
use gpu_trace::verify::EMPTY;

/// Name and offset of every member, and the size.
type Layout = (Vec<(String, u32)>, u32);

/// Every member of a record with its offset. A pattern without `..` names them all, or it does not
/// compile.
macro_rules! host {
    ($record:ident { $($member:ident),* $(,)? }) => {{
        let $record { $($member: _),* } = <$record as bytemuck::Zeroable>::zeroed();
        let members = vec![$((stringify!($member).to_owned(), offset_of!($record, $member) as u32)),*];
        (members, size_of::<$record>() as u32)
    }};
}
use host;

/// A kernel with exactly `names`. The scene has no spheres: only types matter.
fn kernel(stage: Stage, names: &[&str]) -> Kernel {
    let scene = scene(EMPTY);
    let settings = Settings::for_scene(&scene);
    let placement = Placement::new(&scene, settings.width, settings.height);
    let effects = Effects::named(names);
    link(stage, &scene, &placement, &effects).unwrap_or_else(|e| panic!("{e}"))
}

fn device(kernel: &Kernel, name: &str) -> Layout {
    kernel
        .struct_members(name)
        .unwrap_or_else(|| panic!("no struct {name} in\n{}", kernel.wgsl))
}

/// What is wrong with `host` as the host's side of `device`, if anything is. The host may have
/// padding of its own; `longer` allows it to go on where the kernel's struct ends.
fn mismatch(host: &Layout, device: &Layout, longer: bool) -> Option<String> {
    for member in &device.0 {
        if !host.0.contains(member) {
            return Some(format!("the host has no {} at {}", member.0, member.1));
        }
    }
    for (name, offset) in &host.0 {
        let there = device.0.iter().any(|(n, _)| n == name);
        let excused = name.starts_with("unused") || (longer && *offset >= device.1);
        if !there && !excused {
            return Some(format!("the kernel has no {name} at {offset}"));
        }
    }
    let fits = if longer {
        host.1 >= device.1
    } else {
        host.1 == device.1
    };
    (!fits).then(|| format!("{} bytes on the host, {} in the kernel", host.1, device.1))
}

fn check(name: &str, host: &Layout, kernel: &Kernel) {
    let device = device(kernel, name);
    let wrong = mismatch(host, &device, false);
    assert_eq!(wrong, None, "{name}: host {host:?}, kernel {device:?}");
}

/// Everything that fixed structs need.
const FULL: [&str; 10] = [
    "list", "pole", "interior", "lens", "motion", "diffuse", "emission", "lights", "table", "mis",
];

fn camera() -> Layout {
    host!(CameraRecord {
        anchor,
        approach,
        corner,
        unused0,
        across,
        unused1,
        down,
        unused2,
        forward,
        unused3,
        lens_across,
        focus,
        lens_down,
        lens_share,
    })
}

#[test]
fn a_camera_without_lens_is_the_start_of_one_with_a_lens() {
    let device = device(&kernel(Stage::Path, &["list"]), "Camera");
    assert!(
        device.0.iter().all(|(name, _)| !name.contains("lens")),
        "{device:?}"
    );
    assert_eq!(mismatch(&camera(), &device, true), None);
}

#[test]
fn companion_a_wrong_layout_is_found() {
    let kernel = kernel(Stage::Path, &FULL);
    let device = device(&kernel, "Camera");
    let good = camera();
    assert_eq!(mismatch(&good, &device, false), None);
    let mut moved = good.clone();
    moved.0[2].1 += 4;
    assert!(mismatch(&moved, &device, false).is_some());
    let mut swapped = good.clone();
    swapped.0.swap(10, 12);
    let (a, b) = (swapped.0[10].1, swapped.0[12].1);
    (swapped.0[10].1, swapped.0[12].1) = (b, a);
    assert!(mismatch(&swapped, &device, false).is_some());
    let mut more = good.clone();
    more.0.push(("extra".into(), good.1));
    assert!(mismatch(&more, &device, false).is_some());
    assert!(mismatch(&(good.0, good.1 + 16), &device, false).is_some());
}

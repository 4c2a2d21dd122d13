//! The structs that host and kernel share have the same layout on both sides.

mod glsl;
mod material;

use std::mem::offset_of;

use crate::common::scene;
use gpu_trace::effects::Effects;
use gpu_trace::gpu::probe::ShapeRecord;
use gpu_trace::placement::Placement;
use gpu_trace::records::layout::{
    CameraRecord, ChartRecord, CountersRecord, DispatchRecord, LightRecord, PilotRecord,
    PoleRecord, SphereRecord,
};
use gpu_trace::settings::Settings;
use gpu_trace::shader::{Folder, Kernel, Stage, link};
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

fn light() -> Layout {
    host!(LightRecord {
        anchor,
        radius,
        weight,
        threshold,
        other,
        sphere,
        pole,
        curvature,
        motion,
        unused,
    })
}

fn sphere() -> Layout {
    host!(SphereRecord {
        center,
        radius,
        motion,
        unused,
    })
}

fn pole() -> Layout {
    host!(PoleRecord {
        point,
        curvature,
        normal,
        unused,
        motion,
        unused1,
    })
}

#[test]
fn fixed_structs_agree() {
    let kernel = kernel(Stage::Path, &FULL);
    check("Sphere", &sphere(), &kernel);
    check("Pole", &pole(), &kernel);
    check("Camera", &camera(), &kernel);
    let dispatch = host!(DispatchRecord {
        region_origin,
        region_size,
        first_tile,
        end_tile,
        window_start,
        end_sample,
        stream,
        fresh,
        step_limit,
        zero,
        last_of_batch,
        step_most,
        unused,
    });
    check("Dispatch", &dispatch, &kernel);
    let counters = host!(CountersRecord {
        non_finite,
        first_pixel,
        sample_low,
        bounce,
        unfinished,
        advanced,
        zero,
    });
    check("Counters", &counters, &kernel);
    check("Light", &light(), &kernel);
}

#[test]
fn structs_of_the_radiance_cache_agree() {
    let kernel = kernel(Stage::Path, &["list", "sobol", "diffuse", "radiance_cache"]);
    let chart = host!(ChartRecord {
        first,
        cells,
        diffuse,
        width,
        across,
        unused0,
        down,
        unused1,
    });
    check("Chart", &chart, &kernel);
    let work = host!(PilotRecord {
        stream,
        batch,
        begin,
        end,
        first_value,
        samples,
        first_sample,
        end_sample,
        unused,
    });
    check("PilotWork", &work, &kernel);
}

#[test]
fn the_probes_shape_agrees() {
    let shape = host!(ShapeRecord {
        count,
        inputs,
        outputs,
        zero
    });
    check(
        "Shape",
        &shape,
        &kernel(Stage::Probe(Folder::Core), &["list"]),
    );
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
fn a_light_about_its_centre_is_the_start_of_one_about_its_pole() {
    let names = ["list", "emission", "diffuse", "lights", "table"];
    let device = device(&kernel(Stage::Path, &names), "Light");
    assert!(
        device.0.iter().all(|(name, _)| name != "pole"),
        "{device:?}"
    );
    assert_eq!(mismatch(&light(), &device, true), None);
}

#[test]
fn what_is_at_rest_is_the_start_of_what_moves() {
    let names = FULL.into_iter().filter(|name| *name != "motion");
    let kernel = kernel(Stage::Path, &names.collect::<Vec<_>>());
    for (name, host) in [("Sphere", sphere()), ("Pole", pole()), ("Light", light())] {
        let device = device(&kernel, name);
        assert!(device.0.iter().all(|(name, _)| name != "motion"));
        assert_eq!(mismatch(&host, &device, true), None, "{name}");
    }
}

#[test]
fn a_light_is_written_with_the_members_that_the_kernel_has() {
    let record = LightRecord {
        anchor: [1.0, 2.0, 3.0],
        radius: 4.0,
        pole: [5.0, 6.0, 7.0],
        curvature: 8.0,
        motion: [9.0, 10.0, 11.0],
        sphere: 12,
        ..bytemuck::Zeroable::zeroed()
    };
    for without in ["", "pole", "motion"] {
        let names = FULL.into_iter().filter(|name| *name != without);
        let kernel = kernel(Stage::Path, &names.collect::<Vec<_>>());
        let (members, size) = device(&kernel, "Light");
        let bytes = record.bytes(&members, size);
        assert_eq!(bytes.len(), size as usize);
        for (name, value) in [
            ("anchor", 1.0),
            ("radius", 4.0),
            ("pole", 5.0),
            ("curvature", 8.0),
            ("motion", 9.0),
        ] {
            let Some((_, offset)) = members.iter().find(|(member, _)| member == name) else {
                assert!(
                    !without.is_empty() && value >= 5.0,
                    "{name} without {without}"
                );
                continue;
            };
            let found: [u8; 4] = bytes[*offset as usize..][..4].try_into().expect("a number");
            assert_eq!(f32::from_ne_bytes(found), value, "{name} without {without}");
        }
        assert_eq!(
            members.len(),
            match without {
                "pole" => 7,
                "motion" => 8,
                _ => 9,
            }
        );
    }
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

#[test]
fn attributes_agree() {
    for (names, expected) in [
        (&["list", "diffuse"][..], vec![("material", 0)]),
        (
            &["list", "diffuse", "interior"],
            vec![("material", 0), ("side", 4)],
        ),
        (
            &["bvh", "diffuse", "interior"],
            vec![("material", 0), ("side", 4), ("place", 8)],
        ),
    ] {
        let (members, size) = device(&kernel(Stage::Path, names), "Attributes");
        let members: Vec<(&str, u32)> = members.iter().map(|(n, o)| (n.as_str(), *o)).collect();
        assert_eq!(members, expected);
        // The renderer writes words without padding.
        assert_eq!(size as usize, 4 * expected.len());
    }
}

/// Each array has room for exactly what the host writes: an empty scene has one of each.
#[test]
fn the_scenes_data_agree() {
    let kernel = kernel(Stage::Path, &FULL);
    let (members, size) = device(&kernel, "SceneData");
    let mut end = 0;
    let expected = [
        ("spheres", "Sphere", size_of::<SphereRecord>() as u32),
        ("poles", "Pole", size_of::<PoleRecord>() as u32),
        ("attributes", "Attributes", 12),
        ("materials", "Material", device(&kernel, "Material").1),
        ("lights", "Light", size_of::<LightRecord>() as u32),
    ];
    for ((name, offset), (member, record, stride)) in members.iter().zip(expected) {
        assert_eq!((name.as_str(), device(&kernel, record).1), (member, stride));
        assert!(
            (end..end + 16).contains(offset),
            "{name} at {offset}, not {end}"
        );
        end = offset + stride;
    }
    assert_eq!(
        (members.len(), size),
        (expected.len(), end.next_multiple_of(16))
    );
    // Those of a tree are in its texture.
    let tree = FULL.map(|name| if name == "list" { "bvh" } else { name });
    let (members, _) = device(&self::kernel(Stage::Path, &tree), "SceneData");
    let names: Vec<&str> = members.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names, ["poles", "attributes", "materials", "lights"]);
    // Without lights, poles and spheres in a list there is nothing to read.
    let baked = self::kernel(Stage::Path, &["baked", "diffuse"]);
    assert_eq!(baked.struct_members("SceneData"), None);
}

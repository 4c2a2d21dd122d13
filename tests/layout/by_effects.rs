//! Structs that have the members that a kernel's effects ask for.

use gpu_trace::records::layout::{LightRecord, PoleRecord};
use gpu_trace::shader::Stage;

use super::{FULL, camera, device, kernel, light, mismatch, pole, sphere};

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

/// Each array has room for exactly what the host writes: an empty scene has one of each.
#[test]
fn the_scenes_data_agree() {
    let kernel = kernel(Stage::Path, &FULL);
    let (members, size) = device(&kernel, "SceneData");
    let mut end = 0;
    let expected = [
        ("poles", "Pole", size_of::<PoleRecord>() as u32),
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
    assert_eq!(names, ["poles", "lights"]);
    // Without lights, poles and spheres in a list there is nothing to read.
    let baked = self::kernel(Stage::Path, &["baked", "diffuse"]);
    assert_eq!(baked.struct_members("SceneData"), None);
}

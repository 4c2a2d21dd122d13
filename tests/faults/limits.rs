//! What a device, its numbers or the memory cannot hold.

use gpu_trace::error::Error;
use gpu_trace::gpu::renderer::GpuRenderer;
use gpu_trace::settings::GeometryChoice;

use super::limited;
use crate::cli_support::{Folder, holds};

#[test]
fn a_scene_beyond_the_devices_limits_is_an_error() {
    let scene = crate::common::scene_file("scenes/glass.toml");
    let mut settings = gpu_trace::verify::settings(&scene, 64, 64, 1);
    settings.geometry = GeometryChoice::List;
    let job = crate::common::job(&scene, &settings);
    let with_at_most = |bytes: u64| {
        let mut gpu = crate::common::gpu();
        gpu.limits.max_storage_buffer_binding_size = bytes;
        GpuRenderer::new(gpu, &job)
    };
    match with_at_most(4096) {
        Err(Error::DeviceLimit(text)) => holds(
            &text,
            &[
                "the partial sums need",
                "bytes",
                "limit of 4096 ",
                "--backend cpu",
            ],
        ),
        other => panic!("{other:?}"),
    }
    assert!(with_at_most(1 << 20).is_ok());
}

#[test]
fn a_scene_of_too_many_magnitudes_is_an_error() {
    let folder = Folder::new();
    let scene = |camera: &str, radius: &str| {
        format!(
            "camera = {{ {camera}, look_at = [0, 0, 0], fov = 40 }}
             image = {{ width = 4, height = 4 }}
             environment = {{ radiance = [1, 1, 1] }}
             material.a = {{ type = \"diffuse\", albedo = [1, 1, 1] }}
             sphere = [
                 {{ center = [3, 0, 0], radius = 1, material = \"a\" }},
                 {{ center = [0, 0, 0], radius = {radius}, material = \"a\" }},
             ]"
        )
    };
    let near = "position = [0, 0, -1]";
    let far = "position = [0, 0, -1e20]";
    let lens = "position = [0, 0, -1], aperture_radius = 1e-3, focus_distance = 1e-50";
    for (camera, radius, part) in [
        (near, "1e-61", "the radius of sphere 2 "),
        (near, "1e-300", "the radius of sphere 2 "),
        (lens, "0.1", "the camera's lens "),
    ] {
        folder.write("bad.toml", scene(camera, radius));
        for command in [&["effects", "bad.toml"][..], &["bad.toml", "-o", "r.npy"]] {
            holds(&folder.refused(command), &["error: ", part, "magnitude"]);
        }
    }
    let dark = scene(near, "0.1").replace("radiance = [1, 1, 1]", "radiance = [0, 1e-320, 0]");
    folder.write("bad.toml", dark);
    let text = folder.refused(&["bad.toml", "-o", "r.npy"]);
    holds(&text, &["error: the brightest light", "too dark"]);
    // What f32 holds is rendered.
    for (camera, radius) in [(near, "1e-37"), (far, "1e-10"), (near, "1")] {
        folder.write("good.toml", scene(camera, radius));
        folder.ok("good.toml --spp 1 -o r.npy");
    }
}

/// The driver's part of an address space is unknown; without one it ends well at any limit.
#[cfg(target_os = "linux")]
#[test]
fn with_little_memory_a_render_is_refused_or_done() {
    let folder = Folder::new();
    folder.write("r.npy", "old");
    // Nothing but sky, so that many limits can be tried.
    folder.write(
        "sky.toml",
        "camera = { position = [0, 0, 0], look_at = [0, 0, 1], fov = 40 }
         image = { width = 600, height = 600 }
         environment = { radiance = [1, 1, 1] }",
    );
    let arguments = "sky.toml --backend cpu --threads 1 --spp 1 -o r.npy -o r.exr -o r.png";
    let mut codes = Vec::new();
    // 360,000 pixels take 118 MB, and what does not depend on them 18 and more. In steps that are small
    // against the 64 MiB of address space that a thread's own heap would take at some moment.
    for megabytes in (60..=320).step_by(10) {
        let before = folder.snapshot();
        let run = limited(&folder, &format!("ulimit -v {megabytes}000"), arguments);
        match run.code {
            Some(2) => {
                let text = "error: 600x600 pixels need 0.";
                holds(&run.stderr, &[text, "GiB of memory", "--crop"]);
                assert_eq!(before, folder.snapshot());
            }
            code => assert_eq!(code, Some(0), "{megabytes} MB: {run:?}"),
        }
        codes.push(run.code);
    }
    assert!(codes.is_sorted_by(|a, b| a >= b), "{codes:?}");
    assert_eq!(
        (codes.first(), codes.last()),
        (Some(&Some(2)), Some(&Some(0)))
    );
}

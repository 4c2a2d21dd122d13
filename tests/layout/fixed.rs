//! Structs that are the same in every kernel that has them.

use std::mem::offset_of;

use gpu_trace::gpu::probe::ShapeRecord;
use gpu_trace::records::layout::{CountersRecord, DispatchRecord, PilotRecord};
use gpu_trace::shader::{Folder, Stage};

use super::{FULL, camera, check, host, kernel};

#[test]
fn fixed_structs_agree() {
    let kernel = kernel(Stage::Path, &FULL);
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
}

#[test]
fn structs_of_the_radiance_cache_agree() {
    let kernel = kernel(Stage::Path, &["list", "sobol", "diffuse", "radiance_cache"]);
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

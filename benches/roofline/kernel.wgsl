// A ray against spheres about their centres, and nothing else: the arithmetic of shaders/scene/sphere.wesl and
// nearer.wesl for paths outside, on spheres that are constants. Each turn is another ray against eight spheres.

@group(0) @binding(0) var<storage, read_write> found: array<vec2f>;

struct Hit {
    t: f32,
    index: u32,
}

fn nearer(best: Hit, center: vec3f, radius: f32, index: u32, anchor: vec3f, offset: vec3f, direction: vec3f, dd: f32) -> Hit {
    let f = (anchor - center) + offset;
    let b = -dot(f, direction);
    let l = f + (b / dd) * direction;
    let rr = radius * radius;
    let square = dd * (rr - dot(l, l));
    let c = dot(f, f) - rr;
    let t = max(c, 0.0) / (b + sqrt(max(square, 0.0)));
    let hits = b > 0.0 && square >= 0.0 && t < best.t;
    return Hit(select(best.t, t, hits), select(best.index, index, hits));
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let k = f32(id.x) * 1e-3;
    var direction = vec3f(sin(k), cos(k), 2.0);
    var offset = vec3f(0.1 * cos(k), 0.1 * sin(k), 0.0);
    let anchor = vec3f(0.0, 0.0, -9.0);
    var total = 0.0;
    var last = 0u;
    for (var turn = 0u; turn < 2048u; turn++) {
        let dd = dot(direction, direction);
        var hit = Hit(1e30, 9u);
        hit = nearer(hit, vec3f(-1.0, -1.0, 0.0), 0.9, 0u, anchor, offset, direction, dd);
        hit = nearer(hit, vec3f(1.0, -1.0, 0.5), 0.8, 1u, anchor, offset, direction, dd);
        hit = nearer(hit, vec3f(-1.0, 1.0, 1.0), 0.7, 2u, anchor, offset, direction, dd);
        hit = nearer(hit, vec3f(1.0, 1.0, 1.5), 1.1, 3u, anchor, offset, direction, dd);
        hit = nearer(hit, vec3f(-2.0, 0.0, 2.0), 1.2, 4u, anchor, offset, direction, dd);
        hit = nearer(hit, vec3f(2.0, 0.0, 2.5), 1.3, 5u, anchor, offset, direction, dd);
        hit = nearer(hit, vec3f(0.0, -2.0, 3.0), 1.4, 6u, anchor, offset, direction, dd);
        hit = nearer(hit, vec3f(0.0, 2.0, 3.5), 1.5, 7u, anchor, offset, direction, dd);
        // What is found decides on the next ray, so that no turn can be left out.
        total += min(hit.t, 1.0);
        last += hit.index;
        direction += vec3f(1e-4, -2e-4, 1e-5 * f32(hit.index));
        offset += vec3f(1e-5 * min(hit.t, 1.0), 1e-5, 0.0);
    }
    found[id.x] = vec2f(total, f32(last));
}

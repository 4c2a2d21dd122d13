// The baseline: the path tracer as one writes it first. A loop over spheres in a storage buffer,
// the textbook quadratic with a fixed epsilon, world coordinates, one path after the other. The same
// sample stream, materials, roulette and bounce limit as the real kernel; diffuse and emission only.

struct Sphere {
    center: vec3f,
    radius: f32,
    albedo: vec3f,
    unused0: f32,
    emission: vec3f,
    unused1: f32,
}

struct Work {
    size: vec2u,
    first_sample: u32,
    end_sample: u32,
    // Camera: position, film corner relative to it, steps of a pixel.
    position: vec3f,
    max_bounces: u32,
    corner: vec3f,
    unused0: f32,
    across: vec3f,
    unused1: f32,
    down: vec3f,
    unused2: f32,
}

const EPSILON: f32 = 1.0e-3;

@group(0) @binding(0) var<storage, read> spheres: array<Sphere>;
@group(0) @binding(1) var<uniform> work: Work;
@group(0) @binding(2) var<storage, read_write> sums: array<vec4f>;

fn pcg4d(key: vec4u) -> vec4u {
    var v = key * 1664525u + 1013904223u;
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    v ^= v >> vec4u(16u);
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    return v;
}

fn random4(pixel: vec2u, sample: u32, dimension: u32) -> vec4f {
    let bits = pcg4d(vec4u(pixel.x | (pixel.y << 16u), sample, dimension, 0x5eedu));
    return vec4f(bits >> vec4u(8u)) * 5.9604644775390625e-8;
}

fn cosine_direction(n: vec3f, u: vec2f) -> vec3f {
    let z = 1.0 - 2.0 * u.x;
    let r = sqrt(max(1.0 - z * z, 0.0));
    let phi = 6.2831853 * u.y;
    return normalize(n + vec3f(r * cos(phi), r * sin(phi), z));
}

fn intersect(sphere: Sphere, origin: vec3f, direction: vec3f) -> f32 {
    let f = origin - sphere.center;
    let b = dot(f, direction);
    let c = dot(f, f) - sphere.radius * sphere.radius;
    let discriminant = b * b - c;
    if discriminant < 0.0 {
        return -1.0;
    }
    let root = sqrt(discriminant);
    if -b - root > EPSILON {
        return -b - root;
    }
    if -b + root > EPSILON {
        return -b + root;
    }
    return -1.0;
}

fn trace(pixel: vec2u, sample: u32) -> vec4f {
    let u = random4(pixel, sample, 0u);
    let place = vec2f(pixel) + u.xy;
    var origin = work.position;
    var direction = normalize(work.corner + place.x * work.across + place.y * work.down);
    var throughput = vec3f(1.0);
    var radiance = vec3f(0.0);
    var rays = 0.0;
    for (var bounce = 0u; bounce <= work.max_bounces; bounce++) {
        rays += 1.0;
        var nearest = 1.0e30;
        var index = -1;
        for (var i = 0u; i < arrayLength(&spheres); i++) {
            let t = intersect(spheres[i], origin, direction);
            if t > 0.0 && t < nearest {
                nearest = t;
                index = i32(i);
            }
        }
        if index < 0 {
            break;
        }
        let sphere = spheres[index];
        radiance += throughput * sphere.emission;
        if bounce == work.max_bounces {
            break;
        }
        let v = random4(pixel, sample, bounce + 1u);
        throughput *= sphere.albedo;
        let survival = min(4.0 * max(max(throughput.x, throughput.y), throughput.z), 1.0);
        if v.w >= survival {
            break;
        }
        throughput /= survival;
        origin += nearest * direction;
        let normal = normalize(origin - sphere.center);
        direction = cosine_direction(select(normal, -normal, dot(normal, direction) > 0.0), v.xy);
    }
    return vec4f(radiance, rays);
}

@compute @workgroup_size(8, 8)
fn render(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= work.size) {
        return;
    }
    var sum = vec4f(0.0);
    for (var sample = work.first_sample; sample < work.end_sample; sample++) {
        sum += trace(id.xy, sample);
    }
    sums[id.y * work.size.x + id.x] += sum;
}

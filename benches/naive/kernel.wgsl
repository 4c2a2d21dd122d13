// The path tracer as a lecture writes it: f32, world coordinates, the textbook quadratic, a nudge of
// 1e-4 along the normal, a loop over spheres in a storage buffer. What it estimates is what the real
// kernel does by BSDF sampling: the same roulette and bounce limit.

struct Sphere {
    center: vec3f,
    radius: f32,
    // Albedo or reflectance.
    color: vec3f,
    kind: u32,
    emission: vec3f,
    // Refractive index inside over outside.
    ior: f32,
}

struct Work {
    size: vec2u,
    first_sample: u32,
    end_sample: u32,
    // Camera: position, film corner relative to it, steps of a pixel.
    position: vec3f,
    max_bounces: u32,
    corner: vec3f,
    unused0: u32,
    across: vec3f,
    unused1: u32,
    down: vec3f,
    unused2: u32,
    environment: vec3f,
    unused3: u32,
}

const NUDGE: f32 = 1.0e-4;
const DIFFUSE: u32 = 0u;
const MIRROR: u32 = 1u;

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

// Distance along the ray, or -1.
fn intersect(sphere: Sphere, origin: vec3f, direction: vec3f) -> f32 {
    let f = origin - sphere.center;
    let b = dot(f, direction);
    let c = dot(f, f) - sphere.radius * sphere.radius;
    let discriminant = b * b - c;
    if discriminant < 0.0 {
        return -1.0;
    }
    let root = sqrt(discriminant);
    return select(-b + root, -b - root, -b - root > 0.0);
}

// Share of the light that is reflected; eta: index beyond the surface over that on this side.
fn fresnel(cos_i: f32, eta: f32) -> f32 {
    let square = 1.0 - (1.0 - cos_i * cos_i) / (eta * eta);
    if square <= 0.0 {
        return 1.0;
    }
    let cos_t = sqrt(square);
    let s = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
    let p = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
    return 0.5 * (s * s + p * p);
}

fn trace(pixel: vec2u, sample: u32) -> vec4f {
    let place = vec2f(pixel) + random4(pixel, sample, 0u).xy;
    var origin = work.position;
    var direction = normalize(work.corner + place.x * work.across + place.y * work.down);
    var throughput = vec3f(1.0);
    // What refraction has taken out of the throughput: roulette must not see it.
    var eta_scale = 1.0;
    var radiance = vec3f(0.0);
    for (var bounce = 0u; bounce <= work.max_bounces; bounce++) {
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
            radiance += throughput * work.environment;
            break;
        }
        let sphere = spheres[index];
        radiance += throughput * sphere.emission;
        if bounce == work.max_bounces {
            break;
        }
        let u = random4(pixel, sample, bounce + 1u);
        let point = origin + nearest * direction;
        let outward = normalize(point - sphere.center);
        let inside = dot(outward, direction) > 0.0;
        // On the side of arrival.
        let normal = select(outward, -outward, inside);
        var side = 1.0;
        if sphere.kind == DIFFUSE {
            direction = cosine_direction(normal, u.xy);
            throughput *= sphere.color;
        } else if sphere.kind == MIRROR {
            direction = normalize(reflect(direction, normal));
            throughput *= sphere.color;
        } else {
            let eta = select(sphere.ior, 1.0 / sphere.ior, inside);
            if u.z < fresnel(-dot(normal, direction), eta) {
                direction = normalize(reflect(direction, normal));
            } else {
                direction = normalize(refract(direction, normal, 1.0 / eta));
                throughput /= eta * eta;
                eta_scale *= eta * eta;
                side = -1.0;
            }
        }
        let largest = eta_scale * max(max(throughput.x, throughput.y), throughput.z);
        let survival = min(4.0 * largest, 1.0);
        if largest <= 0.0 || u.w >= survival {
            break;
        }
        throughput /= survival;
        origin = point + side * NUDGE * normal;
    }
    return vec4f(radiance, 1.0);
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
    sums[id.y * work.size.x + id.x] = sum;
}

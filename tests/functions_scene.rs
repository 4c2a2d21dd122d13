//! The rest of `scene/` on the device against its f64 twins: roots, pole frames, vertices, nested
//! media, cameras. See `functions.rs` for the tolerances.

use crate::common::{probe, probe_of, scene};
use glam::DVec3;
use gpu_trace::placement::{Medium, PlacedSphere, Placement, Side};
use gpu_trace::reference::scene::camera::camera_ray;
use gpu_trace::reference::scene::priority::{cross_surface, relative_index};
use gpu_trace::reference::scene::ray::{Hit, Ray, vertex_at};
use gpu_trace::reference::scene::sphere::{Quadratic, pole_quadratic, root_interior, root_outside};
use gpu_trace::verify::{Agreement, EMPTY, Random, Row, ULP, to_row, vector};

const CASES: usize = 100_000;
const NO_HIT: f64 = 3.0e38f32 as f64;

/// Square root 4.5, the sum 1, the ratio 2.5.
const ROOT: f64 = 8.0 * ULP;

fn double(row: Row) -> [f64; 4] {
    row.map(f64::from)
}

/// Coefficients with all signs, a > 0; zeros among them.
fn coefficients(random: &mut Random, i: usize) -> [f64; 4] {
    let mut signed = |zero: usize| {
        let x = 10f64.powf(random.range(-6.0, 6.0)) * (random.unit() - 0.5).signum();
        if i % 16 == zero { 0.0 } else { x }
    };
    let (b, c) = (signed(3), signed(5));
    let a = signed(99).abs();
    // Rounded first, so that both sides get the same.
    let [a, b, c] = [a, b, c].map(|x| f64::from(x as f32));
    [a, b, f64::from((b * b - a * c) as f32), c]
}

#[test]
fn roots_agree() {
    let mut random = Random::new("roots");
    let quadratics: Vec<[f64; 4]> = (0..CASES).map(|i| coefficients(&mut random, i)).collect();
    let owns: Vec<bool> = (0..CASES).map(|i| i % 3 == 0).collect();
    let probe = probe(&["interior"]);
    let row = |q: [f64; 4]| q.map(|x| x as f32);
    let run = |function: &str,
               order: fn([f64; 4]) -> [f64; 4],
               twin: &dyn Fn(&Quadratic, bool) -> f64| {
        let inputs: Vec<[[u32; 4]; 2]> = quadratics
            .iter()
            .zip(&owns)
            .map(|(q, own)| [row(order(*q)).map(f32::to_bits), [u32::from(*own), 0, 0, 0]])
            .collect();
        let outputs: Vec<Row> = probe.call(function, &inputs).expect("the probe runs");
        let mut agreement = Agreement::default();
        for ((q, own), t) in quadratics.iter().zip(&owns).zip(&outputs) {
            let [a, b, square, c] = *q;
            let expected = twin(&Quadratic { a, b, square, c }, *own);
            // Both at no hit, or a number with its relative error; subnormals may be flushed.
            let tolerance = ROOT * expected.abs() + 1.2e-38;
            let error = (f64::from(t[0]) - expected).abs();
            agreement.add(error, tolerance, || {
                format!("{q:?}, own {own}: {} for {expected}", t[0])
            });
        }
        agreement
    };
    let outside = |q: &Quadratic, own: bool| root_outside(q, own).unwrap_or(NO_HIT);
    let order = |[_, b, square, c]: [f64; 4]| [b, square, c, 0.0];
    run("root_outside", order, &outside).assert_holds(CASES);
    run("root_interior", |q| q, &root_interior).assert_holds(CASES);
    // The far root instead of the near one.
    let far = |q: &Quadratic, _: bool| (q.b + q.square.max(0.0).sqrt()) / q.a;
    run("root_outside", order, &far).assert_fails();
    run("root_interior", |q| q, &|q, own| {
        1.000_01 * root_interior(q, own)
    })
    .assert_fails();
}

#[test]
fn the_side_decides_the_root() {
    // From outside: b = 2, c = 3, a = 1: roots 1 and 3. From inside: c = -3, b = 1: root 3.
    let (outside, inside) = ([1.0f32, 2.0, 1.0, 3.0], [1.0f32, 1.0, 4.0, -3.0]);
    let bits = |q: [f32; 4]| q.map(f32::to_bits);
    let none = 3.0e38;
    // Coefficients; inside, own; t. What is known of the side decides, not the sign of c.
    let cases = [
        (outside, [0, 0], 1.0),
        (outside, [0, 1], none),
        (inside, [1, 0], 3.0),
        // From its own surface: the chord 2 b/a.
        (outside, [1, 1], 4.0),
        // c = 3 at a path that is inside, c = -3 at one that is outside: rounding, taken as 0.
        ([1.0, -2.0, 1.0, 3.0], [1, 0], 0.0),
        (inside, [0, 0], 0.0),
        (inside, [0, 1], none),
    ];
    let inputs: Vec<[[u32; 4]; 2]> = cases
        .iter()
        .map(|(q, [inside, own], _)| [bits(*q), [*inside, *own, 0, 0]])
        .collect();
    let outputs: Vec<Row> = probe(&["interior"])
        .call("root_from", &inputs)
        .expect("the probe runs");
    for (case, output) in cases.iter().zip(&outputs) {
        assert!(
            (output[0] - case.2).abs() <= 8.0 * f32::EPSILON * case.2,
            "{case:?}: {}",
            output[0]
        );
    }
}

/// Rays about poles of large spheres: x and curvature, direction, normal at the pole.
fn pole_rays(random: &mut Random) -> [Row; 3] {
    let radius = 10f64.powf(random.range(2.0, 8.0));
    let n = random.direction();
    let inside = random.unit() < 0.3;
    // From a height of about one, up to some tens away from the pole.
    let across = n.any_orthonormal_vector();
    let height = 10f64.powf(random.range(-2.0, 1.0)) * if inside { -1.0 } else { 1.0 };
    let x = height * n + random.range(-30.0, 30.0) * across;
    // Towards the surface at most angles.
    let d = random.direction();
    let d = if d.dot(n) * height > 0.0 { -d } else { d };
    [to_row(x, 1.0 / radius), to_row(d, 0.0), to_row(n, 0.0)]
}

#[test]
fn pole_quadratic_agrees() {
    let mut random = Random::new("pole");
    let inputs: Vec<[Row; 3]> = (0..CASES).map(|_| pole_rays(&mut random)).collect();
    let outputs: Vec<[Row; 3]> = probe(&["interior", "pole"])
        .call("pole_quadratic", &inputs)
        .expect("the probe runs");
    let run = |factor: f64| {
        let [mut members, mut roots, mut steep] = [(); 3].map(|()| Agreement::default());
        for ([x, d, n], [q, outside, inside]) in inputs.iter().zip(&outputs) {
            let k = factor * f64::from(x[3]);
            let (x, d, n) = (vector(*x), vector(*d), vector(*n));
            let twin = pole_quadratic(x, d, n, k);
            let (size, length) = (x.length(), d.length());
            let b_error = ULP * (5.0 * k * size * length + 3.0 * length + twin.b.abs());
            // k, x.x 3 and a product; n.x 3, both in one sum.
            let c_error = ULP * (5.0 * k * size * size + 6.0 * size + twin.c.abs());
            let a_error = 4.0 * ULP * twin.a;
            let (bb, ac) = (twin.b * twin.b, (twin.a * twin.c).abs());
            let square_error = 2.0 * twin.b.abs() * b_error
                + b_error * b_error
                + twin.a * c_error
                + twin.c.abs() * a_error
                + 2.0 * ULP * (bb + ac);
            let q = double(*q);
            let pairs = [
                (q[0], twin.a, a_error),
                (q[1], twin.b, b_error),
                (q[2], twin.square, square_error),
                (q[3], twin.c, c_error),
            ];
            for (i, (value, expected, bound)) in pairs.into_iter().enumerate() {
                let place = || format!("member {i}, x = {x}, d = {d}, n = {n}, k = {k}");
                members.add((value - expected).abs(), bound, place);
            }
            let s = twin.square.max(0.0).sqrt();
            let (t, expected) = if twin.c < 0.0 {
                (f64::from(inside[0]), root_interior(&twin, false))
            } else {
                let Some(expected) = root_outside(&twin, false) else {
                    continue;
                };
                (f64::from(outside[0]), expected)
            };
            if twin.square < 4.0 * square_error || twin.c.abs() < 16.0 * c_error {
                continue;
            }
            let place = || format!("x = {x}, d = {d}, n = {n}, k = {k}: {t} for {expected}");
            let error = (t / expected - 1.0).abs();
            // dt/t = -db/s, dt/t = dc/c - a dc/(2 s (|b| + s)), and the root's own roundings; twice,
            // for what is of second order.
            let q = twin.b.abs() + s;
            let slope =
                (twin.a * c_error + twin.c.abs() * a_error + 2.0 * ULP * (bb + ac)) / (2.0 * s * q);
            let bound = b_error / s + c_error / twin.c.abs() + slope + ROOT;
            roots.add(error, 2.0 * bound, place);
            // numerics.md, case 3. That bound holds for steep rays: for others the rounding of n.d
            // counts, as does that of the direction itself.
            if n.dot(d).abs() > 0.1 {
                steep.add(
                    error,
                    1.0e-6 * (1.0 + twin.b.abs() / s) + c_error / twin.c.abs(),
                    place,
                );
            }
        }
        (members, roots, steep)
    };
    let (members, roots, steep) = run(1.0);
    members.assert_holds(4 * CASES);
    roots.assert_holds(CASES / 2);
    steep.assert_holds(CASES / 2);
    let (members, ..) = run(1.001);
    assert!(members.any_fails(), "a wrong curvature is not found");
}

/// A sphere about its centre or about its pole.
fn placed(anchor: Row, radius: f64, pole: Option<DVec3>) -> PlacedSphere {
    PlacedSphere {
        source: 0,
        material: 0,
        anchor: vector(anchor),
        motion: DVec3::ZERO,
        radius,
        pole,
        side: Side::Tracked,
        level: 0,
        container: None,
        cores: Vec::new(),
    }
}

#[test]
fn vertex_at_agrees() {
    let mut random = Random::new("vertex");
    let mut cases = Vec::new();
    for i in 0..CASES {
        let pole = (i % 2 == 0).then(|| to_row(random.direction(), 0.0));
        let radius = f64::from(10f64.powf(if pole.is_some() {
            3.0
        } else {
            random.range(-3.0, 1.0)
        }) as f32);
        let anchor = to_row(random.direction() * random.range(0.0, 4.0), 0.0);
        // A point of the surface, near the pole if there is one, hit from some way off.
        let x = match pole {
            Some(n) => random.range(0.0, 4.0) * vector(n).any_orthonormal_vector(),
            None => radius * random.direction(),
        };
        let d = random.direction();
        let t = 10f64.powf(random.range(-3.0, 1.0)) as f32;
        let start = to_row(random.direction(), 0.0);
        let offset = vector(anchor) + x - f64::from(t) * d - vector(start);
        let inside = i % 3 == 0;
        let (d, offset) = (
            to_row(d, 1.0 / radius),
            to_row(offset, f64::from(u8::from(inside))),
        );
        let frame_radius = if pole.is_some() { 0.0 } else { radius as f32 };
        let start = [start[0], start[1], start[2], t];
        let anchor = [anchor[0], anchor[1], anchor[2], frame_radius];
        cases.push((
            [start, offset, d, anchor, pole.unwrap_or_default()],
            radius,
            pole,
            inside,
        ));
    }
    let inputs: Vec<[Row; 5]> = cases.iter().map(|c| c.0).collect();
    let outputs: Vec<[Row; 2]> = probe(&["interior", "pole"])
        .call("vertex_at", &inputs)
        .expect("the probe runs");
    let run = |shift: f64| {
        let mut agreement = Agreement::default();
        for ((rows, radius, pole, inside), [offset, normal]) in cases.iter().zip(&outputs) {
            let [start, from, d, anchor, _] = *rows;
            let t = f64::from(start[3]) + shift;
            let ray = Ray {
                anchor: vector(start),
                motion: DVec3::ZERO,
                time: 0.0,
                offset: vector(from),
                direction: vector(d),
                own: None,
                inward: false,
                media: Vec::new(),
            };
            let sphere = placed(anchor, *radius, pole.map(vector));
            let twin = vertex_at(
                &ray,
                &Hit {
                    t,
                    index: 0,
                    inside: *inside,
                },
                &sphere,
            );
            // The difference of the anchors, two sums and the product, in the size of each.
            let apart = (ray.anchor - sphere.anchor).length();
            let x_error =
                ULP * (2.0 * apart + 2.0 * ray.offset.length() + 3.0 * t.abs() + radius.min(8.0));
            // The curvature 1, the product 1, the sum 1, 3.5 to normalise.
            let turn = x_error / radius + 7.0 * ULP;
            let place = || format!("{rows:?}: {offset:?}, {normal:?} for {twin:?}");
            agreement.add((vector(*normal) - twin.normal).length(), turn, place);
            let bound = if pole.is_some() {
                x_error
            } else {
                radius * (turn + ULP)
            };
            agreement.add((vector(*offset) - twin.offset).length(), bound, place);
        }
        agreement
    };
    run(0.0).assert_holds(2 * CASES);
    run(1.0e-2).assert_fails();
}

#[test]
fn nested_media_agree() {
    // Four concentric shells: four levels.
    let mut text = String::from(EMPTY) + "[material.g]\ntype = \"dielectric\"\nior = 1.5\n";
    for radius in [1.0, 0.8, 0.6, 0.4] {
        text += &format!("[[sphere]]\ncenter = [0, 0, 0]\nradius = {radius}\nmaterial = \"g\"\n");
    }
    let scene = scene(&text);
    assert_eq!(Placement::new(&scene, 16, 16).media.levels, 4);
    let probe = probe_of(&scene, &["baked", "dielectric", "interior", "priority"]);
    let ior = [1.25f32, 1.5, 1.75, 2.5];
    let mut cases = Vec::new();
    for set in 0..16u32 {
        for level in 0..4 {
            // A path that arrives from inside is in the set, one from outside is not.
            cases.push((set, level, set >> level & 1 == 1));
        }
    }
    let inputs: Vec<[[u32; 4]; 2]> = cases
        .iter()
        .map(|&(set, level, inside)| {
            [
                [set, level, u32::from(inside), ior[level as usize].to_bits()],
                ior.map(f32::to_bits),
            ]
        })
        .collect();
    let outputs: Vec<[[u32; 4]; 4]> = probe
        .call("relative_index", &inputs)
        .expect("the probe runs");
    for ((set, level, inside), [eta, after, levels, spheres]) in cases.into_iter().zip(outputs) {
        let own = f64::from(ior[level as usize]);
        let medium = |level: u32| Medium {
            level,
            ior: f64::from(ior[level as usize]),
            sphere: 7,
        };
        let mut media: Vec<Medium> = (0..4).filter(|l| set >> l & 1 == 1).map(medium).collect();
        let twin = relative_index(&media, level, own, inside);
        let eta = f64::from(f32::from_bits(eta[0]));
        assert!(
            (eta / twin - 1.0).abs() <= 2.5 * ULP,
            "{set:04b} {level}: {eta} for {twin}"
        );
        cross_surface(&mut media, medium(level), inside);
        let expected: u32 = media.iter().map(|m| 1 << m.level).sum();
        assert_eq!(after[0], expected, "{set:04b} {level}");
        assert_eq!(
            spheres[level as usize],
            if inside { u32::MAX } else { 7 },
            "{set:04b} {level}"
        );
        for m in media {
            assert_eq!(
                f64::from(f32::from_bits(levels[m.level as usize])),
                m.ior,
                "{set:04b} {level}"
            );
        }
    }
}

#[test]
fn camera_rays_agree() {
    for (lens, effects) in [
        ("", &[][..]),
        ("aperture_radius = 0.3\nfocus_distance = 3.0\n", &["lens"]),
    ] {
        let text = format!(
            "[camera]\nposition = [1.0, 2.0, 3.0]\nlook_at = [0.3, 0.2, -5.0]\nfov = 55.0\n{lens}\
             [image]\nwidth = 640\nheight = 480\n[material.m]\ntype = \"mirror\"\n\
             reflectance = [1, 1, 1]\n[[sphere]]\ncenter = [0.3, 0.2, -5.0]\nradius = 1.0\n\
             material = \"m\"\n"
        );
        let scene = scene(&text);
        let camera = Placement::new(&scene, 640, 480).camera;
        assert!(camera.approach > 0.0);
        let mut random = Random::new("camera");
        let inputs: Vec<[[u32; 4]; 2]> = (0..CASES)
            .map(|_| {
                let [x, y, ..] = random.words();
                [[x % 640, y % 480, 0, 0], random.unit4().map(f32::to_bits)]
            })
            .collect();
        let outputs: Vec<[Row; 3]> = probe_of(&scene, effects)
            .call("camera_ray", &inputs)
            .expect("the probe runs");
        // The film's corner and steps are rounded (1 each), the place 1, products and sums 3: in
        // the size of all that is added. The lens: the root 4.5, the circle, products and sums 6.
        let film =
            camera.corner.length() + 640.0 * camera.across.length() + 480.0 * camera.down.length();
        let film_error = 6.0 * ULP * film;
        let lens_error = 18.0 * ULP * camera.lens_across.length();
        let offset = camera.approach * (film_error + ULP * film) + 2.0 * lens_error;
        let direction = film_error + camera.focus * 2.0 * lens_error + 7.0 * ULP;
        let run = |shift: f64| {
            let mut agreement = Agreement::default();
            for ([pixel, u], [anchor, start, d]) in inputs.iter().zip(&outputs) {
                let u = u.map(|x| f64::from(f32::from_bits(x)));
                let twin = camera_ray(
                    &camera,
                    [pixel[0], pixel[1]],
                    [u[0] + shift, u[1], u[2], u[3]],
                    &Vec::new(),
                );
                let place = || format!("pixel {pixel:?}, u = {u:?}: {start:?}, {d:?} for {twin:?}");
                assert_eq!(vector(*anchor), twin.anchor);
                agreement.add((vector(*start) - twin.offset).length(), offset, place);
                agreement.add((vector(*d) - twin.direction).length(), direction, place);
            }
            agreement
        };
        run(0.0).assert_holds(2 * CASES);
        run(0.1).assert_fails();
    }
}

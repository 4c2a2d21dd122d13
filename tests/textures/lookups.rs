//! Values of textures at points.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::DVec3;
use gpu_trace::effects::Effects;
use gpu_trace::gpu::probe::Probe;
use gpu_trace::image::Picture;
use gpu_trace::materials::lattice::LatticePoint;
use gpu_trace::materials::{Material, Texture, TextureImage};
use gpu_trace::placement::Placement;
use gpu_trace::records::textures::TextureTable;
use gpu_trace::reference::scene::texture::{
    TexturePoint, gradient_noise, image_place, image_value, noise, texture_value,
};
use gpu_trace::scene::Scene;
use gpu_trace::settings::Settings;
use gpu_trace::verify::{Agreement, Random, ULP, to_row, vector};

use super::{albedo, image, random_picture};
use crate::common::{gpu, probe, scene};

/// A question to the device: offset, number; normal.
type Input = [[u32; 4]; 2];

/// A ball of each texture, and with `wall` a ground of radius 10^6 of each, which is about its pole.
fn scene_of(textures: &[Texture], wall: bool) -> Scene {
    let mut scene = scene(
        "[camera]\nposition = [0, 1, 6]\nlook_at = [0, 0, 0]\nfov = 40.0\n[image]\nwidth = 16\nheight = 16\n\
         [material.m]\ntype = \"diffuse\"\nalbedo = [1, 1, 1]\n[[sphere]]\ncenter = [0, 0, 0]\nradius = 0.5\n\
         material = \"m\"\n",
    );
    let kind = scene.materials[0].kind.clone();
    let ball = scene.spheres[0];
    for (i, texture) in textures.iter().enumerate() {
        let material = Material::new(&format!("t{i}"), kind.clone());
        scene
            .materials
            .push(material.with_texture(albedo(), texture.clone()));
        let mut sphere = ball;
        sphere.material = i + 1;
        sphere.center.x = 2.0 * (i + 1) as f64;
        scene.spheres.push(sphere);
        if wall {
            sphere.center = DVec3::new(0.3, -1.0e6 - 1.0 - i as f64, -0.2);
            sphere.radius = 1.0e6;
            scene.spheres.push(sphere);
        }
    }
    scene
}

/// The scene's probe, and the numbers of the textures of its spheres, by sphere of the placement.
fn probe_of(scene: &Scene) -> (Probe, Placement, Vec<Option<u32>>) {
    let settings = Settings::for_scene(scene);
    let placement = Placement::new(scene, settings.width, settings.height);
    let effects = Effects::derive(scene, &placement, &settings);
    let table = TextureTable::new(scene, &placement);
    let numbers = (0..placement.spheres.len()).map(|i| {
        let all = table.of_sphere(i, &placement);
        all.first().map(|(_, number)| *number)
    });
    let numbers = numbers.collect();
    let probe = Probe::new(&gpu(), scene, &placement, &effects);
    (probe, placement, numbers)
}

fn ask(probe: &Probe, inputs: &[Input]) -> Vec<[f32; 4]> {
    let outputs = probe.call("texture_value", inputs);
    outputs.unwrap_or_else(|e| panic!("{e}"))
}

fn input(offset: DVec3, number: u32, normal: DVec3) -> Input {
    let [x, y, z] = offset.as_vec3().to_array().map(f32::to_bits);
    [[x, y, z, number], to_row(normal, 0.0).map(f32::to_bits)]
}

const A: DVec3 = DVec3::new(0.9, 0.1, 0.5);
const B: DVec3 = DVec3::new(0.2, 0.8, 0.5);

fn checker(size: f64) -> Texture {
    let values = [A, B];
    Texture::Checker { values, size }
}

fn noise_of(size: f64, octaves: u32) -> Texture {
    Texture::Noise {
        values: [A, B],
        size,
        octaves,
    }
}

#[test]
fn a_checker_is_as_defined() {
    let mut random = Random::new("checkers");
    let normal = DVec3::Y;
    for size in [0.5, 0.3, 7.0] {
        for scale in [1.0, 1.0e3, 1.0e6] {
            for _ in 0..2000 {
                let offset = scale * random.direction();
                // From the definition, without what rounds otherwise.
                let cells = (offset / size).to_array();
                if cells.iter().any(|x| (x - x.round()).abs() < 1.0e-6) {
                    continue;
                }
                let sum: i64 = cells.iter().map(|x| x.floor() as i64).sum();
                let wanted = if sum.rem_euclid(2) == 0 { A } else { B };
                let point = TexturePoint { offset, normal };
                assert_eq!(texture_value(&checker(size), &point), wanted);
            }
        }
    }
    // By hand: around the centre; on the planes the cell is the one beyond.
    let at = |x: f64, y: f64, z: f64| {
        let offset = DVec3::new(x, y, z);
        texture_value(&checker(0.5), &TexturePoint { offset, normal })
    };
    assert_eq!(at(0.1, 0.1, 0.1), A);
    assert_eq!(at(-0.1, 0.1, 0.1), B);
    assert_eq!(at(-0.1, -0.1, 0.1), A);
    assert_eq!(at(-0.1, -0.1, -0.1), B);
    assert_eq!(at(0.5, 0.1, 0.1), B);
    assert_eq!(at(0.6, 0.6, 0.1), A);
    assert_eq!(at(0.0, 0.0, 0.0), A);
}

#[test]
fn noise_is_within_its_bounds() {
    let mut random = Random::new("noise");
    let mut largest = 0.0f64;
    for _ in 0..400_000 {
        let [x, y, z, _] = random.words();
        let place = DVec3::new(random.unit(), random.unit(), random.unit());
        largest = largest.max(gradient_noise([x, y, z], place).abs());
    }
    eprintln!("the largest noise of 400000 is {largest}");
    assert!(largest <= 1.0);
    assert!(largest > 0.6, "{largest}");
    // At corners it is 0; across borders of cells it is continuous, as of one function of space.
    let mut worst = 0.0f64;
    for _ in 0..20_000 {
        let [x, y, z, _] = random.words();
        let corner = DVec3::new(
            random.unit().round(),
            random.unit().round(),
            random.unit().round(),
        );
        assert!(gradient_noise([x, y, z], corner).abs() < 1.0e-12);
        let face = DVec3::new(1.0, random.unit(), random.unit());
        let next = gradient_noise([x.wrapping_add(1), y, z], face.with_x(0.0));
        worst = worst.max((gradient_noise([x, y, z], face) - next).abs());
    }
    assert!(worst < 1.0e-12, "{worst}");
    // Companion: not of the next cell but one.
    let face = DVec3::new(1.0, 0.3, 0.4);
    assert!(
        (gradient_noise([1, 2, 3], face) - gradient_noise([3, 2, 3], face.with_x(0.0))).abs()
            > 1.0e-3
    );
    // The share of the second value is in [0, 1], and its mean 1/2.
    let (mut sum, mut squares) = (0.0, 0.0);
    const POINTS: u32 = 100_000;
    for i in 0..POINTS {
        let mut along = || random.range(-1.0e4, 1.0e4);
        let point = LatticePoint::of(DVec3::new(along(), along(), along()), 1.0);
        let t = noise(&point, 1 + i % 5);
        assert!((0.0..=1.0).contains(&t));
        sum += t - 0.5;
        squares += (t - 0.5) * (t - 0.5);
    }
    let z = sum / squares.sqrt();
    assert!(z.abs() < 3.9, "{z}");
    let shifted = (sum + 0.01 * f64::from(POINTS)) / squares.sqrt();
    assert!(shifted > 3.9, "companion");
}

#[test]
fn gradients_are_those_of_the_device() {
    let mut random = Random::new("gradients");
    let inputs: Vec<Input> = (0..50_000)
        .map(|i| {
            let mut cell = random.words();
            if i % 3 == 0 {
                // Next to the origin, and across the end of the words.
                cell = cell.map(|x| (x % 4).wrapping_sub(2));
            }
            let mut along = || match i % 5 {
                0 => random.unit().round() as f32,
                _ => random.unit() as f32,
            };
            let place = [along(), along(), along()].map(f32::to_bits);
            [
                [place[0], place[1], place[2], cell[0]],
                [cell[1], cell[2], 0, 0],
            ]
        })
        .collect();
    let outputs: Vec<[f32; 4]> = probe(&["texture_noise", "textured_albedo", "diffuse"])
        .call("gradient_noise", &inputs)
        .unwrap_or_else(|e| panic!("{e}"));
    let holds = |next: u32| {
        let mut agreement = Agreement::default();
        for ([place, cell], found) in inputs.iter().zip(&outputs) {
            let at = DVec3::from([0, 1, 2].map(|k| f64::from(f32::from_bits(place[k]))));
            let truth = gradient_noise([place[3], cell[0], cell[1].wrapping_add(next)], at);
            // Of weights, whose sums have terms up to 15, steep by up to 1.9, and of three interpolations.
            agreement.add((f64::from(found[0]) - truth).abs(), 48.0 * ULP, || {
                format!("{place:?} {cell:?}: {found:?} for {truth}")
            });
        }
        agreement
    };
    holds(0).assert_holds(50_000);
    // Companion: another cell.
    assert!(holds(1).measure().failures() > 25_000);
}

#[test]
fn noises_agree() {
    let parameters = [(0.5, 1), (0.3, 4), (2.0, 16)];
    let textures = parameters.map(|(size, octaves)| noise_of(size, octaves));
    for wall in [false, true] {
        let scene = scene_of(&textures, wall);
        let (probe, placement, numbers) = probe_of(&scene);
        let mut random = Random::new("noises on the device");
        let mut inputs = Vec::new();
        let mut asked = Vec::new();
        for (i, sphere) in placement.spheres.iter().enumerate() {
            let Some(number) = numbers[i] else {
                continue;
            };
            let anchor = sphere.anchor_offset(placement.scale);
            for _ in 0..10_000 {
                let near = random.range(0.0, 4.0) * random.direction();
                let near = near.as_vec3().as_dvec3();
                inputs.push(input(near, number, DVec3::Y));
                asked.push((sphere.material - 1, anchor, near));
            }
        }
        let outputs = ask(&probe, &inputs);
        let holds = |larger: f64| {
            let mut agreement = Agreement::default();
            for ((which, anchor, near), found) in asked.iter().zip(&outputs) {
                let (size, octaves) = parameters[*which];
                let offset = *anchor + *near;
                let normal = DVec3::Y;
                let texture = noise_of(larger * size, octaves);
                let truth = texture_value(&texture, &TexturePoint { offset, normal });
                // A noise is at most so steep: sqrt(2/3) times a gradient of sqrt(2), and the change of weights, by
                // 15/8 along each axis, of slopes up to sqrt(2) times a diagonal. Each octave is twice as steep and
                // half as strong.
                let steep = (2.0f64 / 3.0).sqrt()
                    * (2f64.sqrt() + 3f64.sqrt() * 15.0 / 8.0 * 2.0 * 6f64.sqrt());
                let off = 4.0 * ULP * (near.abs().max_element() / size + 1.0);
                let total = 2.0 - 0.5f64.powi(octaves as i32 - 1);
                let share = 0.5 * steep * off * 3f64.sqrt() * f64::from(octaves) / total;
                let allowed = share + 64.0 * ULP;
                let error = (vector(*found) - truth).abs().max_element();
                agreement.add(error, allowed, || {
                    format!("{near:?} {which}: {found:?} for {truth}")
                });
            }
            agreement
        };
        holds(1.0).assert_holds(30_000);
        // Companion: cells that are 1 % larger.
        assert!(holds(1.01).measure().failures() > 10_000);
    }
}

/// The centre of a place of the image about +y, by the definition.
fn direction_of(u: f64, v: f64) -> DVec3 {
    let ((sin, cos), (across, ahead)) = ((PI * v).sin_cos(), (2.0 * PI * u).sin_cos());
    DVec3::new(sin * across, cos, -sin * ahead)
}

fn look(texture: &Texture, normal: DVec3) -> DVec3 {
    let offset = DVec3::ZERO;
    texture_value(texture, &TexturePoint { offset, normal })
}

fn near(a: DVec3, b: DVec3) -> bool {
    (a - b).abs().max_element() < 1.0e-12
}

#[test]
fn images_are_as_defined() {
    // By hand: -z is at U = 0, +x at a quarter, +z at a half; +y at V = 0.
    let picture = random_picture(8, 4, "by hand");
    let at =
        |column: usize, row: usize| DVec3::from(picture.pixels[8 * row + column].map(f64::from));
    let plain = image(picture.clone(), DVec3::Y);
    for (column, row) in [(0, 0), (7, 0), (3, 1), (7, 3), (5, 2)] {
        let place = [(column as f64 + 0.5) / 8.0, (row as f64 + 0.5) / 4.0];
        let found = look(&plain, direction_of(place[0], place[1]));
        assert!(near(found, at(column, row)), "{column}, {row}: {found}");
    }
    let four = |a: DVec3, b: DVec3, c: DVec3, d: DVec3| 0.25 * (a + b + c + d);
    let across = four(at(1, 1), at(2, 1), at(1, 2), at(2, 2));
    let seam = four(at(7, 1), at(0, 1), at(7, 2), at(0, 2));
    let half = four(at(3, 1), at(4, 1), at(3, 2), at(4, 2));
    assert!(near(look(&plain, DVec3::X), across));
    assert!(near(look(&plain, DVec3::NEG_Z), seam));
    assert!(near(look(&plain, DVec3::Z), half));
    assert!(!near(seam, across));
    // Beyond the first row's centres nothing but that row.
    assert!(near(look(&plain, direction_of(0.5 / 8.0, 0.01)), at(0, 0)));
    assert!(near(look(&plain, direction_of(0.5 / 8.0, 0.99)), at(0, 3)));
    // Of -y half a turn about +x: +x stays, and -z is where +z was.
    let below = image(picture.clone(), DVec3::NEG_Y);
    assert!(near(look(&below, DVec3::X), across));
    assert!(near(look(&below, DVec3::Z), seam));
    assert!(near(look(&below, DVec3::NEG_Z), half));
    // Of +x by the shortest way: about +z, which stays, and +y goes to -x.
    let aside = image(picture.clone(), DVec3::new(3.0, 0.0, 0.0));
    assert!(near(look(&aside, DVec3::Z), half));
    assert!(near(look(&aside, DVec3::NEG_Y), across));
    // A number reads the red channel.
    let number = TextureImage::new("x", Arc::new(picture.clone()), true, DVec3::Y);
    assert!(near(
        look(&Texture::Image(number), DVec3::X),
        DVec3::splat(across.x)
    ));
}

#[test]
fn axes_turn_the_shortest_way() {
    let mut random = Random::new("axes");
    let picture = Arc::new(random_picture(2, 1, "axes"));
    let near_below = |x: f64| DVec3::new(x, -1.0, 0.5 * x);
    let mut axes = vec![
        DVec3::Y,
        DVec3::X,
        near_below(1.0e-4),
        near_below(1.0e-9),
        near_below(1.0e-160),
    ];
    axes.extend((0..200).map(|_| 3.0 * random.direction()));
    for axis in axes {
        let turn = TextureImage::new("x", Arc::clone(&picture), false, axis).rotation();
        let unit = axis.normalize();
        let close = |a: DVec3, b: DVec3| (a - b).length() < 1.0e-12;
        assert!(close(turn * unit, DVec3::Y), "{axis}: {turn}");
        assert!((turn.determinant() - 1.0).abs() < 1.0e-12, "{axis}");
        // What is across both stays: so the turn is about that, and by the angle between them.
        if let Some(across) = unit.cross(DVec3::Y).try_normalize() {
            assert!(close(turn * across, across), "{axis}: {turn}");
            // Companion: another turn that takes the axis there.
            let other = glam::DMat3::from_rotation_y(0.1) * turn;
            assert!(close(other * unit, DVec3::Y) && !close(other * across, across));
        }
    }
    let half = TextureImage::new("x", picture, false, DVec3::NEG_Y).rotation();
    assert_eq!(
        half,
        glam::DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0))
    );
}

#[test]
fn image_lookups_agree() {
    let sizes = [[1, 1], [1, 7], [9, 1], [64, 32], [37, 19], [512, 256]];
    let axes = [DVec3::Y, DVec3::NEG_Y, DVec3::new(1.0, 2.0, -2.0)];
    let mut textures = Vec::new();
    for [width, height] in sizes {
        let picture = random_picture(width, height, "lookups");
        textures.extend(axes.map(|axis| image(picture.clone(), axis)));
    }
    let scene = scene_of(&textures, false);
    let (probe, placement, numbers) = probe_of(&scene);
    let mut random = Random::new("lookups");
    let mut normals: Vec<DVec3> = DVec3::AXES
        .into_iter()
        .flat_map(|axis| [axis, -axis])
        .collect();
    for i in normals.len()..10_000 {
        let special = normals[i % 6];
        normals.push(match i % 3 {
            0 => (special + random.magnitude(-9.0, -1.0) * random.direction()).normalize(),
            _ => random.direction(),
        });
    }
    let mut inputs = Vec::new();
    let mut asked = Vec::new();
    for (i, sphere) in placement.spheres.iter().enumerate() {
        let Some(number) = numbers[i] else {
            continue;
        };
        for normal in &normals {
            let normal = normal.as_vec3().as_dvec3();
            inputs.push(input(DVec3::ZERO, number, normal));
            asked.push((sphere.material - 1, normal));
        }
    }
    let outputs = ask(&probe, &inputs);
    let holds = |turn: f64| {
        let mut agreement = Agreement::default();
        for ((which, normal), found) in asked.iter().zip(&outputs) {
            let Texture::Image(image) = &textures[*which] else {
                panic!("it is an image");
            };
            let w = image.rotation() * *normal;
            let sine = w.x.hypot(w.z);
            // Next to the axis the azimuth is what rounding makes of it.
            if sine < 1.0e-3 {
                continue;
            }
            let mut place = image_place(image, *normal);
            let size = glam::DVec2::new(image.image().width.into(), image.image().height.into());
            place.x += turn * size.x;
            place.x -= size.x * (place.x / size.x).floor();
            let truth = image_value(image, place);
            // Turns as those of environments, with three roundings of each product of the rotation.
            let turns = glam::DVec2::new(6.0 + 2.0 / sine, 10.0) * ULP;
            let steep = size * turns;
            let allowed = steep.x + steep.y + 8.0 * ULP + 2.0 * ULP * size.max_element();
            let error = (vector(*found) - truth).abs().max_element();
            agreement.add(error, allowed, || {
                format!("{which} {normal}: {found:?} for {truth}")
            });
        }
        agreement
    };
    holds(0.0).assert_holds(100_000);
    // Companion: turned by a thousandth of a turn.
    assert!(holds(1.0e-3).measure().failures() > 50_000);
}

#[test]
fn at_the_axis_the_first_row_is_seen() {
    // A first row of one value: there is no azimuth, and no number that is none.
    let texels = (0..6 * 3).map(|i| match i / 6 {
        0 => [0.25, 0.5, 0.75],
        1 => [0.0; 3],
        _ => [1.0, 0.5, 0.25],
    });
    let picture = Picture::new(6, 3, texels.collect());
    for axis in [DVec3::Y, DVec3::NEG_Y, DVec3::X] {
        let scene = scene_of(&[image(picture.clone(), axis)], false);
        let (probe, placement, numbers) = probe_of(&scene);
        let ball = placement.spheres.iter().position(|s| s.material == 1);
        let number = numbers[ball.expect("a ball")].expect("a texture");
        let inputs = [axis, -axis].map(|normal| input(DVec3::ZERO, number, normal));
        let found = ask(&probe, &inputs);
        assert_eq!(vector(found[0]), DVec3::new(0.25, 0.5, 0.75), "{axis}");
        assert_eq!(vector(found[1]), DVec3::new(1.0, 0.5, 0.25), "{axis}");
    }
}

use gpu_trace::*;
use gpu_trace::render::Renderer as _;
fn main() {
    let arg: Vec<String> = std::env::args().collect();
    let scene = scene::load::load_file(std::path::Path::new(&arg[1])).unwrap().scene;
    let mut settings = settings::Settings::for_scene(&scene);
    settings.samples = 0..arg[2].parse().unwrap();
    if arg.get(3).map(|s| s.as_str()) == Some("list") { settings.geometry = settings::GeometryChoice::List; }
    let placement = placement::Placement::new(&scene, settings.width, settings.height);
    let effects = effects::Effects::derive(&scene, &placement, &settings);
    println!("{:?}", effects.names().collect::<Vec<_>>());
    let t0 = std::time::Instant::now();
    let gpu = gpu::device::open(&Default::default()).unwrap_or_else(|e| panic!("{e}"));
    println!("open {:?}", t0.elapsed());
    let mut r = gpu::renderer::GpuRenderer::new(gpu, &scene, &placement, &effects, &settings).unwrap_or_else(|e| panic!("{e}"));
    std::fs::write("/tmp/k.wgsl", &r.kernel().wgsl).unwrap();
    println!("{:?} setup {:?}", r.device(), t0.elapsed());
    let o = render::render_quietly(&mut r, &settings).unwrap_or_else(|e| panic!("{e}"));
    let n = settings.crop.pixels();
    let mut m = [0.0; 3];
    for i in 0..n { let x = o.film.mean(i); for c in 0..3 { m[c] += x[c] / n as f64; } }
    let paths = n as f64 * o.film.samples() as f64;
    println!("{:?} {:?} {:?} Mpaths/s {:.2} rays/path {:.2} {:?}", o.elapsed, m, o.estimate, paths / o.elapsed.as_secs_f64() / 1e6, o.film.tally().rays as f64 / paths, o.film.tally());
    let px = o.film.pixels();
    let img = image::RgbImage::from_fn(settings.width, settings.height, |x, y| { let p = px[(y * settings.width + x) as usize]; image::Rgb(p.map(|v| (v.max(0.0).min(1.0).powf(1.0/2.2) * 255.0) as u8)) });
    img.save("/tmp/out.png").unwrap();
}

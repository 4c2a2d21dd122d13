//! Large images, whose parts keep to the time and stop between one another.

use super::{FURNACE, cloud};
use crate::common::images::Left;
use crate::common::{gpu_renderer, job, render_gpu, scene};
use gpu_trace::error::Result;
use gpu_trace::film::{PixelSums, Tally, Tiles, Window};
use gpu_trace::gpu::renderer::DispatchLimits;
use gpu_trace::render::{Control, Renderer, Status, StoppedBy, Watch, render, render_quietly};
use gpu_trace::settings::{Rect, Settings};
use gpu_trace::verify::{means, settings};
use std::cell::RefCell;
use std::ops::Range;
use std::time::Duration;

/// Asks to stop after so many paths.
struct Impatient {
    enough: f64,
    paths: u64,
    /// Reports after that.
    late: u32,
}

impl Watch for Impatient {
    fn update(&mut self, status: &Status) {
        self.late += u32::from(self.interrupted());
        self.paths = status.paths;
    }

    fn interrupted(&self) -> bool {
        self.paths as f64 >= self.enough
    }
}

/// Images beyond a region are rendered in parts, window by window: a signal does not wait for the rest of
/// a window, unless there would be no image.
#[test]
fn large_images_stop_between_their_parts() {
    let scene = scene(&cloud(8));
    let settings = settings(&scene, 2100, 8, 256);
    let limits = DispatchLimits {
        tiles: 16,
        samples: 16,
    };
    let renderer = || gpu_renderer(&scene, &settings).with_limits(limits);
    // In the first window, of 16 samples, and in the second, of 48.
    for samples in [0.1, 17.0, 30.0, 60.0] {
        let mut watch = Impatient {
            enough: samples * settings.crop.pixels() as f64,
            paths: 0,
            late: 0,
        };
        let outcome = render(&mut renderer(), &job(&scene, &settings), &mut watch);
        assert_eq!(outcome.stopped_by, StoppedBy::Interrupt);
        let done = outcome.film.samples();
        let first = samples < 16.0;
        assert!(done == 16 || first && (4..16).contains(&done), "{done}");
        assert_eq!(watch.late > 0, first, "{samples}: {} late", watch.late);
        let whole = render_gpu(
            &scene,
            &Settings {
                samples: 0..done,
                ..settings.clone()
            },
        );
        let _left = Left::of(format!("stopped at {done}"), &outcome.film, &whole);
        assert_eq!(means(&outcome.film), means(&whole), "{samples}");
        assert_eq!(outcome.film.tally(), whole.tally(), "{samples}");
    }
}

/// Where one part of a large image goes, the others have to follow: there must be time for that.
#[test]
fn large_images_keep_to_the_time() {
    /// Takes note of what it is asked.
    struct Clock {
        enough: bool,
        asked: RefCell<Vec<Duration>>,
    }
    impl Control for Clock {
        fn proceed(&mut self, _: u64) -> bool {
            true
        }
        fn has_time(&self, rest: Duration) -> bool {
            self.asked.borrow_mut().push(rest);
            self.enough
        }
    }
    let scene = scene(&cloud(8));
    let settings = settings(&scene, 2100, 8, 256);
    let limits = DispatchLimits {
        tiles: 1 << 20,
        samples: 4,
    };
    let mut renderer = gpu_renderer(&scene, &settings).with_limits(limits);
    for (enough, end) in [(false, 4), (true, 16)] {
        let mut clock = Clock {
            enough,
            asked: RefCell::default(),
        };
        let window = renderer.render(0..16, &mut clock).expect("a window");
        assert_eq!(window.samples, 0..end);
        let asked = clock.asked.borrow();
        // Only of the first part, after every slab; the last one may have been all.
        assert_eq!(asked.len() as u64, end / 4);
        assert!(asked.iter().all(|rest| *rest > Duration::ZERO));
        assert!(
            window.pixels.iter().all(|p| p.sum[0] > 0.0),
            "a part is missing"
        );
    }
}

/// A window that came back short for want of time is the last, whatever time is left then: none begins where
/// windows never do.
#[test]
fn a_window_cut_short_is_the_last() {
    struct Short;
    impl Renderer for Short {
        fn device(&self) -> (String, String, String) {
            Default::default()
        }
        fn render_tiles(
            &mut self,
            samples: Range<u64>,
            _: Option<&Tiles>,
            _: &mut dyn Control,
        ) -> Result<Window> {
            // The second window.
            let end = if samples.start == 16 { 24 } else { samples.end };
            Ok(Window {
                image: Vec::new(),
                rect: RECT,
                samples: samples.start..end,
                batch: 4,
                pixels: vec![PixelSums::default(); RECT.pixels()],
                aovs: Vec::new(),
                tally: Tally::default(),
            })
        }
        fn show(&mut self, _: Rect) {}
        fn device_bytes(&self) -> u64 {
            0
        }
    }
    const RECT: Rect = Rect::whole(2, 2);
    let settings = Settings {
        time: Some(Duration::from_secs(3600)),
        ..settings(&scene(FURNACE), 2, 2, 256)
    };
    let outcome = render_quietly(&mut Short, &settings).expect("an image");
    assert_eq!(outcome.stopped_by, StoppedBy::Time);
    assert_eq!(outcome.film.samples(), 24);
}

//! What a study needs from outside: devices, a display, and to be told when to stop.

use super::series::Series;
use crate::error::Result;
use crate::output::Snapshot;
use crate::render::Renderer;
use crate::settings::Settings;

/// A renderer that is ready, and what that took.
pub struct Opened {
    /// The renderer.
    pub renderer: Box<dyn Renderer>,
    /// Seconds of opening the device and placing the scene.
    pub setup: f64,
    /// Seconds of linking and compiling.
    pub compile: f64,
}

/// What a study needs from outside.
pub trait Host {
    /// Makes a renderer, from the device on: its time is part of what is measured.
    ///
    /// # Errors
    /// If the device cannot be had.
    fn open(&mut self, series: &Series, settings: &Settings) -> Result<Opened>;
    /// Another part of the study begins.
    fn begin(&mut self, part: &str);
    /// How far the study is.
    fn progress(&mut self, snapshot: &Snapshot);
    /// Whether a signal asked to stop.
    fn interrupted(&self) -> bool;
}

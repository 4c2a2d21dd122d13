//! Errors of many trials against what they may be.

/// Errors of many trials against a limit.
#[derive(Clone, Debug)]
pub struct Measure {
    trials: u64,
    failures: u64,
    worst: f64,
    limit: f64,
    unit: &'static str,
    place: String,
}

impl Measure {
    /// No trials yet; errors of at most `limit` pass, in `unit`.
    #[must_use]
    pub fn new(limit: f64, unit: &'static str) -> Self {
        Self {
            trials: 0,
            failures: 0,
            worst: 0.0,
            limit,
            unit,
            place: String::new(),
        }
    }

    /// Takes note of a trial; no number is an error without bound. `place` says which it was.
    pub fn add(&mut self, error: f64, place: impl FnOnce() -> String) {
        let error = if error.is_nan() { f64::INFINITY } else { error };
        self.trials += 1;
        self.failures += u64::from(error > self.limit);
        if error > self.worst {
            self.worst = error;
            self.place = place();
        }
    }

    /// Takes note of `failures` of `trials` whose error is a plain yes or no; the limit is to be 0.
    pub fn count(&mut self, trials: u64, failures: u64, place: impl FnOnce() -> String) {
        self.trials += trials;
        self.failures += failures;
        if failures > 0 && self.place.is_empty() {
            self.place = place();
        }
        self.worst = self.worst.max(self.failures as f64);
    }

    /// Whether there were trials and none failed.
    #[must_use]
    pub fn passes(&self) -> bool {
        self.trials > 0 && self.failures == 0
    }

    /// Trials so far.
    #[must_use]
    pub fn trials(&self) -> u64 {
        self.trials
    }

    /// Trials beyond the limit.
    #[must_use]
    pub fn failures(&self) -> u64 {
        self.failures
    }

    /// The largest error.
    #[must_use]
    pub fn worst(&self) -> f64 {
        self.worst
    }

    /// The largest error that passes.
    #[must_use]
    pub fn limit(&self) -> f64 {
        self.limit
    }

    /// What errors are measured in.
    #[must_use]
    pub fn unit(&self) -> &'static str {
        self.unit
    }

    /// Where the largest error is.
    #[must_use]
    pub fn place(&self) -> &str {
        &self.place
    }
}

/// Errors of many cases, each in units of its own tolerance.
#[derive(Clone, Debug)]
pub struct Agreement(Measure);

impl Default for Agreement {
    fn default() -> Self {
        Self(Measure::new(1.0, "of the tolerance"))
    }
}

impl Agreement {
    /// Takes note of a case; no number is an error without bound.
    pub fn add(&mut self, error: f64, tolerance: f64, place: impl FnOnce() -> String) {
        self.0.add(error / tolerance, || {
            format!("error {error:e}, tolerance {tolerance:e}: {}", place())
        });
    }

    /// Fails unless all of at least `least` cases are within their tolerances.
    ///
    /// # Panics
    /// If not.
    pub fn assert_holds(&self, least: usize) {
        let Measure {
            trials,
            failures,
            worst,
            place,
            ..
        } = &self.0;
        assert!(*trials >= least as u64, "{trials} cases, {least} wanted");
        assert!(
            *failures == 0,
            "{failures} of {trials} cases are off, by up to {worst} times the tolerance; {place}"
        );
        eprintln!("{trials} cases, worst {worst:.3} of the tolerance");
    }

    /// For companions: whether any case is off.
    #[must_use]
    pub fn any_fails(&self) -> bool {
        self.0.failures > 0
    }

    /// For companions: fails unless at least half of the cases are off.
    ///
    /// # Panics
    /// If not.
    pub fn assert_fails(&self) {
        let Measure {
            trials, failures, ..
        } = &self.0;
        assert!(
            *trials > 0 && 2 * failures >= *trials,
            "only {failures} of {trials} cases are off"
        );
    }

    /// The errors, in units of the tolerances.
    #[must_use]
    pub fn measure(&self) -> &Measure {
        &self.0
    }
}

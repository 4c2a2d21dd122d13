//! Cells of diffuse spheres, for which the radiance cache has values: which there are, and how many samples of each a
//! pilot takes. All of it follows from the scene and the size of the whole image, so that no cut of a render changes it.
//!
//! Which cells paths come to is found by [a survey](crate::reference::survey); what is done with their values is in
//! [`reference/cells`](crate::reference::cells) and `shaders/cache/`.

pub mod chart;

pub use chart::Chart;

/// Most cells that have values: 16 bytes each for every batch of a window.
pub const MOST_CELLS: usize = 1 << 14;
/// The samples of a cell that a pilot takes: a power of two.
const SAMPLES: std::ops::RangeInclusive<u32> = 8..=32;
/// The share of an image's paths that pilots may add.
const SHARE: f64 = 0.1;
/// The samples of the shortest batch.
const SHORTEST: u64 = 4;

/// One cell of a chart.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Cell {
    /// Index into the placement's spheres.
    pub sphere: u16,
    /// From 0 on.
    pub row: u8,
    /// From 0 on.
    pub column: u8,
}

/// The charts of a placement's spheres and those of their cells that have values.
#[derive(Clone, Debug, PartialEq)]
pub struct Cells {
    charts: Vec<Chart>,
    /// By place in all charts: one more than the number among `used`, or 0.
    numbers: Vec<u32>,
    used: Vec<Cell>,
    /// Of the whole image.
    pixels: u64,
}

impl Cells {
    /// Those of `charts`, one for each of the placement's spheres, that `visits` has: how often paths come to each cell.
    /// Of too many for an image of so many pixels those that are visited most.
    #[must_use]
    pub fn new(mut charts: Vec<Chart>, visits: &[(Cell, u32)], pixels: u64) -> Self {
        let mut first = 0;
        for chart in &mut charts {
            chart.first = first;
            first += chart.side * chart.side;
        }
        let mut order: Vec<&(Cell, u32)> = visits.iter().collect();
        order.sort_by_key(|(cell, count)| (std::cmp::Reverse(*count), *cell));
        order.truncate(MOST_CELLS.min(most_cells(pixels)));
        let mut used: Vec<Cell> = order.into_iter().map(|(cell, _)| *cell).collect();
        // Neighbours side by side.
        used.sort_unstable();
        let mut numbers = vec![0; first as usize];
        for (cell, number) in used.iter().zip(1..) {
            numbers[place(&charts, *cell)] = number;
        }
        Self {
            charts,
            numbers,
            used,
            pixels,
        }
    }

    /// None at all, of so many spheres.
    #[must_use]
    pub fn none(spheres: usize) -> Self {
        Self::new(vec![Chart::without_cells(false); spheres], &[], 0)
    }

    /// The chart of each of the placement's spheres.
    #[must_use]
    pub fn charts(&self) -> &[Chart] {
        &self.charts
    }

    /// The cells of all charts.
    #[must_use]
    pub fn count(&self) -> u32 {
        self.numbers.len() as u32
    }

    /// The cells that have values.
    #[must_use]
    pub fn used(&self) -> &[Cell] {
        &self.used
    }

    /// The number of a cell among [`used`](Self::used).
    #[must_use]
    pub fn number(&self, cell: Cell) -> Option<usize> {
        let number = self.numbers[place(&self.charts, cell)];
        number.checked_sub(1).map(|number| number as usize)
    }

    /// The paths of a pilot over those of the image, for a batch of so many samples a pixel.
    #[must_use]
    pub fn share(&self, batch: u64) -> f64 {
        let paths = self.used.len() as f64 * f64::from(self.samples(batch));
        paths / (self.pixels * batch) as f64
    }

    /// The samples of each cell for a batch of so many samples a pixel.
    #[must_use]
    pub fn samples(&self, batch: u64) -> u32 {
        let all = SHARE * (self.pixels * batch) as f64;
        let each = all / self.used.len().max(1) as f64;
        let power = (each.max(1.0) as u32).max(1).ilog2();
        (1 << power).clamp(*SAMPLES.start(), *SAMPLES.end())
    }
}

/// The cells of which a pilot can take the fewest samples without more paths than its share.
fn most_cells(pixels: u64) -> usize {
    let paths = SHARE * (pixels * SHORTEST) as f64;
    (paths / f64::from(*SAMPLES.start())) as usize
}

fn place(charts: &[Chart], cell: Cell) -> usize {
    let chart = &charts[usize::from(cell.sphere)];
    let [row, column] = [cell.row, cell.column].map(u32::from);
    (chart.first + row * chart.side + column) as usize
}

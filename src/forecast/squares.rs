//! Parts of an image that stand for all of it.

use crate::settings::Rect;

/// The side of the squares that stand for the image.
const SIDE: u32 = 32;
/// The fewest squares: fewer do not tell by themselves how much they differ.
const FEWEST: f64 = 24.0;
/// Squares, one in each cell of a grid, that make up about so large a share of the image; or all of it.
pub(crate) fn squares(crop: Rect, share: f64) -> Vec<Rect> {
    let area = f64::from(SIDE * SIDE);
    let wanted = (share * crop.pixels() as f64 / area).max(FEWEST);
    if wanted * area >= 0.8 * crop.pixels() as f64 {
        return vec![crop];
    }
    spread(crop, SIDE, wanted)
}

/// About `wanted` squares of side `side`, one in each cell of a grid.
pub(crate) fn spread(crop: Rect, side: u32, wanted: f64) -> Vec<Rect> {
    let aspect = f64::from(crop.width) / f64::from(crop.height);
    let cells = |cells: f64, size: u32| (cells.round() as u32).clamp(1, size.div_ceil(side));
    let columns = cells((wanted * aspect).sqrt(), crop.width);
    let rows = cells(wanted / f64::from(columns), crop.height);
    // A place in each cell: the R2 sequence (Roberts 2018), which is even in both directions.
    let offset = |i: u32, ratio: f64| (0.5 + f64::from(i + 1) * ratio).fract();
    let start = |cell: u32, cells: u32, size: u32, offset: f64| {
        let center = (f64::from(cell) + offset) * f64::from(size) / f64::from(cells);
        ((center - 0.5 * f64::from(side)).max(0.0) as u32).min(size.saturating_sub(side))
    };
    (0..rows * columns)
        .map(|i| Rect {
            x: crop.x + start(i % columns, columns, crop.width, offset(i, 0.754_877_666)),
            y: crop.y + start(i / columns, rows, crop.height, offset(i, 0.569_840_291)),
            width: side.min(crop.width),
            height: side.min(crop.height),
        })
        .collect()
}

//! Files of the MERL database: Matusik, Pfister, Brand and McMillan, "A Data-Driven Reflectance Model" (SIGGRAPH 2003).

use super::BrdfTable;
use crate::materials::schema::MAX_MAGNITUDE;

/// Entries by theta_h, theta_d and phi_d.
pub const MERL_SIZES: [usize; 3] = [90, 90, 180];

/// Of one channel.
const ENTRIES: usize = MERL_SIZES[0] * MERL_SIZES[1] * MERL_SIZES[2];

/// Three integers.
const HEADER: usize = 12;

/// The length of a file, in bytes.
pub const MERL_BYTES: u64 = (HEADER + 3 * ENTRIES * size_of::<f64>()) as u64;

/// What values of red, green and blue are multiplied by.
const SCALES: [f64; 3] = [1.0 / 1500.0, 1.15 / 1500.0, 1.66 / 1500.0];

const CHANNELS: [&str; 3] = ["red", "green", "blue"];

/// The table of a file: three little-endian integers, its sizes, and the values of red, of green and of blue, phi_d running
/// first, as little-endian doubles. Negative ones, of which nothing was measured, are 0.
///
/// # Errors
/// What is wrong with the file.
pub fn parse(bytes: &[u8]) -> Result<BrdfTable, String> {
    let Some((header, values)) = bytes.split_at_checked(HEADER) else {
        return Err(format!(
            "it has {} bytes, and a MERL file {MERL_BYTES}: it is truncated",
            bytes.len()
        ));
    };
    let (sizes, _) = header.as_chunks::<4>();
    let sizes: Vec<i32> = sizes.iter().map(|size| i32::from_le_bytes(*size)).collect();
    if sizes[..] != MERL_SIZES.map(|size| size as i32) {
        let [i, j, k] = MERL_SIZES;
        return Err(format!(
            "its first three integers, the table's sizes, are {}, {} and {}; those of a MERL file are {i}, {j} and {k}",
            sizes[0], sizes[1], sizes[2]
        ));
    }
    if bytes.len() as u64 != MERL_BYTES {
        let what = match (bytes.len() as u64) < MERL_BYTES {
            true => "it is truncated",
            false => "something follows the table",
        };
        return Err(format!(
            "it has {} bytes, and a MERL file {MERL_BYTES}: {what}",
            bytes.len()
        ));
    }
    let (values, _) = values.as_chunks::<8>();
    let mut entries = vec![[0.0; 3]; ENTRIES];
    for (place, value) in values.iter().enumerate() {
        let (channel, entry) = (place / ENTRIES, place % ENTRIES);
        let value = f64::from_le_bytes(*value);
        let scaled = SCALES[channel] * value;
        if !value.is_finite() || scaled > MAX_MAGNITUDE {
            let [_, down, around] = MERL_SIZES;
            let (i, j, k) = (entry / around / down, entry / around % down, entry % around);
            return Err(format!(
                "its {} value {i}, {j}, {k} (by theta_h, theta_d, phi_d) is {value}; values are finite, and scaled at \
                 most {MAX_MAGNITUDE:e}",
                CHANNELS[channel]
            ));
        }
        // Without negative zeros: they must hash alike.
        entries[entry][channel] = (scaled.max(0.0) + 0.0) as f32;
    }
    Ok(BrdfTable::new(MERL_SIZES, entries))
}

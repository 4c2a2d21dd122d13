//! What the surface between two media reflects; twin of `shaders/materials/fresnel.wesl`.

/// Fresnel's answer for one direction.
#[derive(Clone, Copy, Debug)]
pub struct Fresnel {
    /// Share of the unpolarised light that is reflected.
    pub reflected: f64,
    /// Cosine beyond the surface; 0 if the reflection is total.
    pub cos_t: f64,
}

/// eta: index beyond the surface over the index before it.
#[must_use]
pub fn fresnel(cos_i: f64, eta: f64) -> Fresnel {
    let square = ((eta - 1.0) * (eta + 1.0) + cos_i * cos_i) / (eta * eta);
    if square <= 0.0 {
        return Fresnel {
            reflected: 1.0,
            cos_t: 0.0,
        };
    }
    let cos_t = square.sqrt();
    let s = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
    let p = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
    Fresnel {
        reflected: 0.5 * (s * s + p * p),
        cos_t,
    }
}

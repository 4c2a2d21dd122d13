//! What scene files may say of materials: defaults, limits, and errors with their place.

use glam::DVec3;
use gpu_trace::error::Error;
use gpu_trace::materials::disney::Disney;
use gpu_trace::materials::nylon::Nylon;
use gpu_trace::materials::{MaterialKind, Surface};
use gpu_trace::scene::load::load_str;

/// A scene whose material's keys begin in line 10.
fn text(material: &str) -> String {
    format!(
        "[camera]\nposition = [0, 0, -4]\nlook_at = [0, 0, 6]\nfov = 36.0\n[image]\nwidth = 64\nheight = 48\n\
         [environment]\nradiance = [1, 1, 1]\n[material.ball]\n{material}\n[[sphere]]\ncenter = [0, 0, 2]\n\
         radius = 1.0\nmaterial = \"ball\"\n"
    )
}

fn kind(material: &str) -> MaterialKind {
    let loaded = load_str("scene", &text(material)).unwrap_or_else(|e| panic!("{material}: {e}"));
    loaded.scene.materials[0].kind.clone()
}

const ASHIKHMIN: &str =
    "type = \"ashikhmin\"\ndiffuse = [0, 0, 0]\nspecular = [1, 1, 1]\nnu = 0\nnv = 1e6";
const DISNEY: &str = "type = \"disney\"\nbase_color = [0.5, 0.5, 0.5]";
const SHEEN: &str = "type = \"sheen\"\ncolor = [0.2, 0.2, 0.2]\nroughness = 0.05";
const NYLON: &str = "type = \"nylon\"";

#[test]
fn defaults_are_the_models() {
    let disney = Disney::of([0.5; 3].into());
    assert_eq!(kind(DISNEY), disney.into());
    assert_eq!(kind(NYLON), Nylon::default().into());
    let MaterialKind::Ashikhmin(material) = kind(ASHIKHMIN) else {
        panic!("it is none");
    };
    assert_eq!(material.axis, DVec3::Y);
    assert_eq!((material.nu, material.nv), (0.0, 1.0e6));
    let MaterialKind::Sheen(material) = kind(SHEEN) else {
        panic!("it is none");
    };
    assert_eq!(material.roughness, 0.05);
}

#[test]
fn errors_have_their_place() {
    // What is changed, to what, the line, and what is said.
    for (good, old, new, line, says) in [
        (ASHIKHMIN, "nu = 0", "nu = -1", 14, "`nu`"),
        (ASHIKHMIN, "nv = 1e6", "nv = 2e6", 15, "`nv`"),
        (ASHIKHMIN, "nv = 1e6", "nv = nan", 15, "`nv`"),
        (
            ASHIKHMIN,
            "diffuse = [0, 0, 0]",
            "diffuse = [0, 0, 1.5]",
            12,
            "`diffuse`",
        ),
        (
            ASHIKHMIN,
            "nv = 1e6",
            "nv = 1\naxis = [0, 0, 0]",
            16,
            "`axis` has no direction",
        ),
        (ASHIKHMIN, "\nnv = 1e6", "", 10, "`nv` is missing"),
        (
            DISNEY,
            "base_color",
            "metallic = 1.1\nbase_color",
            12,
            "`metallic`",
        ),
        (
            DISNEY,
            "base_color",
            "clearcoat_glos = 1\nbase_color",
            12,
            "did you mean `clearcoat_gloss`?",
        ),
        (
            DISNEY,
            "base_color",
            "axis = [0, 0, 0]\nbase_color",
            12,
            "`axis` has no direction",
        ),
        (
            DISNEY,
            "\nbase_color = [0.5, 0.5, 0.5]",
            "",
            10,
            "`base_color` is missing",
        ),
        (
            SHEEN,
            "roughness = 0.05",
            "roughness = 0.04",
            13,
            "`roughness`",
        ),
        (
            SHEEN,
            "\nroughness = 0.05",
            "",
            10,
            "`roughness` is missing",
        ),
        (NYLON, "\"nylon\"", "\"nylon\"\nc = -1", 12, "`c`"),
        (NYLON, "\"nylon\"", "\"nylon\"\nior = 0.9", 12, "`ior`"),
        (NYLON, "\"nylon\"", "\"nylon\"\na = [1, 2]", 12, "`a`"),
        (
            NYLON,
            "\"nylon\"",
            "\"nylon\"\nroughness = 0.5",
            12,
            "a nylon material has no `roughness`",
        ),
    ] {
        let changed = good.replacen(old, new, 1);
        assert_ne!(changed, good);
        let Err(Error::Scene(message)) = load_str("scene", &text(&changed)) else {
            panic!("{changed}: it is accepted");
        };
        let place = format!(":{line}:");
        assert!(
            message.contains(&place) && message.contains(says),
            "{changed}: {message}"
        );
    }
}

/// An axis whose square is no f64 is a direction as any other.
#[test]
fn an_axis_may_be_short() {
    let (wo, wi) = (DVec3::new(0.48, 0.36, 0.8), DVec3::new(-0.36, -0.48, 0.8));
    let surface = Surface {
        normal: DVec3::Z,
        eta: 1.0,
        offset: DVec3::Z,
    };
    for material in [
        ASHIKHMIN.replace("1e6", "100"),
        format!("{DISNEY}\nanisotropic = 0.8"),
        "type = \"conductor\"\npreset = \"copper\"\nroughness = 0.5\nanisotropy = 0.8".into(),
    ] {
        let of = |axis: &str| {
            let kind = kind(&format!("{material}\naxis = {axis}"));
            let value = kind.evaluate(&surface, wo, wi);
            (kind.members(), value.f_cos)
        };
        let long = of("[1, 0, 1]");
        assert!(long.1.is_finite(), "{material}: {long:?}");
        for short in ["1e-150", "1e-160", "1e-200", "5e-324"] {
            let short = of(&format!("[{short}, 0, {short}]"));
            assert_eq!(short, long, "{material}");
        }
        // Companion: of another direction.
        let other = of("[1e-200, 1e-200, 1e-200]");
        assert!(other.0 != long.0 && other.1 != long.1, "{material}");
    }
}

#[test]
fn what_gains_energy_is_warned_of() {
    for (material, gains) in [
        (ASHIKHMIN.to_owned(), false),
        (DISNEY.to_owned(), false),
        (DISNEY.replace("0.5", "1"), true),
        (SHEEN.to_owned(), false),
        (SHEEN.replace("0.2", "0.9"), true),
        (NYLON.to_owned(), false),
        (format!("{NYLON}\na = [300, 300, 300]"), true),
    ] {
        let loaded = load_str("scene", &text(&material)).expect("good");
        let warned = loaded.warnings.iter().any(|w| w.contains("gains energy"));
        assert_eq!(warned, gains, "{material}: {:?}", loaded.warnings);
    }
}

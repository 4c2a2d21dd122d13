//! Words of the command line.

use clap::Parser;
use gpu_trace::cli::{Cli, RenderArgs};
use gpu_trace::error::Error;
use gpu_trace::output::Target;
use gpu_trace::placement::Placement;

use super::inputs::Random;
use super::scenes::{assert_finite, ball};
use super::words::NUMBERS;
use super::{fuzz, numbers};

const OPTIONS: &[&str] = &[
    "--output",
    "-o",
    "--stats",
    "--exposure",
    "--dump-wgsl",
    "--progress",
    "--quiet",
    "--verbose",
    "--spp",
    "--error",
    "--time",
    "--sample-range",
    "--size",
    "--crop",
    "--seed",
    "--integrator",
    "--sampler",
    "--max-bounces",
    "--radiance-cache",
    "--lamp-images",
    "--roulette",
    "--termination",
    "--backend",
    "--device",
    "--geometry",
    "--threads",
    "--allow-non-finite",
    "--inject-fault",
    "--",
    "-",
    "--help",
    "=",
];

const VALUES: &[&str] = &[
    "a.png",
    "a.exr",
    "a",
    "/",
    "",
    "1%",
    "0.5 %",
    "30s",
    "1h 30m",
    "1y 1month 1w 1d",
    "16..48",
    "0..281474976710656",
    "18446744073709551615..18446744073709551615",
    "640x480",
    "1,2,3x4",
    "0,0,65536x65536",
    "4294967295,4294967295,1x1",
    "lecture",
    "bsdf",
    "on",
    "off",
    "auto",
    "list",
    "baked",
    "cpu",
    "json",
    "device-lost@2",
    "non-finite@18446744073709551615",
    "99999999999999999999y",
    "1e308",
    "0.1e-400s",
];

/// The options of `render` alone.
#[derive(Debug, Parser)]
struct Render {
    #[command(flatten)]
    render: RenderArgs,
}

#[test]
fn no_words_upset_the_command_line() {
    let scene = ball();
    let mut seeds: Vec<Vec<u8>> = VALUES
        .iter()
        .chain(NUMBERS)
        .map(|v| v.as_bytes().into())
        .collect();
    seeds.push(VALUES.join(" ").into_bytes());
    let tried = fuzz("words", numbers(5000), &seeds, |index, bytes| {
        // Damaged values, each after an option.
        let mut random = Random(index);
        let text = String::from_utf8_lossy(bytes);
        let mut arguments = vec!["gpu-trace".to_owned()];
        for _ in 0..1 + random.below(3) {
            let option = random.of(OPTIONS);
            let value = if random.chance(2) {
                text.as_ref()
            } else {
                random.of(VALUES)
            };
            let value: String = value.chars().filter(|c| *c != '\0').collect();
            match random.below(4) {
                0 => arguments.push(format!("{option}={value}")),
                1 => arguments.push(value),
                _ => arguments.extend([(*option).to_owned(), value]),
            }
        }
        if let Err(error) = Cli::try_parse_from(&arguments) {
            assert!(!error.to_string().is_empty());
        }
        let _ = Target::parse(arguments.last().expect("the program's name"));
        let Ok(parsed) = Render::try_parse_from(&arguments) else {
            return false;
        };
        match parsed.render.settings(&scene) {
            Ok(settings) => {
                assert!(!settings.samples.is_empty(), "{settings:?}");
                assert!(settings.crop.pixels() > 0, "{settings:?}");
                assert_finite(&Placement::new(&scene, settings.width, settings.height));
                true
            }
            Err(Error::Usage(text)) => {
                assert!(!text.is_empty());
                false
            }
            Err(other) => panic!("{other}"),
        }
    });
    assert!(tried.accepted > tried.refused / 50, "{tried:?}");
    assert!(tried.refused > tried.accepted / 50, "{tried:?}");
}

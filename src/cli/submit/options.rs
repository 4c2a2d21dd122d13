//! The options of `render` as the tasks and the merge get them.

use clap::ValueEnum as _;
use glam::DVec3;

use crate::cli::args::RenderArgs;
use crate::cli::choices::{Caching, Wanted};
use crate::error::{Error, Result};
use crate::output::ProgressMode;
use crate::sampler::Sampler;
use crate::settings::{GeometryChoice, Offset, Rect};

/// The options that were given, by who needs them. Scene, outputs, samples, error and statistics are not among them.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Passed {
    /// Of a part when it begins.
    pub(super) begin: Vec<String>,
    /// Of a part whenever it is rendered.
    pub(super) always: Vec<String>,
    /// Of the merge.
    pub(super) merge: Vec<String>,
}

impl Passed {
    /// Those of a render that was typed.
    ///
    /// # Errors
    /// [`Error::Usage`] for options that make no sense in parts.
    pub(super) fn of(args: &RenderArgs) -> Result<Self> {
        // All of them: an option that is new has to be thought of.
        let RenderArgs {
            scene: _,
            output: _,
            stats: _,
            aov: _,
            exposure,
            view,
            dump_wgsl,
            checkpoint,
            checkpoint_every,
            allow_non_finite,
            progress,
            quiet,
            verbose,
            spp: _,
            error: _,
            time,
            adaptive,
            sample_range: _,
            size,
            crop,
            seed,
            integrator,
            light_sampling,
            sampler,
            max_bounces,
            radiance_cache,
            lamp_images,
            roulette,
            termination,
            offset,
            backend,
            device,
            geometry,
            threads,
            color_by,
            radius_by,
            map,
            background,
            frames,
            inject_fault,
        } = args;
        let refused = [
            (
                time.is_some(),
                "--time: parts that the clock ends leave samples out; --spp or --error say how \
                long, and Slurm's limit of a task comes after --, as in `-- --time=1:00:00`",
            ),
            (
                *adaptive,
                "--adaptive has no parts: where samples go is decided by the image so far",
            ),
            (
                checkpoint.is_some(),
                "--checkpoint: each part has its film file, in the folder of the scripts; \
                gpu-trace merge --checkpoint joins them to one",
            ),
            (
                dump_wgsl.is_some(),
                "--dump-wgsl: gpu-trace effects --dump-wgsl writes the kernel here",
            ),
            (
                view.is_some(),
                "--view: film files keep light, and it shows something else: render it here",
            ),
            (
                frames.is_some(),
                "--frames are images of their own: submit a job for each, with `frame` in the scene file",
            ),
            (inject_fault.is_some(), "--inject-fault is for renders here"),
        ];
        if let Some((_, text)) = refused.iter().find(|(given, _)| *given) {
            return Err(Error::Usage((*text).into()));
        }

        let mut passed = Self::default();
        let begin = &mut passed.begin;
        let mut give = |name: &str, value: Option<String>| {
            // In one word, for a value may begin as an option does.
            begin.extend(value.map(|value| format!("--{name}={value}")));
        };
        let layers = args.layers();
        let layers: Vec<&str> = layers.iter().map(|layer| layer.name()).collect();
        give(
            "aov",
            Some(layers.join(",")).filter(|list| !list.is_empty()),
        );
        give(
            "size",
            size.map(|(width, height)| format!("{width}x{height}")),
        );
        give(
            "crop",
            crop.map(
                |Rect {
                     x,
                     y,
                     width,
                     height,
                 }| format!("{x},{y},{width}x{height}"),
            ),
        );
        give("seed", Some(seed.to_string()).filter(|_| *seed != 0));
        give(
            "integrator",
            integrator.integrator().map(|i| i.name().into()),
        );
        give("light-sampling", light_sampling.map(|l| l.name().into()));
        give("sampler", unless(Sampler::Sobol, sampler, |s| s.name()));
        give("max-bounces", max_bounces.map(|n| n.to_string()));
        give(
            "radiance-cache",
            radiance_cache
                .filter(|caching| *caching != Caching::Auto)
                .map(|caching| caching.name().into()),
        );
        give(
            "lamp-images",
            lamp_images.map(|on| if on { "on" } else { "off" }.into()),
        );
        give(
            "roulette",
            roulette.map(|on| if on { "on" } else { "off" }.into()),
        );
        give("termination", termination.map(|p| p.to_string()));
        give(
            "offset",
            Some(offset.to_string()).filter(|_| *offset != Offset::Exact),
        );
        give(
            "backend",
            match backend {
                Wanted::Auto => None,
                Wanted::Only(kind) => Some(kind.name().into()),
            },
        );
        give("device", device.clone());
        give(
            "geometry",
            unless(GeometryChoice::Auto, geometry, |g| g.name()),
        );
        give("threads", threads.map(|n| n.to_string()));
        give("color-by", color_by.clone());
        give("radius-by", radius_by.clone());
        give("map", map.map(|map| map.name().into()));
        give(
            "background",
            background.map(|DVec3 { x, y, z }| format!("{x},{y},{z}")),
        );
        give(
            "checkpoint-every",
            checkpoint_every.map(|time| format!("{}s", time.as_secs_f64())),
        );

        if *allow_non_finite {
            passed.always.push("--allow-non-finite".into());
            passed.merge.push("--allow-non-finite".into());
        }
        if *progress != ProgressMode::Auto {
            let name = progress.to_possible_value();
            let name = name.map(|value| value.get_name().to_owned());
            passed
                .always
                .extend(name.map(|name| format!("--progress={name}")));
        }
        if *verbose {
            passed.always.push("--verbose".into());
        }
        if *quiet {
            passed.always.push("--quiet".into());
            passed.merge.push("--quiet".into());
        }
        if *exposure != 0.0 {
            passed.merge.push(format!("--exposure={exposure}"));
        }
        Ok(passed)
    }
}

/// The name of what was chosen, if that is not the default.
fn unless<T: PartialEq>(default: T, chosen: &T, name: fn(&T) -> &'static str) -> Option<String> {
    (*chosen != default).then(|| name(chosen).into())
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::super::SlurmArgs;
    use super::*;

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        args: SlurmArgs,
    }

    fn parse<'a>(words: impl IntoIterator<Item = &'a str>) -> RenderArgs {
        let words = ["submit", "--tasks=2"].into_iter().chain(words);
        let line = Line::try_parse_from(words).unwrap_or_else(|e| panic!("{e}"));
        line.args.render
    }

    /// What is passed on says the same as what was typed.
    #[test]
    fn options_come_through() {
        let all = "--aov stderr,direct --size 12x34 --crop 1,2,3x4 --seed 18446744073709551615 --sampler \
            independent --light-sampling cone --max-bounces 0 --roulette off --offset back:1e-5 --backend gpu \
            --device=-5 --geometry list --threads 3 --color-by=-c --radius-by 0.1 --map turbo --background \
            0.0,1e-300,0.1 --checkpoint-every 1.25 --progress json --verbose --allow-non-finite";
        for typed in [
            all,
            "--integrator lecture --termination 0.123456789012345678 --quiet",
            "--integrator nee --backend cpu --roulette on --radiance-cache off --lamp-images on",
            "",
        ] {
            let args = parse(typed.split_whitespace());
            let Passed { begin, always, .. } = Passed::of(&args).expect("they make sense");
            let words = begin.iter().chain(&always).map(String::as_str);
            let again = format!("{:?}", parse(words));
            assert_eq!(again, format!("{args:?}"));
            // Companion: without one of them it is another render.
            let less = begin.iter().skip(1).chain(&always).map(String::as_str);
            assert!(begin.is_empty() || again != format!("{:?}", parse(less)));
        }
        let args = parse(["--exposure=-1.5", "--quiet"]);
        let merge = Passed::of(&args).expect("they make sense").merge;
        assert_eq!(merge, ["--quiet", "--exposure=-1.5"]);
    }
}

//! Film files, and the entries that they are made of.

use std::io::{Cursor, Read as _};

use gpu_trace::film::{AovSums, Estimate, Film, PixelSums, Tally, Window};
use gpu_trace::film_file::{
    self, About, Choices, Command, FORMAT, FilmFile, Goal, SceneRecord, encode,
};
use gpu_trace::settings::Settings;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipArchive, ZipWriter};

use super::scenes::ball;
use super::{fuzz, numbers};

/// Films of a few pixels, without and with layers.
fn film_files() -> Vec<Vec<u8>> {
    let ball = ball();
    [false, true]
        .map(|classes| {
            let mut settings = Settings::for_scene(&ball);
            (settings.crop.width, settings.crop.height) = (3, 2);
            (settings.samples, settings.classes) = (0..16, classes);
            let rect = settings.crop;
            let mut film = Film::new(rect);
            film.add(&Window {
                image: Vec::new(),
                rect,
                samples: 0..16,
                batch: 4,
                pixels: vec![PixelSums::default(); 6],
                aovs: vec![AovSums::default(); if classes { 6 } else { 0 }],
                tally: Tally::default(),
            });
            let about = About {
                format: FORMAT,
                makers: Vec::new(),
                scene: SceneRecord {
                    name: "a".into(),
                    hash: "b".into(),
                    folder: None,
                    files: Vec::new(),
                    look: None,
                    text: "c".into(),
                },
                settings: Choices::of(&settings).expect("light"),
                goal: Goal::of(&settings),
                ranges: vec![[0, 16]],
                samples: vec![16],
                counts: film.counts(),
                pilot: 0,
                look: 64,
                seconds: 1.5,
                stopped_by: None,
                command: Command::default(),
            };
            encode(&about, &film).expect("memory takes it")
        })
        .to_vec()
}

/// Whether it is read; if so, all of it can be asked.
fn reads_film(bytes: &[u8]) -> bool {
    match film_file::decode(Cursor::new(bytes)) {
        Ok(FilmFile { film, .. }) => {
            assert_eq!(film.pixels().len(), film.rect().pixels());
            let _ = (film.mean_samples(), film.freedom(), Estimate::of(&film));
            true
        }
        Err(error) => {
            let text = error.to_string();
            assert!(!text.is_empty() && text.len() < 1000, "{text}");
            false
        }
    }
}

#[test]
fn no_bytes_upset_the_film_reader() {
    let seeds = film_files();
    assert!(seeds.iter().all(|bytes| reads_film(bytes)));
    let tried = fuzz("films", numbers(10_000), &seeds, |_, bytes| {
        reads_film(bytes)
    });
    assert!(tried.refused > 0, "{tried:?}");
}

/// What checksums do not keep out: entries of a film file that are damaged before it is written.
#[test]
fn no_entry_upsets_the_film_reader() {
    let open = |bytes| ZipArchive::new(Cursor::new(bytes)).expect("a zip");
    let film = film_files().pop().expect("one with layers");
    let names = [
        "film.json",
        "scene.toml",
        "steps.npy",
        "sum.npy",
        "variance.npy",
        "layers.npy",
    ];
    assert_eq!(open(film.clone()).len(), names.len());
    for name in names {
        let entry = |name: &str| {
            let mut bytes = Vec::new();
            let mut archive = open(film.clone());
            let mut entry = archive.by_name(name).expect("it is there");
            entry.read_to_end(&mut bytes).expect("it is whole");
            bytes
        };
        let rest: Vec<_> = names.into_iter().filter(|other| *other != name).collect();
        let rest: Vec<_> = rest.into_iter().map(|name| (name, entry(name))).collect();
        let with = |bytes: &[u8]| {
            let stored = SimpleFileOptions::default().compression_method(CompressionMethod::Stored);
            let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
            let all = rest.iter().map(|(name, bytes)| (*name, &bytes[..]));
            for (name, bytes) in all.chain([(name, bytes)]) {
                zip.start_file(name, stored).expect("a new name");
                std::io::Write::write_all(&mut zip, bytes).expect("memory takes all");
            }
            zip.finish().expect("memory takes all").into_inner()
        };
        let seeds = [entry(name)];
        assert!(reads_film(&with(&seeds[0])), "{name}");
        let tried = fuzz(name, numbers(2_000), &seeds, |_, bytes| {
            reads_film(&with(bytes))
        });
        assert!(
            tried.accepted > 0 && (tried.refused > 0 || name == "scene.toml"),
            "{name}: {tried:?}"
        );
    }
}

//! All tests of the program and of its library in one executable, which is compiled and linked once and not
//! some forty times; `cargo test NAME::` still runs those of a file.

// What they share.
mod cli_support;
mod common;
mod equivalence;
mod thorough;

mod adaptive;
mod agreement;
mod aov;
mod bvh;
mod car_paint;
mod check;
mod claims;
mod cli;
mod cli_commands;
mod cli_errors;
mod cli_process;
mod compare;
mod containment;
mod converge;
mod coverage;
mod determinism;
mod distribution;
mod effects;
mod faults;
mod film_files;
mod flakes;
mod functions;
mod functions_scene;
mod furnace;
mod fuzz;
mod hazards;
mod input;
mod job;
mod layout;
mod ledger;
mod lights;
mod limits;
mod materials;
mod naive;
mod output;
mod particles;
mod placement;
mod price;
mod projected;
mod references;
mod reflective;
mod samplers;
mod scene;
mod sobol;
mod stream;
mod variance_law;
mod walls;

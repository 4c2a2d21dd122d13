//! What the program does when it is used as it should be, through its binary.

mod images;
mod scenes;
mod statistics;
mod stops;
mod transport;

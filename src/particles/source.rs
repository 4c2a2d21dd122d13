//! The bytes of a file, decompressed.

use std::borrow::Cow;
use std::fs::File;
use std::io::Read;
use std::path::Path;

use flate2::bufread::MultiGzDecoder;

use super::mistake::{Mistake, ReadError};

/// The longest file that is read, in bytes, after decompression.
const MOST_BYTES: u64 = 8 << 30;
/// The first bytes of a gzip file, RFC 1952.
const GZIP: &[u8] = &[0x1f, 0x8b];

/// All bytes of a file, as they are.
pub(super) fn load(path: &Path) -> Result<Vec<u8>, ReadError> {
    let mut bytes = Vec::new();
    let file = File::open(path)?;
    // What a device or a pipe says of its length is nothing.
    if file.metadata()?.len() > MOST_BYTES {
        return Err(too_long(MOST_BYTES).into());
    }
    file.take(MOST_BYTES + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > MOST_BYTES {
        return Err(too_long(MOST_BYTES).into());
    }
    Ok(bytes)
}

/// The bytes without gzip, if they begin as it does.
pub(super) fn decompressed(bytes: &[u8]) -> Result<Cow<'_, [u8]>, Mistake> {
    decompressed_to(bytes, MOST_BYTES)
}

fn decompressed_to(bytes: &[u8], most: u64) -> Result<Cow<'_, [u8]>, Mistake> {
    if !bytes.starts_with(GZIP) {
        return Ok(bytes.into());
    }
    let mut decoder = MultiGzDecoder::new(bytes);
    let mut plain = Vec::new();
    if let Err(error) = (&mut decoder).take(most + 1).read_to_end(&mut plain) {
        let at = bytes.len() - decoder.get_ref().len();
        return Err(Mistake::at_byte(
            at,
            format!("the gzip file is damaged or ends early: {error}"),
        ));
    }
    if plain.len() as u64 > most {
        return Err(too_long(most));
    }
    Ok(plain.into())
}

fn too_long(most: u64) -> Mistake {
    Mistake::of_file(format!("the file is longer than {most} bytes"))
        .help("write the frames that are wanted to files of their own")
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use flate2::Compression;
    use flate2::write::GzEncoder;

    use super::{decompressed, decompressed_to};
    use crate::particles::mistake::Place;

    fn gzip(bytes: &[u8]) -> Vec<u8> {
        let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
        encoder.write_all(bytes).expect("memory takes all");
        encoder.finish().expect("memory takes all")
    }

    #[test]
    fn gzip_is_found_by_its_first_bytes() {
        let text = b"some text".repeat(100);
        assert_eq!(&*decompressed(&text).expect("plain"), text);
        let packed = gzip(&text);
        assert_eq!(&*decompressed(&packed).expect("one"), text);
        // Files one after the other are one.
        let two = [packed.clone(), packed.clone()].concat();
        assert_eq!(&*decompressed(&two).expect("two"), text.repeat(2));
        for damaged in [
            packed[..packed.len() - 9].to_vec(),
            packed[..2].to_vec(),
            [&packed[..30], b"?", &packed[31..]].concat(),
            [&packed[..], b"?"].concat(),
        ] {
            let mistake = decompressed(&damaged).expect_err("it is damaged");
            let Place::Byte(byte) = mistake.place else {
                panic!("{mistake}");
            };
            assert!(byte <= damaged.len() as u64);
        }
    }

    #[test]
    fn a_bomb_does_not_go_off() {
        let bomb = gzip(&[0; 1 << 20]);
        assert!(decompressed_to(&bomb, 1 << 20).is_ok());
        let mistake = decompressed_to(&bomb, (1 << 20) - 1).expect_err("it is long");
        assert!(mistake.message.contains("longer than 1048575 bytes"));
    }
}

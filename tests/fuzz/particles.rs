//! Particle files, of every format.

use glam::DVec3;
use gpu_trace::particles::{self, Format, Mistake, Place};

use super::{fuzz, numbers};

/// Small files of a format, with what programs write besides.
fn particle_files(format: Format) -> Vec<Vec<u8>> {
    let texts: &[&str] = match format {
        Format::Xyz => &[
            "2\na\nC 0 1 2\nO 0.5 -1e-3 2 7 8\n1\n\nH 1 2 3\n",
            "2\nLattice=\"1 0 0 0 1 0 0 0 1\" Properties=species:S:1:pos:R:3:radius:R:1:v:R:2:ok:L:1 a='b c'\n\
             Si 0 1 2 0.5 1 2 T\nX 3 4 5 1 6 7 F\n",
        ],
        Format::LammpsDump => &[
            "ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n2\nITEM: BOX BOUNDS pp pp pp\n0 1\n0 2\n0 3\n\
             ITEM: ATOMS id element xs ys zs diameter name\n1 C 0 0.5 1 1 a\n2 O 0.1 0.2 0.3 2 b\n",
            "ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n1\nITEM: BOX BOUNDS xy xz yz pp pp pp\n0 1 0.5\n\
             0 2 -1\n0 3 0\nITEM: ATOMS xsu ysu zsu\n1 2 3\nITEM: TIMESTEP\n1\nITEM: NUMBER OF ATOMS\n1\n\
             ITEM: ATOMS id x y z\n1 2 3 4\n",
        ],
        Format::LammpsData => &[
            "title\n\n2 atoms\n1 atom types\n\n0 1 xlo xhi\n\nMasses\n\n1 1.0\n\nAtoms # sphere\n\n\
             1 1 0.5 1 1 2 3\n2 1 0.25 1 4 5 6\n\nVelocities\n\n1 0 0 0\n2 0 0 0\n",
            "title\n1 atoms\n\nAtoms\n\n1 1 1 2 3 0 -1 0\n",
        ],
        Format::Pdb => &[
            "MODEL        1\nATOM      1  N   GLU A   4      69.319  39.142  47.221  1.00 64.20           N\n\
             ATOM      2  CA AGLU A   4      68.071  38.402  47.431  0.50  1.50           C1+\nTER\nENDMDL\n\
             MODEL        2\nHETATM    3 ZN    ZN B   1       1.000   2.000   3.000\nENDMDL\nEND\n",
        ],
        Format::Mmcif => &[
            "data_a\n_struct.title\n;text\n;\nloop_\n_atom_site.id\n_atom_site.type_symbol\n\
             _atom_site.label_alt_id\n_atom_site.auth_asym_id\n_atom_site.Cartn_x\n_atom_site.Cartn_y\n\
             _atom_site.Cartn_z\n_atom_site.B_iso_or_equiv\n_atom_site.pdbx_PDB_model_num\n\
             1 N . A 1.5 2.5 -3 ? 1\n2 'C' A \"B'\" 1(2) 2 3 4 1 # b\n3 O B C 0 0 0 . 2\nloop_\n_b.c 1 2\n",
            "_atom_site.Cartn_x 1 _atom_site.Cartn_y 2 _atom_site.Cartn_z 3\n",
        ],
        Format::Csv => &[
            "# from a script\n# x,y,z,element,name,radius\n1,2,3,C,\"a, b\",0.5\n4,5,6,8,,1\n",
            "X;Y;Z;E\r\n1;2;3;\r\n;;;\r\n4;5;6;7\r\n",
        ],
        Format::Ply => &[
            "ply\nformat ascii 1.0\nelement a 1\nproperty list uchar int b\nelement vertex 2\nproperty float x\n\
             property double y\nproperty int z\nproperty list int8 float t\nend_header\n2 1 2\n1 2 3 0\n\
             4 5 6 1 7\n",
            "ply\nformat binary_big_endian 1.0\nelement a 1\nproperty list uchar uchar b\nelement vertex 1\n\
             property uchar x\nproperty uchar y\nproperty uchar z\nelement face 0\nend_header\n\u{1}ABCD",
            "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty float x\nproperty float y\n\
             property float z\nproperty list uchar int t\nend_header\n000011112222\0",
        ],
        Format::Npy => &[],
    };
    let mut files: Vec<Vec<u8>> = texts.iter().map(|text| text.as_bytes().into()).collect();
    if format == Format::Npy {
        for (descr, order, shape, data) in [
            ("<f8", "False", "(2, 4)", 64),
            (">f4", "True", "(3, 3)", 36),
            ("<i4", "False", "(1, 3)", 12),
        ] {
            let header =
                format!("{{'descr': '{descr}', 'fortran_order': {order}, 'shape': {shape}, }}\n");
            let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
            bytes.extend((header.len() as u16).to_le_bytes());
            bytes.extend(header.bytes());
            bytes.extend(vec![0; data]);
            files.push(bytes);
        }
    }
    files
}

/// That a mistake of these bytes is one that a user can work with.
fn is_mistake(mistake: &Mistake, plain: Option<&[u8]>) {
    let text = mistake.to_string();
    assert!(!text.is_empty() && text.len() < 3000, "{text}");
    assert!(!text.contains(char::is_control), "{text:?}");
    let Some(bytes) = plain else {
        return;
    };
    match &mistake.place {
        Place::Line { number, .. } => {
            let lines = bytes.split(|byte| *byte == b'\n').count() as u64;
            assert!((1..=lines).contains(number), "{text}");
        }
        Place::Byte(byte) => assert!(*byte <= bytes.len() as u64, "{text}"),
        Place::File => {}
    }
}

/// Whether a reader accepts these bytes.
fn reads_particles(format: Format, bytes: &[u8]) -> bool {
    let plain = (!bytes.starts_with(&[0x1f, 0x8b])).then_some(bytes);
    for frame in [1, u64::MAX] {
        if let Err(mistake) = particles::parse(bytes, format, frame) {
            is_mistake(&mistake, plain);
        }
    }
    match particles::count_frames(bytes, format) {
        Ok(frames) => assert!((1..=bytes.len().max(1) as u64).contains(&frames) || plain.is_none()),
        Err(mistake) => is_mistake(&mistake, plain),
    }
    match particles::parse(bytes, format, 0) {
        Ok(particles) => {
            let count = particles.positions.len();
            let allowed = |p: &DVec3| p.abs().max_element() <= 1e20;
            assert!(particles.positions.iter().all(allowed));
            assert!(particles.elements.is_none_or(|e| e.len() == count));
            assert!(particles.columns.iter().all(|c| c.values.len() == count));
            true
        }
        Err(mistake) => {
            is_mistake(&mistake, plain);
            false
        }
    }
}

#[test]
fn no_bytes_upset_the_particle_readers() {
    for format in Format::ALL {
        let mut seeds = particle_files(format);
        for seed in &seeds {
            if let Err(mistake) = particles::parse(seed, format, 0) {
                panic!("{format:?}: {mistake}");
            }
        }
        let mut gzip = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
        std::io::Write::write_all(&mut gzip, &seeds[0]).expect("memory takes all");
        seeds.push(gzip.finish().expect("memory takes all"));
        let tried = fuzz(format.name(), numbers(4000), &seeds, |_, bytes| {
            reads_particles(format, bytes)
        });
        assert!(tried.accepted > 0 && tried.refused > 0, "{tried:?}");
    }
}

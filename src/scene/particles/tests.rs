use glam::DVec3;

use super::{Coloring, Fault, RadiusBy, Request, Similarity, gather};
use crate::scene::color_map::Map;
use crate::scene::load::load_file;

const XYZ: &str = "4\nProperties=species:S:1:pos:R:3:pe:R:1\n\
                   C 0 0 0 1.0\nH 1 0 0 2.0\nO 0 2 0 3.0\nH 0 0 3 2.0\n";

fn folder(files: &[(&str, &str)]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, text) in files {
        std::fs::write(folder.path().join(name), text).expect(name);
    }
    folder
}

fn request(folder: &tempfile::TempDir, name: &str) -> Request {
    Request {
        file: folder.path().join(name),
        format: None,
        frame: 0,
        may_be_empty: false,
        radius: None,
        coloring: Coloring::None,
        select: None,
        transform: Similarity::IDENTITY,
    }
}

fn fault(request: &Request) -> Fault {
    gather(request)
        .map(|cloud| cloud.balls.len())
        .expect_err("a fault")
}

#[test]
fn elements_have_radii_and_colours() {
    let folder = folder(&[("a.xyz", XYZ)]);
    let all = Request {
        coloring: Coloring::Element,
        ..request(&folder, "a.xyz")
    };
    let cloud = gather(&all).expect("good");
    let names: Vec<_> = cloud.colors.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names, ["C", "H", "O"], "each once, in the file's order");
    let colors: Vec<_> = cloud.balls.iter().map(|ball| ball.color).collect();
    assert_eq!(colors, [0, 1, 2, 1]);
    assert_eq!(cloud.balls[3].center, DVec3::new(0.0, 0.0, 3.0));
    assert!(
        cloud.balls[0].radius > cloud.balls[1].radius,
        "carbon is larger"
    );
    let covalent = Request {
        radius: Some(RadiusBy::Covalent),
        ..all
    };
    let smaller = gather(&covalent).expect("good");
    assert!(smaller.balls[0].radius < cloud.balls[0].radius);
}

#[test]
fn columns_are_radii_and_go_through_maps() {
    let folder = folder(&[("a.xyz", XYZ)]);
    let column = |range| Request {
        radius: Some(RadiusBy::Column("pe".into())),
        coloring: Coloring::Column {
            name: "pe".into(),
            map: Map::Viridis,
            range,
        },
        ..request(&folder, "a.xyz")
    };
    let cloud = gather(&column(None)).expect("good");
    assert_eq!(cloud.balls[2].radius, 3.0);
    assert_eq!(cloud.colors.len(), 3);
    // Viridis goes from dark violet to yellow.
    let [low, high] = [cloud.colors[0].1, cloud.colors[2].1];
    assert!(
        low.z > low.y && high.x > high.z && high.y > low.y,
        "{low} {high}"
    );
    // Beyond the range are the ends.
    let cloud = gather(&column(Some([1.4, 1.6]))).expect("good");
    assert_eq!(cloud.colors.len(), 2);
    assert_eq!(cloud.colors[1].1, high);
}

#[test]
fn what_is_selected_is_moved() {
    let folder = folder(&[("a.xyz", XYZ)]);
    let rows = [
        [0.0, -2.0, 0.0, 10.0],
        [2.0, 0.0, 0.0, 0.0],
        [0.0, 0.0, 2.0, 0.0],
        [0.0, 0.0, 0.0, 1.0],
    ];
    let moved = Request {
        radius: Some(RadiusBy::Constant(0.5)),
        select: Some("y + z > 1 and element != H".into()),
        transform: Similarity::of_rows(rows).expect("a similarity"),
        ..request(&folder, "a.xyz")
    };
    let cloud = gather(&moved).expect("good");
    assert_eq!(cloud.balls.len(), 1);
    assert_eq!(cloud.balls[0].center, DVec3::new(6.0, 0.0, 0.0));
    assert_eq!(cloud.balls[0].radius, 1.0);
    // Companions: what is no similarity.
    for (row, column, value) in [(0, 0, 0.1), (2, 2, 2.1), (3, 3, 2.0), (3, 0, 1.0)] {
        let mut rows = rows;
        rows[row][column] = value;
        assert!(Similarity::of_rows(rows).is_none(), "{rows:?}");
    }
    assert!(Similarity::of_rows([[0.0; 4]; 4]).is_none());
}

#[test]
fn faults_name_their_key() {
    let folder = folder(&[
        ("a.xyz", XYZ),
        ("a.csv", "x,y,z,r,c\n0,0,0,1,1\n0,0,0,-1,nan\n"),
        ("a.what", "1"),
    ]);
    let csv = request(&folder, "a.csv");
    let with = |radius: &str, select: Option<&str>| Request {
        radius: Some(RadiusBy::of_word(radius)),
        select: select.map(Into::into),
        ..csv.clone()
    };
    let colored = |name: &str| Request {
        radius: Some(RadiusBy::Constant(1.0)),
        coloring: Coloring::Column {
            name: name.into(),
            map: Map::default(),
            range: None,
        },
        ..csv.clone()
    };
    let elements = Request {
        radius: Some(RadiusBy::Constant(1.0)),
        coloring: Coloring::Element,
        ..csv.clone()
    };
    for (request, key, says) in [
        (request(&folder, "a.what"), "file", "ending"),
        (request(&folder, "none.xyz"), "file", "cannot read"),
        (csv.clone(), "radius", "neither radii nor elements"),
        (with("vdw", None), "radius", "no elements"),
        (with("R", None), "radius", "no column `R`"),
        (with("r", None), "radius", "particle 2 is -1"),
        (with("r", Some("r > 5")), "select", "none of the 2"),
        (with("r", Some("r >")), "select", "a number or a column"),
        (colored("q"), "color_by", "no column `q`"),
        (colored("c"), "color_by", "particle 2 is no finite number"),
        (elements, "color_by", "no elements"),
    ] {
        let fault = fault(&request);
        assert_eq!(fault.key, key, "{fault:?}");
        assert!(fault.message.contains(says), "{fault:?}");
    }
    assert!(gather(&with("r", Some("r > 0"))).is_ok());
}

const SCENE: &str = "\
[camera]
position = [0, 0, 9]
look_at = [0, 0, 0]
fov = 40
[image]
width = 8
height = 8
[environment]
radiance = [1, 1, 1]
[material.gray]
type = \"diffuse\"
albedo = [0.5, 0.5, 0.5]
";

fn load(table: &str) -> Result<crate::scene::Scene, String> {
    let text = format!("{SCENE}[[particles]]\n{table}\n");
    let folder = folder(&[
        ("a.xyz", XYZ),
        ("bad.xyz", "1\n\nC 0 zero 0\n"),
        ("s.toml", &text),
    ]);
    let loaded = load_file(&folder.path().join("s.toml")).map_err(|e| e.to_string())?;
    assert_eq!(loaded.inputs().len(), 2, "the scene and the file");
    assert!(
        loaded.warnings.is_empty() || !table.contains("gray"),
        "{:?}",
        loaded.warnings
    );
    Ok(loaded.scene)
}

#[test]
fn a_scene_file_names_particles() {
    let scene = load("file = \"a.xyz\"\nmaterial = \"gray\"\nradius = 0.25").expect("good");
    assert_eq!((scene.spheres.len(), scene.materials.len()), (4, 1));
    let scene =
        load("file = \"a.xyz\"\ncolor_by = \"element\"\nmaterial_type = \"mirror\"").expect("good");
    assert_eq!((scene.spheres.len(), scene.materials.len()), (4, 4));
    assert_eq!(scene.materials[scene.spheres[2].material].name, "O");
    assert_eq!(scene.materials[1].kind.name(), "mirror");
    let scene = load(
        "file = \"a.xyz\"\ncolor_by = \"pe\"\nrange = [0, 4]\nmap = \"turbo\"\nradius = \"pe\"",
    );
    assert_eq!(scene.expect("good").spheres[1].radius, 2.0);
}

#[test]
fn mistakes_have_their_place() {
    for (table, line, says) in [
        ("file = \"a.xyz\"", 14, "without `material` or `color_by`"),
        (
            "file = \"a.xyz\"\nmaterial = \"grey\"",
            15,
            "did you mean \"gray\"?",
        ),
        (
            "file = \"a.xyz\"\nmaterial = \"gray\"\ncolor_by = \"pe\"",
            15,
            "do not go together",
        ),
        (
            "file = \"a.xyz\"\ncolor_by = \"element\"\nmap = \"turbo\"",
            16,
            "needs a column",
        ),
        (
            "file = \"a.xyz\"\ncolor_by = \"pe\"\nmap = \"jet\"",
            16,
            "unknown map",
        ),
        (
            "file = \"a.xyz\"\ncolor_by = \"pe\"\nrange = [2, 1]",
            16,
            "less than the second",
        ),
        (
            "file = \"a.xyz\"\ncolor_by = \"pe\"\nrange = [2]",
            16,
            "exactly 2 numbers",
        ),
        (
            "file = \"a.xyz\"\nmaterial = \"gray\"\nradius = 0",
            16,
            "greater than 0",
        ),
        (
            "file = \"a.xyz\"\nmaterial = \"gray\"\nradius = true",
            16,
            "`radius` must be",
        ),
        (
            "file = \"a.xyz\"\nmaterial = \"gray\"\ntransform = 1",
            16,
            "4 arrays of 4 numbers",
        ),
        (
            "file = \"a.xyz\"\nmaterial = \"gray\"\ntransform = [[1, 0, 0, 0]]",
            16,
            "exactly 4 rows",
        ),
        (
            "file = \"a.xyz\"\nmaterial = \"gray\"\nselect = \"x <\"",
            16,
            "a number or a column",
        ),
        (
            "file = \"a.xyz\"\nmaterial = \"gray\"\nframe = 1",
            14,
            "frame",
        ),
        ("file = \"bad.xyz\"\nmaterial = \"gray\"", 14, "line 3"),
    ] {
        let text = load(table).expect_err(table);
        assert!(text.contains(says), "{table}\n{text}");
        assert!(text.contains(&format!("s.toml:{line}:")), "{table}\n{text}");
    }
}

//! Archives that only other programs write, built here.

use super::AlembicFormat;
use super::pod::Pod;
use super::writer::{PropertySpec, Writer, Written, WrittenObject};
use crate::error::Result;
use crate::groom::{Domain, Groom};
use crate::groom_format::{GroomFormat, Import, ImportOptions};

/// A parameter: name, scope, type, numbers a value, values, indices.
type Param = (
    &'static str,
    &'static str,
    Pod,
    u8,
    Vec<f64>,
    Option<Vec<u32>>,
);

/// An object of curves.
#[derive(Clone)]
struct Curves {
    name: &'static str,
    kind: [u8; 4],
    /// Of each sample.
    counts: Vec<Vec<i32>>,
    points: Vec<Vec<[f32; 3]>>,
    width: Option<Param>,
    params: Vec<Param>,
    knots: Vec<f64>,
    orders: Vec<f64>,
    weights: Vec<f64>,
}

const LINEAR: [u8; 4] = [1, 0, 0, 0];

impl Curves {
    /// Curves of so many points, on a line each.
    fn new(kind: [u8; 4], counts: &[i32]) -> Self {
        let mut points = Vec::new();
        for (curve, &n) in counts.iter().enumerate() {
            points.extend((0..n).map(|ix| [curve as f32, ix as f32, (ix * ix) as f32 / 8.0]));
        }
        Curves {
            name: "hair",
            kind,
            counts: vec![counts.to_vec()],
            points: vec![points],
            width: None,
            params: Vec::new(),
            knots: Vec::new(),
            orders: Vec::new(),
            weights: Vec::new(),
        }
    }

    fn with(mut self, param: Param) -> Self {
        self.params.push(param);
        self
    }

    fn write(&self, writer: &mut Writer) -> WrittenObject {
        let of = |spec: PropertySpec<'_>, samples: Vec<Vec<u8>>, writer: &mut Writer| {
            writer.property(&spec, samples.into_iter().map(|bytes| (bytes, 1)))
        };
        let spec = |name, pod, extent| PropertySpec {
            name,
            pod,
            extent,
            metadata: String::new(),
            is_array: true,
            sampling: 1,
        };
        let points = self.points.iter();
        let points = points.map(|all| all.iter().flatten().flat_map(|x| x.to_le_bytes()).collect());
        let counts = self.counts.iter();
        let counts = counts.map(|all| all.iter().flat_map(|n| n.to_le_bytes()).collect());
        let kind = PropertySpec {
            is_array: false,
            ..spec("curveBasisAndType", Pod::U8, 4)
        };
        let mut geom = vec![
            of(spec("P", Pod::F32, 3), points.collect(), writer),
            of(spec("nVertices", Pod::I32, 1), counts.collect(), writer),
            of(kind, vec![self.kind.to_vec()], writer),
        ];
        for (name, pod, values) in [
            (".knots", Pod::F32, &self.knots),
            (".orders", Pod::U8, &self.orders),
            ("w", Pod::F32, &self.weights),
        ] {
            let bytes = values.iter().flat_map(|&x| bytes_of(pod, x)).collect();
            geom.push(of(spec(name, pod, 1), vec![bytes], writer));
        }
        if let Some(width) = &self.width {
            geom.push(param(writer, width));
        }
        let params: Vec<Written> = self.params.iter().map(|each| param(writer, each)).collect();
        geom.push(writer.compound(".arbGeomParams", "", &params));
        let geom = writer.compound(".geom", "schema=AbcGeom_Curve_v2", &geom);
        let schema = "schema=AbcGeom_Curve_v2".to_owned();
        writer.object(self.name, schema, &[geom], &[])
    }
}

fn bytes_of(pod: Pod, x: f64) -> Vec<u8> {
    match pod {
        Pod::U8 | Pod::Bool => vec![x as u8],
        Pod::I16 => (x as i16).to_le_bytes().to_vec(),
        Pod::I32 => (x as i32).to_le_bytes().to_vec(),
        Pod::U32 => (x as u32).to_le_bytes().to_vec(),
        Pod::F64 => x.to_le_bytes().to_vec(),
        _ => (x as f32).to_le_bytes().to_vec(),
    }
}

fn param(writer: &mut Writer, (name, scope, pod, extent, values, indices): &Param) -> Written {
    let metadata = format!("geoScope={scope};isGeomParam=true");
    let spec = |name| PropertySpec {
        name,
        pod: *pod,
        extent: *extent,
        metadata: metadata.clone(),
        is_array: true,
        sampling: 0,
    };
    let bytes = values.iter().flat_map(|&x| bytes_of(*pod, x)).collect();
    let values = |name, writer: &mut Writer| {
        writer.property(&spec(name), std::iter::once((Vec::clone(&bytes), 1)))
    };
    let Some(indices) = indices else {
        return values(name, writer);
    };
    let indices: Vec<u8> = indices.iter().flat_map(|ix| ix.to_le_bytes()).collect();
    let of_indices = PropertySpec {
        pod: Pod::U32,
        extent: 1,
        metadata: String::new(),
        ..spec(".indices")
    };
    let parts = [
        values(".vals", writer),
        writer.property(&of_indices, std::iter::once((indices, 1))),
    ];
    writer.compound(name, &metadata, &parts)
}

/// Operations and numbers of a transform, and whether it inherits.
type Ops = (&'static [u8], &'static [f64], bool);

/// Curves below one transform in another.
fn archive(transforms: &[Ops], curves: &[Curves]) -> Vec<u8> {
    let mut writer = Writer::new();
    let mut objects: Vec<WrittenObject> = curves
        .iter()
        .map(|curves| curves.write(&mut writer))
        .collect();
    for (ops, vals, inherits) in transforms.iter().rev() {
        let spec = |name, pod| PropertySpec {
            name,
            pod,
            extent: 1,
            metadata: String::new(),
            is_array: true,
            sampling: 0,
        };
        let mut one = |name, pod, bytes: Vec<u8>| {
            writer.property(&spec(name, pod), std::iter::once((bytes, 1)))
        };
        let properties = [
            one(".inherits", Pod::Bool, vec![u8::from(*inherits)]),
            one(".ops", Pod::U8, ops.to_vec()),
            one(
                ".vals",
                Pod::F64,
                vals.iter().flat_map(|x| x.to_le_bytes()).collect(),
            ),
        ];
        let xform = writer.compound(".xform", "", &properties);
        let schema = "schema=AbcGeom_Xform_v3".to_owned();
        objects = vec![writer.object("x", schema, &[xform], &objects)];
    }
    let top = writer.object("ABC", String::new(), &[], &objects);
    writer.finish(&top, &[(1, 1.0), (9, 0.5)])
}

fn read(bytes: &[u8]) -> Result<Import> {
    let import = AlembicFormat.read(bytes, &ImportOptions::default())?;
    import.groom.validate()?;
    Ok(import)
}

fn groom(curves: &Curves) -> Groom {
    read(&archive(&[], std::slice::from_ref(curves)))
        .unwrap()
        .groom
}

fn refused(curves: &Curves, needle: &str) {
    let error = read(&archive(&[], std::slice::from_ref(curves)))
        .unwrap_err()
        .to_string();
    assert!(error.contains(needle) && error.contains("/hair"), "{error}");
}

fn notes(import: &Import) -> String {
    let lines: Vec<String> = import.notes.iter().map(ToString::to_string).collect();
    lines.join("\n")
}

#[test]
fn every_basis_is_drawn() {
    for (kind, counts, lengths) in [
        (LINEAR, &[2, 5][..], &[2, 5][..]),
        // Blender's label of lines.
        ([1, 0, 3, 3], &[2, 3], &[2, 3]),
        ([1, 1, 0, 0], &[3, 4], &[4, 5]),
        ([0, 0, 1, 1], &[4, 7], &[5, 9]),
        ([0, 1, 1, 1], &[6], &[9]),
        ([0, 0, 2, 2], &[4, 6], &[5, 13]),
        ([0, 1, 2, 2], &[5], &[21]),
        ([0, 0, 3, 3], &[5], &[9]),
        ([0, 1, 3, 3], &[4], &[17]),
    ] {
        let groom = groom(&Curves::new(kind, counts));
        let found: Vec<u32> = groom
            .strand_offsets
            .windows(2)
            .map(|pair| pair[1] - pair[0])
            .collect();
        assert_eq!(found, lengths, "{kind:?}");
    }
    let bezier = groom(&Curves::new([0, 0, 1, 1], &[4]));
    assert_eq!(
        (bezier.points[0], bezier.points[4]),
        ([0.0; 3], [0.0, 3.0, 1.125])
    );
    // The middle of a uniform B-spline: (p0 + 23 p1 + 23 p2 + p3) / 48.
    let spline = groom(&Curves::new([0, 0, 2, 2], &[4]));
    assert_eq!(spline.points[2][1], 1.5);
    let mut other = Curves::new([2, 0, 1, 1], &[4, 3]);
    other.orders = vec![4.0, 2.0];
    assert_eq!(groom(&other).strand_offsets, [0, 5, 8]);
}

#[test]
fn curves_that_are_closed_already_are_closed_once() {
    let mut circle = Curves::new([0, 1, 2, 2], &[11]);
    for (ix, point) in circle.points[0].iter_mut().enumerate() {
        let (sin, cos) = (ix as f32 % 8.0 * std::f32::consts::FRAC_PI_4).sin_cos();
        *point = [cos, 0.0, sin];
    }
    let import = read(&archive(&[], std::slice::from_ref(&circle))).unwrap();
    let points = &import.groom.points;
    assert_eq!(points.len(), 33);
    assert!((0..3).all(|axis| (points[0][axis] - points[32][axis]).abs() < 1e-6));
    assert!(
        notes(&import).contains("not closed a second time"),
        "{}",
        notes(&import)
    );
}

#[test]
fn curves_that_cannot_be_are_refused_by_name() {
    refused(
        &Curves::new([0, 0, 4, 4], &[4]),
        "basis of cubic curves is Hermite",
    );
    refused(
        &Curves::new([0, 0, 0, 0], &[4]),
        "basis of cubic curves is none",
    );
    refused(&Curves::new([3, 0, 1, 1], &[4]), "type of curves is 3");
    refused(&Curves::new([1, 2, 1, 1], &[4]), "wrap of curves is 2");
    let mut curves = Curves::new([0, 0, 2, 2], &[4]);
    curves.knots = vec![0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 1.0];
    refused(&curves, "number of knots is 9, must be 8 or 6");
    curves.knots = vec![0.0, 0.0, 0.0, 2.0, 1.0, 1.0, 1.0, 1.0];
    refused(&curves, "knots of strand 0");
    curves.knots = Vec::new();
    curves.weights = vec![1.0, 0.5, 0.5, 1.0];
    refused(&curves, "weights of rational curves");
    curves.weights = Vec::new();
    curves.orders = vec![3.0];
    refused(&curves, "order of cubic curves is 3");
    curves.kind[0] = 2;
    refused(&curves, "order of curves is 3");
    curves.orders = vec![4.0; 2];
    refused(&curves, "number of orders of curves is 2");
    let mut moving = Curves::new(LINEAR, &[2, 2]);
    moving.counts.push(vec![2, 3]);
    refused(
        &moving,
        "number of points of the strands is another in sample 1",
    );
    let mut few = Curves::new(LINEAR, &[2, 2]);
    few.counts = vec![vec![2, 3]];
    refused(&few, "its 2 curves have 5 points in all, P has 4");
    few.counts = vec![vec![5, -1]];
    refused(&few, "number of points of strand 1 is -1");
}

#[test]
fn numbers_that_are_none_are_named() {
    for bad in [f32::NAN, f32::INFINITY, 1e9] {
        let mut curves = Curves::new(LINEAR, &[2, 3]);
        curves.points[0][3][1] = bad;
        refused(&curves, "/hair: strand 1, point 1");
    }
    let values = vec![1.0, 2.0, 3.0, f64::NAN, 5.0];
    let bad = ("groom_ao", "vtx", Pod::F32, 1, values, None);
    refused(
        &Curves::new(LINEAR, &[2, 3]).with(bad),
        "groom_ao of strand 1, point 1",
    );
    let bad = ("groom_ao", "uni", Pod::F64, 1, vec![1.0, 1e300], None);
    refused(
        &Curves::new(LINEAR, &[2, 3]).with(bad),
        "groom_ao of strand 1",
    );
    let bad = (
        "groom_root_uv",
        "uni",
        Pod::F32,
        2,
        vec![0.0, 1.0],
        Some(vec![0, 1]),
    );
    refused(
        &Curves::new(LINEAR, &[2, 3]).with(bad),
        "has index 1 at 1, and 1 value",
    );
}

#[test]
fn transforms_move_points_and_scale_widths() {
    let mut curves = Curves::new(LINEAR, &[2]);
    curves.points = vec![vec![[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]];
    curves.width = Some(("width", "con", Pod::F32, 1, vec![0.25], None));
    // Outside a translation, inside scaled by 2 and then turned about z: listed last applies first.
    let outer: Ops = (&[0x10], &[5.0, 0.0, 0.0], true);
    let inner: Ops = (&[0x60, 0x00], &[90.0, 2.0, 2.0, 2.0], true);
    let import = read(&archive(&[outer, inner], std::slice::from_ref(&curves))).unwrap();
    assert_eq!(import.groom.points, [[5.0, 2.0, 0.0], [3.0, 0.0, 0.0]]);
    let diameter = import.groom.attribute("diameter").unwrap();
    assert_eq!(
        (diameter.domain, &diameter.data[..]),
        (Domain::Groom, &[0.5][..])
    );
    let alone: Ops = (&[0x00], &[3.0, 3.0, 3.0], false);
    let import = read(&archive(&[outer, alone], std::slice::from_ref(&curves))).unwrap();
    assert_eq!(import.groom.points[0], [3.0, 0.0, 0.0]);

    let fails = |ops: Ops, needle: &str| {
        let error = read(&archive(&[ops], std::slice::from_ref(&curves))).unwrap_err();
        assert!(error.to_string().contains(needle), "{error}");
    };
    fails((&[0x10], &[1.0, 2.0], true), "lacks numbers");
    fails((&[0x70], &[1.0, 2.0], true), "unknown operation, 7");
    fails((&[0x10], &[1.0, f64::NAN, 0.0], true), "finite and affine");
    fails((&[0x20], &[0.0, 0.0, 0.0, 5.0], true), "finite and affine");
    fails(
        (&[0x00], &[1.0, 0.0, 1.0], true),
        "its transform makes it flat",
    );
}

#[test]
fn values_are_told_apart_by_their_number() {
    let hair = || Curves::new(LINEAR, &[2, 3]);
    let domain =
        |param: Param, name: &str| groom(&hair().with(param)).attribute(name).map(|a| a.domain);
    let floats = |n: usize| (0..n).map(|ix| ix as f64 / 8.0).collect::<Vec<f64>>();
    for (scope, n, wanted) in [
        ("con", 5, Some(Domain::Point)),
        ("con", 2, Some(Domain::Strand)),
        ("vtx", 2, Some(Domain::Strand)),
        ("uni", 1, Some(Domain::Groom)),
        ("xyz", 5, Some(Domain::Point)),
        ("vtx", 4, None),
        ("vtx", 0, None),
    ] {
        let param = ("groom_ao", scope, Pod::F32, 1, floats(n), None);
        assert_eq!(domain(param, "ao"), wanted, "{scope} {n}");
    }
    let uv = (
        "st",
        "uni",
        Pod::F64,
        2,
        vec![0.5, 0.25, 0.75, 1.0],
        Some(vec![1, 0]),
    );
    let groom = groom(&hair().with(uv));
    assert_eq!(
        groom.attribute("root_uv").unwrap().data,
        [0.75, 1.0, 0.5, 0.25]
    );
    let big = (
        "Clump ID",
        "uni",
        Pod::I32,
        1,
        vec![16_777_217.0, 1.0],
        None,
    );
    let import = read(&archive(&[], &[hair().with(big)])).unwrap();
    assert_eq!(import.groom.attributes, []);
    assert!(notes(&import).contains("16777217"), "{}", notes(&import));
    // Four numbers of a colour are three, one is none.
    let color = (
        "groom_color",
        "con",
        Pod::F32,
        4,
        vec![0.5, 0.25, 0.125, 1.0],
        None,
    );
    let import = read(&archive(&[], &[hair().with(color)])).unwrap();
    assert_eq!(
        import.groom.attribute("color").unwrap().data,
        [0.5, 0.25, 0.125]
    );
    assert!(
        notes(&import).contains("the first 3 of 4"),
        "{}",
        notes(&import)
    );
    let color = ("groom_color", "con", Pod::F32, 1, vec![0.5], None);
    assert_eq!(domain(color, "color"), None);
}

#[test]
fn widths_that_cannot_be_drawn_are_left_out() {
    let read_widths = |widths: Vec<f64>| {
        let mut curves = Curves::new(LINEAR, &[2, 3]);
        curves.width = Some(("width", "vtx", Pod::F32, 1, widths, None));
        let import = read(&archive(&[], &[curves])).unwrap();
        let data = import.groom.attribute("diameter").map(|a| a.data.clone());
        (data, notes(&import))
    };
    let (data, notes) = read_widths(vec![0.5, 0.25, 0.5, 0.25, 0.0]);
    assert_eq!(data.unwrap()[4], 1e-6);
    assert!(notes.contains("1 of 5 widths are 0"), "{notes}");
    for widths in [vec![0.0; 5], vec![20.0; 5], vec![-1.0; 5]] {
        let (data, notes) = read_widths(widths);
        assert!(
            data.is_none() && notes.contains("cannot be drawn"),
            "{notes}"
        );
    }
}

#[test]
fn guides_are_marked() {
    let guides = |value| ("groom_guide", "con", Pod::I16, 1, vec![value], None);
    let all = Curves::new(LINEAR, &[2, 3]).with(guides(1.0));
    let guide = |objects: &[Curves]| {
        let import = read(&archive(&[], objects)).unwrap();
        let guide = import.groom.attribute("guide").unwrap();
        assert!(!notes(&import).contains("guide"), "{}", notes(&import));
        (guide.domain, guide.data.clone())
    };
    assert_eq!(
        guide(std::slice::from_ref(&all)),
        (Domain::Groom, vec![1.0])
    );
    let mut strands = Curves::new(LINEAR, &[4]);
    strands.name = "strands";
    assert_eq!(
        guide(&[all, strands]),
        (Domain::Strand, vec![1.0, 1.0, 0.0])
    );
}

#[test]
fn several_objects_are_one_groom() {
    let named = |name, counts: &[i32]| {
        let mut curves = Curves::new(LINEAR, counts);
        curves.name = name;
        curves
    };
    let ao = ("groom_ao", "con", Pod::F32, 1, vec![0.5], None);
    let empty = named("empty", &[]);
    let files = [named("a", &[2, 2]).with(ao), empty, named("b", &[3, 1])];
    let bytes = archive(&[(&[], &[], true)], &files);
    let import = read(&bytes).unwrap();
    let groom = &import.groom;
    assert_eq!(groom.strand_offsets, [0, 2, 4, 7]);
    assert_eq!(groom.attribute("group_id").unwrap().data, [0.0, 0.0, 1.0]);
    assert_eq!(groom.attribute("ao").unwrap().data, [0.5, 0.5, 0.0]);
    let text = notes(&import);
    for needle in [
        "/x/empty: left out",
        "1 of 2 curves",
        "\"ao\" is missing",
        "/x/a and 1 more",
    ] {
        assert!(text.contains(needle), "{needle}: {text}");
    }
    let name = |id: &str| {
        let mut found = groom.source.parameters.iter();
        found
            .find(|(name, _)| name == id)
            .map(|(_, value)| value.clone())
    };
    assert_eq!(name("group_name.1").as_deref(), Some("/x/b"));
    for path in ["/x/b", "x/b/", "/x/b/"] {
        let options = ImportOptions::default().with_object(path);
        let one = AlembicFormat.read(&bytes, &options).unwrap().groom;
        assert_eq!(one.strand_offsets, [0, 3], "{path}");
    }
    let options = ImportOptions::default().with_object("/x/bb");
    let error = AlembicFormat
        .read(&bytes, &options)
        .unwrap_err()
        .to_string();
    assert!(error.contains("/x/a, /x/empty, /x/b"), "{error}");
}

#[test]
fn data_is_not_used_without_end() {
    // A hundred objects that share their points: what a short file can do to memory.
    let mut curves = Curves::new(LINEAR, &[2; 10_000]);
    let names: Vec<&'static str> = (0..100)
        .map(|ix| &*Box::leak(format!("hair{ix}").into_boxed_str()))
        .collect();
    let all: Vec<Curves> = names
        .into_iter()
        .map(|name| {
            curves.name = name;
            curves.clone()
        })
        .collect();
    assert!(read(&archive(&[], &all[..5])).is_ok());
    let error = read(&archive(&[], &all)).unwrap_err().to_string();
    assert!(error.contains("over and over"), "{error}");
}

#[test]
fn objects_in_themselves_are_refused() {
    let mut bytes = archive(&[(&[], &[], true)], &[Curves::new(LINEAR, &[2])]);
    // The top object's group holds its properties, one child, and headers; the child becomes itself.
    let at = |bytes: &[u8], offset: usize| {
        u64::from_le_bytes(bytes[offset..offset + 8].try_into().unwrap()) as usize
    };
    let root = at(&bytes, 8);
    let top = at(&bytes, root + 8 + 16);
    bytes[top + 16..top + 24].copy_from_slice(&(top as u64).to_le_bytes());
    let error = read(&bytes).unwrap_err().to_string();
    assert!(error.contains("nested"), "{error}");
}

#[test]
fn samples_are_those_of_the_time() {
    let mut curves = Curves::new(LINEAR, &[2]);
    let still = curves.points[0].clone();
    let moved: Vec<[f32; 3]> = still.iter().map(|p| [p[0] + 1.0, p[1], p[2]]).collect();
    curves.points = vec![still.clone(), moved.clone(), moved.clone(), still.clone()];
    let bytes = archive(&[], std::slice::from_ref(&curves));
    assert_eq!(
        AlembicFormat.frame_times(&bytes).unwrap(),
        [0.0, 0.5, 1.0, 1.5]
    );
    for (ix, wanted) in (0..).zip([&still, &moved, &moved, &still]) {
        let options = ImportOptions::default().with_frame(ix);
        let found = AlembicFormat.read(&bytes, &options).unwrap().groom;
        assert_eq!(found.points, wanted[..]);
    }
}

#[test]
fn a_frame_is_one_moment_whichever_object_is_read() {
    let mut moving = Curves::new(LINEAR, &[2]);
    let first = moving.points[0].clone();
    let second: Vec<[f32; 3]> = first.iter().map(|p| [p[0] + 1.0, p[1], p[2]]).collect();
    moving.points.push(second.clone());
    let mut still = Curves::new(LINEAR, &[3]);
    still.name = "still";
    let bytes = archive(&[], &[moving, still.clone()]);
    let read = |path: &str, frame| {
        let options = ImportOptions::default().with_object(path).with_frame(frame);
        let import = AlembicFormat.read(&bytes, &options)?;
        Result::Ok(import.groom.points)
    };
    for (frame, moved) in (0..).zip([first, second]) {
        assert_eq!(read("/hair", frame).unwrap(), moved);
        assert_eq!(read("/still", frame).unwrap(), still.points[0]);
    }
    assert!(read("/still", 2).is_err());
}

//! USD files: in from text, binary and packages, out as text, and every damage.

use proptest::prelude::*;
use strandlight_formats::{
    Attribute, BakedFile, Domain, Error, Export, ExportOptions, FileKind, Groom, GroomFormat,
    Import, ImportOptions, NoteKind, Result, SourceFile, StatedBy, UpAxis, groom_format,
};

/// One scene in every encoding: a pinned B-spline and, in a variant, moving lines below a moving
/// transform; a mesh, a class, a blocked prim, a reference. Binary ones are by Pixar's library.
const TEXT: &[u8] = include_bytes!("data/hair.usda");
const BINARY: &[u8] = include_bytes!("data/hair_0_8_0.usdc");
const PACKAGE: &[u8] = include_bytes!("data/hair.usdz");
const FILES: [&[u8]; 5] = [
    TEXT,
    BINARY,
    include_bytes!("data/hair_0_4_0.usdc"),
    include_bytes!("data/hair_0_0_1.usdc"),
    PACKAGE,
];

fn format() -> &'static dyn GroomFormat {
    groom_format("usd").unwrap()
}

fn import_with(bytes: &[u8], options: &ImportOptions) -> Result<Import> {
    SourceFile::from_bytes(bytes)?.import(options)
}

fn import(text: &str) -> Result<Import> {
    import_with(text.as_bytes(), &ImportOptions::default())
}

/// A file of one prim of linear curves with two strands of three points, and `more`.
fn lines(more: &str) -> String {
    format!(
        "#usda 1.0
def BasisCurves \"hair\" {{
    uniform token type = \"linear\"
    int[] curveVertexCounts = [3, 3]
    point3f[] points = [(0, 0, 0), (0, 1, 0), (0, 2, 0), (1, 0, 0), (1, 1, 0), (1, 2, .5)]
    {more}
}}
"
    )
}

fn notes(import: &Import) -> Vec<&str> {
    import.notes.iter().map(|note| &*note.text).collect()
}

fn error(text: &str) -> String {
    import(text).unwrap_err().to_string()
}

fn export(groom: &Groom, options: &ExportOptions) -> (String, Export) {
    let export = groom.export(format(), options).unwrap();
    (String::from_utf8(export.bytes.clone()).unwrap(), export)
}

fn assert_near(a: [f32; 3], b: [f32; 3]) {
    let far = (0..3).map(|ix| (a[ix] - b[ix]).abs()).fold(0.0, f32::max);
    assert!(far < 1e-4, "{a:?} {b:?}");
}

#[test]
fn all_encodings_hold_the_same() {
    let expected = import_with(TEXT, &ImportOptions::default()).unwrap();
    assert_eq!(
        (expected.unit_by, expected.up_by),
        (StatedBy::File, StatedBy::File)
    );
    let groom = &expected.groom;
    assert_eq!(
        (groom.source.cm_per_unit, groom.source.up),
        (100.0, UpAxis::Z)
    );
    // Lines, of the variant, come first; then splines of 3, 4 and 1 segments and 4 pieces each.
    assert_eq!(groom.n_strands(), 20);
    assert_eq!(groom.points.len(), 35 + 13 + 17 + 5);
    // (1, 0, 1) turns to (1, -1, 0) about x, then moves up by 1.5; z up becomes y up.
    assert_near(groom.points[3], [100.0, 150.0, 100.0]);
    assert_near(groom.points[69], [50.0, 150.0, 0.0]);
    let diameter = groom.attribute("diameter").unwrap();
    assert_eq!(diameter.domain, Domain::Point);
    assert_eq!(diameter.data[1..3], [0.02, 0.01]);
    assert_eq!(groom.attribute("color").unwrap().data, [0.25, 0.5, 0.75]);
    let group = groom.attribute("group_id").unwrap();
    assert_eq!(
        (group.domain, group.data[16], group.data[17]),
        (Domain::Strand, 0.0, 1.0)
    );
    assert_eq!(
        notes(&expected),
        [
            "primvars:label of /head/spline left out: it is text",
            "/blocked is skipped: it has no points",
            "1 Mesh left out: /head/scalp",
            "@./more.usda@, @./body.usda@ are not followed: flatten the file with `usdcat --flatten`",
            "2 prims are merged; their group_id: 0 /head/lines, 1 /head/spline",
            "attribute clump left out: /head/spline has none",
            "attribute root_uv left out: /head/lines has none",
        ]
    );
    for bytes in FILES {
        for frame in 0..3 {
            let options = ImportOptions::default().with_frame(frame);
            let wanted = import_with(TEXT, &options).unwrap();
            let mut found = import_with(bytes, &options).unwrap();
            assert_eq!(found.groom.source.hash.len(), 16);
            found.groom.source.hash = wanted.groom.source.hash.clone();
            assert_eq!(found, wanted);
        }
        let file = SourceFile::from_bytes(bytes).unwrap();
        assert_eq!(file.frame_times().unwrap(), [0.0, 0.2, 0.4]);
    }
}

#[test]
fn one_object_is_read_with_all_its_values() {
    for bytes in FILES {
        let options = ImportOptions::default().with_object("/head/spline");
        let groom = import_with(bytes, &options).unwrap().groom;
        assert_eq!(groom.n_strands(), 3);
        let uv = groom.attribute("root_uv").unwrap();
        assert_eq!((uv.domain, uv.components), (Domain::Strand, 2));
        assert_eq!(uv.data, [1.0, 0.5, 0.0, 0.0, 1.0, 0.5]);
        assert_eq!(groom.attribute("diameter").unwrap().data, [0.01]);
        let parameters = &groom.source.parameters;
        assert_eq!(
            parameters[0],
            ("curves".to_owned(), "pinned bspline".to_owned())
        );

        let options = ImportOptions::default().with_object("/head/lines");
        let groom = import_with(bytes, &options).unwrap().groom;
        let clump = groom.attribute("clump").unwrap();
        assert_eq!(clump.data, (0..17).map(|ix| ix as f32).collect::<Vec<_>>());
        let all = ImportOptions::default().with_object("/head/");
        assert_eq!(import_with(bytes, &all).unwrap().groom.n_strands(), 20);
        for object in ["/head/line", "/scalp", "/head/lines/x"] {
            let options = ImportOptions::default().with_object(object);
            let error = import_with(bytes, &options).unwrap_err().to_string();
            assert!(error.contains("/head/lines, /head/spline"), "{error}");
        }
    }
}

#[test]
fn frames_move_points_and_transforms() {
    for bytes in FILES {
        let frame = |frame| {
            let options = ImportOptions::default().with_frame(frame);
            import_with(bytes, &options)
        };
        // At 5 the lines are twice as long, and the transform is halfway to y = 1.
        let groom = frame(1).unwrap().groom;
        assert_near(groom.points[3], [100.0, 150.0, 150.0]);
        let groom = frame(2).unwrap().groom;
        assert_near(groom.points[3], [100.0, 150.0, 100.0]);
        let error = frame(3).unwrap_err().to_string();
        assert_eq!(error, "frame is 3, must be in 0..=2");
    }
}

#[test]
fn samples_are_interpolated_or_held() {
    let text = lines("").replace("points = [", "points.timeSamples = { 8: None, 4: [(4, 4, 4), (0, 1, 0), (0, 2, 0), (1, 0, 0), (1, 1, 0), (1, 2, 0)], 0: [");
    let text = text.replace("(1, 2, .5)]", "(1, 2, .5)] }\n    double3 xformOp:translate.timeSamples = { 2: (0, 0, 0), 4: (0, 0, 2) }\n    uniform token[] xformOpOrder = [\"xformOp:translate\"]");
    let file = SourceFile::from_bytes(text.as_bytes()).unwrap();
    let times = file.frame_times().unwrap();
    assert_eq!(times, [0.0, 2.0, 4.0, 8.0].map(|code| code / 24.0));
    let point = |frame| {
        let options = ImportOptions::default().with_frame(frame);
        file.import(&options).map(|import| import.groom.points[0])
    };
    assert_eq!(point(0).unwrap(), [0.0; 3]);
    assert_eq!(point(1).unwrap(), [2.0; 3]);
    assert_eq!(point(2).unwrap(), [4.0, 4.0, 6.0]);
    // Taken back: there is no hair then.
    assert!(
        point(3)
            .unwrap_err()
            .to_string()
            .contains("it has no points")
    );

    let text = lines("").replace(
        "curveVertexCounts = [3, 3]",
        "curveVertexCounts.timeSamples = { 1: [3, 3], 2: [2, 4] }",
    );
    assert_eq!(
        error(&text),
        "curveVertexCounts of /hair is changing over time, must be the same at all times: hair whose strands change \
         cannot be imported"
    );
}

#[test]
fn units_and_axes_are_the_options_or_the_files_or_the_formats() {
    let plain = import(&lines("")).unwrap();
    assert_eq!(
        (plain.unit_by, plain.up_by),
        (StatedBy::Convention, StatedBy::Convention)
    );
    assert_eq!(plain.groom.points[5], [1.0, 2.0, 0.5]);
    let stated = lines("").replace("1.0\n", "1.0\n(metersPerUnit = 0.0254 upAxis = \"Z\")\n");
    let import = import(&stated).unwrap();
    assert_eq!(
        (import.unit_by, import.up_by),
        (StatedBy::File, StatedBy::File)
    );
    assert_eq!(import.groom.points[5], [2.54, 1.27, -5.08]);
    let options = ImportOptions::default().with_unit(10.0).with_up(UpAxis::Y);
    let import = import_with(stated.as_bytes(), &options).unwrap();
    assert_eq!(
        (import.unit_by, import.up_by),
        (StatedBy::Options, StatedBy::Options)
    );
    assert_eq!(import.groom.points[5], [10.0, 20.0, 5.0]);
    for (key, what) in [
        ("metersPerUnit = 0", "metersPerUnit"),
        ("metersPerUnit = nan", "metersPerUnit"),
        ("upAxis = \"W\"", "upAxis"),
    ] {
        let text = lines("").replace("1.0\n", &format!("1.0\n({key})\n"));
        assert!(error(&text).starts_with(what), "{}", error(&text));
    }
}

#[test]
fn widths_go_by_their_number_and_scale() {
    let widths = |more: &str| {
        let import = import(&lines(more)).unwrap();
        let diameter = import.groom.attribute("diameter").cloned();
        (diameter.map(|d| (d.domain, d.data)), import)
    };
    // Labels of the wrong interpolation, as Blender writes them, do not matter.
    for (values, label, domain) in [
        ("[1]", "vertex", Domain::Groom),
        ("[1, 2]", "constant", Domain::Strand),
        ("[1, 2, 3, 4, 5, 6]", "constant", Domain::Point),
    ] {
        let more = format!("float[] widths = {values} (interpolation = \"{label}\")");
        assert_eq!(widths(&more).0.unwrap().0, domain);
    }
    let more = "float[] widths = [.5, 0] float3 xformOp:scale = (2, 2, -2) token[] xformOpOrder = [\"xformOp:scale\"]";
    let (diameter, import) = widths(more);
    assert_eq!(diameter.unwrap(), (Domain::Strand, vec![1.0, 1e-6]));
    assert!(notes(&import)[0].starts_with("1 of 2 widths are drawn 0.000001 cm thick"));
    for bad in ["[-1, 1]", "[1, 11]", "[nan, 1]", "[0, 0]"] {
        let (diameter, import) = widths(&format!("float[] widths = {bad}"));
        assert!(diameter.is_none());
        assert!(notes(&import)[0].starts_with("widths left out"), "{bad}");
    }
    let (_, import) = widths("float[] widths = [1, 2, 3]");
    assert_eq!(
        notes(&import),
        ["widths of /hair left out: 3 values fit neither curves nor points"]
    );
    // A primvar is stronger.
    let (diameter, _) = widths("float[] widths = [1] float[] primvars:widths = [2]");
    assert_eq!(diameter.unwrap().1, [2.0]);
}

#[test]
fn primvars_become_attributes_under_one_name() {
    let import = import(&lines(
        "color3f[] primvars:Cd = [(1, 0, 0)]
    int[] primvars:groom_group_id = [3, 4] (interpolation = \"uniform\")
    float3[] primvars:surface_uv_coordinate = [(.1, .2, 0), (.3, .4, 0)] (interpolation = \"uniform\")
    double2[] primvars:clumpID = [(1, 2)]
    int64[] primvars:groom_id = [16777217, 1]
    float[] primvars:bad = [1, inf]
    float4[] primvars:dye = [(60, 0, 0, 1)]
    matrix4d primvars:m = ( (1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1) )
    float[] primvars:none = None
    float[] primvars:packed = [1, 2, 3, 4, 5, 6] (elementSize = 3)
    normal3f[] normals = [(0, 0, 1)]",
    ))
    .unwrap();
    let found = import
        .groom
        .attributes
        .iter()
        .map(|a| (&*a.name, a.domain, a.components));
    assert_eq!(
        found.collect::<Vec<_>>(),
        [
            ("clumpid", Domain::Groom, 2),
            ("color", Domain::Groom, 3),
            ("group_id", Domain::Strand, 1),
            ("packed", Domain::Strand, 3),
            ("root_uv", Domain::Strand, 2),
        ]
    );
    assert_eq!(
        import.groom.attribute("root_uv").unwrap().data,
        [0.1, 0.2, 0.3, 0.4]
    );
    let left_out = notes(&import);
    for (start, n) in [
        ("primvars:bad of /hair", 1),
        ("primvars:dye", 1),
        ("primvars:m ", 1),
        ("primvars:groom_id", 1),
        ("normals", 1),
        ("primvars:none", 0),
    ] {
        let found = left_out
            .iter()
            .filter(|note| note.starts_with(start))
            .count();
        assert_eq!(found, n, "{start}: {left_out:?}");
    }
    let indices = lines("int[] primvars:a = [1, 2] int[] primvars:a:indices = [0, 2]");
    assert_eq!(error(&indices), "primvars:a:indices is 2, must be below 2");
}

#[test]
fn guides_are_marked() {
    let guides = |values: &str| {
        import(&lines(&format!(
            "int[] primvars:groom_guide = {values} (interpolation = \"uniform\")"
        )))
        .unwrap()
    };
    for (values, marks) in [("[1, 1]", [1.0, 1.0]), ("[1, 0]", [1.0, 0.0])] {
        let import = guides(values);
        assert_eq!(notes(&import), [""; 0]);
        assert_eq!(import.groom.n_strands(), 2);
        let guide = import.groom.attribute("guide").expect("it is kept");
        assert_eq!(
            (guide.domain, &guide.data[..]),
            (Domain::Strand, &marks[..])
        );
    }
}

#[test]
fn what_is_not_there_is_told() {
    let reference = "#usda 1.0\ndef Xform \"head\" ( payload = @hair/long.usdc@ ) {}\n";
    let text = error(reference);
    assert!(text.contains("@hair/long.usdc@ is not followed"), "{text}");
    assert!(text.contains("usdcat --flatten"), "{text}");
    for hidden in ["over", "class"] {
        let text = lines("").replace("def", hidden);
        assert!(
            error(&text).starts_with("number of BasisCurves"),
            "{}",
            error(&text)
        );
    }
    let inactive = lines("").replace("\"hair\"", "\"hair\" ( active = false )");
    assert!(import(&inactive).is_err());
    let empty = lines("").replace("[3, 3]", "[]");
    assert!(error(&empty).contains("/hair is skipped: it has no curveVertexCounts"));
    let purpose = import(&lines("uniform token purpose = \"proxy\"")).unwrap();
    assert_eq!(
        notes(&purpose),
        ["the purpose of /hair is proxy, not to be rendered"]
    );
    let open = lines("variantSet \"a\" = { \"b\" { float x = 1 } }");
    assert_eq!(
        notes(&import(&open).unwrap()),
        ["1 set of variants has none chosen and is left out"]
    );
}

#[test]
fn curves_that_make_no_sense_are_refused_or_told() {
    for (from, to, what) in [
        (
            "[3, 3]",
            "[3, 4]",
            "points of /hair is 6 of 3 numbers, must be 7 of 3",
        ),
        ("[3, 3]", "[-3, 9]", "points of /hair"),
        ("[3, 3]", "[1e300, 3]", "points of /hair"),
        ("(0, 1, 0)", "(0, nan, 0)", "point 1 of curve 0 of /hair"),
        ("(1, 2, .5)", "(1, 1e6, 0)", "point 2 of curve 1 of /hair"),
        ("(1, 2, .5)", "(1, 2)", "line 5"),
        ("\"linear\"", "\"straight\"", "type of /hair is straight"),
    ] {
        let text = error(&lines("").replace(from, to));
        assert!(text.starts_with(what), "{text}");
    }
    let short = import(&lines("").replace("[3, 3]", "[1, 5]")).unwrap();
    assert_eq!(short.groom.n_strands(), 1);
    assert!(notes(&short)[0].starts_with("1 curves of /hair left out"));
    // Of two cubic curves of three points nothing can be drawn.
    let cubic = lines("").replace("uniform token type = \"linear\"", "");
    assert!(error(&cubic).contains("none of its curves has enough points"));
    for op in ["xformOp:shear", "xformOp:rotateX", "!invert!xformOp:scale"] {
        let name = op.trim_start_matches("!invert!");
        let text = lines(&format!(
            "float3 {name} = (0, 0, 0) token[] xformOpOrder = [\"{op}\"]"
        ));
        assert!(
            error(&text).starts_with(&format!("{name} of /hair")),
            "{}",
            error(&text)
        );
    }
    let few = ImportOptions::default().with_max_points(5);
    assert!(import_with(lines("").as_bytes(), &few).is_err());
}

#[test]
fn packages_and_other_archives_are_told_apart() {
    assert_eq!(FileKind::of(PACKAGE).name(), "a USD file");
    let mut other = PACKAGE.to_vec();
    other[35..39].copy_from_slice(b".txt");
    assert_eq!(FileKind::of(&other).name(), "a zip archive");
    let mut compressed = PACKAGE.to_vec();
    compressed[8] = 8;
    let refused = import_with(&compressed, &ImportOptions::default()).unwrap_err();
    assert!(refused.to_string().contains("compressed"), "{refused}");
    let mut newer = BINARY.to_vec();
    newer[9] = 99;
    let refused = import_with(&newer, &ImportOptions::default()).unwrap_err();
    assert!(
        matches!(refused, Error::UnsupportedVersion { .. }),
        "{refused}"
    );
}

fn groom() -> Groom {
    let attribute = |name: &str, domain, components, data: &[f32]| Attribute {
        name: name.to_owned(),
        domain,
        components,
        data: data.to_vec(),
    };
    Groom {
        points: vec![
            [0.0, 1.0, 2.0],
            [0.1, 1e-7, -3.5],
            [1.0, 2.0, 3.0],
            [1.0, 3.0, 3.0],
            [2.0, 3.0, 3.0],
        ],
        strand_offsets: vec![0, 2, 5],
        attributes: vec![
            attribute("color", Domain::Strand, 3, &[0.1, 0.2, 0.3, 1.0, 1.0, 1.0]),
            attribute(
                "diameter",
                Domain::Point,
                1,
                &[0.01, 0.008, 0.01, 0.02, 0.001],
            ),
            attribute("dye", Domain::Groom, 4, &[0.5, 0.25, 0.125, 1.0]),
            attribute("group_id", Domain::Strand, 1, &[7.0, 8.0]),
            attribute("root_uv", Domain::Strand, 2, &[0.25, 0.5, 0.75, 1.0]),
            attribute("shift_scale", Domain::Point, 1, &[1.0, 1.1, 1.2, 1.3, 1.4]),
            attribute("width_scale", Domain::Strand, 1, &[0.5, 2.0]),
        ],
        ..Groom::default()
    }
}

#[test]
fn what_goes_out_is_what_others_read() {
    let (text, export) = export(&groom(), &ExportOptions::default());
    assert!(export.dropped.is_empty() && export.notes.is_empty());
    assert_eq!(
        text,
        "#usda 1.0
(
    defaultPrim = \"groom\"
    metersPerUnit = 0.01
    upAxis = \"Y\"
)

def Xform \"groom\" (
    kind = \"component\"
)
{
    def BasisCurves \"hair\"
    {
        int[] curveVertexCounts = [2, 3]
        float3[] extent = [(-0.01, -0.0099999, -3.51), (2.01, 3.01, 3.01)]
        point3f[] points = [(0, 1, 2), (0.1, 0.0000001, -3.5), (1, 2, 3), (1, 3, 3), (2, 3, 3)]
        float[] widths = [0.01, 0.008, 0.01, 0.02, 0.001] (
            interpolation = \"vertex\"
        )
        color3f[] primvars:groom_color = [(0.1, 0.2, 0.3), (1, 1, 1)] (
            interpolation = \"uniform\"
        )
        color3f[] primvars:displayColor = [(0.1, 0.2, 0.3), (1, 1, 1)] (
            interpolation = \"uniform\"
        )
        float4[] primvars:dye = [(0.5, 0.25, 0.125, 1)] (
            interpolation = \"constant\"
        )
        int[] primvars:groom_group_id = [7, 8] (
            interpolation = \"uniform\"
        )
        texCoord2f[] primvars:groom_root_uv = [(0.25, 0.5), (0.75, 1)] (
            interpolation = \"uniform\"
        )
        float[] primvars:shift_scale = [1, 1.1, 1.2, 1.3, 1.4] (
            interpolation = \"vertex\"
        )
        float[] primvars:width_scale = [0.5, 2] (
            interpolation = \"uniform\"
        )
        uniform token type = \"linear\"
    }
}
"
    );
    let options = ExportOptions::default().with_unit(100.0).with_up(UpAxis::Z);
    let (text, _) = self::export(&groom(), &options);
    assert!(text.contains("metersPerUnit = 1\n") && text.contains("upAxis = \"Z\""));
    assert!(text.contains("points = [(0, -0.02, 0.01), "), "{text}");
    assert!(text.contains("widths = [0.0001, "), "{text}");
    let (text, export) = self::export(&groom(), &ExportOptions::default().with_up(UpAxis::X));
    assert!(text.contains("upAxis = \"Y\"") && export.notes.len() == 1);
}

#[test]
fn a_groom_comes_back_as_it_was() {
    let before = groom();
    let (text, _) = export(&before, &ExportOptions::default());
    let back = import(&text).unwrap();
    assert_eq!(notes(&back), [""; 0]);
    let back = back.groom;
    assert_eq!(back.points, before.points);
    assert_eq!(back.strand_offsets, before.strand_offsets);
    assert_eq!(back.attributes, before.attributes);
    let stored = Groom::from_bytes(&back.to_bytes().unwrap()).unwrap();
    assert_eq!(export(&stored, &ExportOptions::default()).0, text);

    // Of a file in another unit and axis, that unit and axis again.
    let stated = import_with(TEXT, &ImportOptions::default()).unwrap().groom;
    let (text, _) = export(&stated, &ExportOptions::default());
    assert!(text.contains("metersPerUnit = 1\n") && text.contains("upAxis = \"Z\""));
    let again = import(&text).unwrap().groom;
    for (a, b) in again.points.iter().zip(&stated.points) {
        assert_near(*a, *b);
    }
    assert_eq!(again.attribute("color"), stated.attribute("color"));
}

#[test]
fn names_that_usd_does_not_have_are_changed_and_told() {
    let mut groom = groom();
    groom.attributes.truncate(0);
    for name in ["widths", "2nd", "guide"] {
        groom.attributes.push(Attribute {
            name: name.to_owned(),
            domain: Domain::Groom,
            components: 1,
            data: vec![0.5],
        });
    }
    let (text, export) = export(&groom, &ExportOptions::default());
    for name in [
        "float[] primvars:_widths",
        "float[] primvars:_2nd",
        "float[] primvars:groom_guide",
    ] {
        assert!(text.contains(name), "{text}");
    }
    assert_eq!(export.notes.len(), 3, "{:?}", export.notes);
    assert_eq!(export.notes[0].kind, NoteKind::Dropped);
}

#[test]
fn frames_go_out_and_come_back() {
    let mut frames = vec![groom(), groom(), groom()];
    for (ix, frame) in frames.iter_mut().enumerate() {
        frame.points[1][0] += ix as f32;
    }
    let export = Groom::export_frames(&frames, 25.0, format(), &ExportOptions::default()).unwrap();
    let text = String::from_utf8(export.bytes.clone()).unwrap();
    for line in [
        "endTimeCode = 2",
        "timeCodesPerSecond = 25",
        "point3f[] points.timeSamples = {",
        "            2: [(0, 1, 2), (2.1, ",
    ] {
        assert!(text.contains(line), "{text}");
    }
    let file = SourceFile::from_bytes(export.bytes).unwrap();
    assert_eq!(file.frame_times().unwrap(), [0.0, 0.04, 0.08]);
    for (ix, frame) in (0u32..).zip(&frames) {
        let import = file
            .import(&ImportOptions::default().with_frame(ix))
            .unwrap();
        assert_eq!(import.groom.points, frame.points);
        assert_eq!(import.groom.attributes, frame.attributes);
    }
    let one =
        Groom::export_frames(&frames[..1], 25.0, format(), &ExportOptions::default()).unwrap();
    assert_eq!(
        one,
        frames[0]
            .export(format(), &ExportOptions::default())
            .unwrap()
    );
}

/// What holds for any bytes: an error, or a groom that keeps its promises, goes out and comes back.
fn check(bytes: &[u8]) -> bool {
    let _ = format().frame_times(bytes);
    let Ok(import) = format().read(
        bytes,
        &ImportOptions::default().with_unit(1.0).with_up(UpAxis::Y),
    ) else {
        return false;
    };
    let groom = import.groom;
    if groom.validate().is_err() {
        return false;
    }
    let (text, _) = export(&groom, &ExportOptions::default());
    let back = self::import(&text).unwrap().groom;
    assert!(back.points == groom.points && back.strand_offsets == groom.strand_offsets);
    true
}

#[test]
fn every_truncation_is_an_error() {
    for bytes in FILES {
        assert!(check(bytes));
        for end in 0..bytes.len() {
            let cut = &bytes[..end];
            let count = |byte| cut.iter().filter(|&&b| b == byte).count();
            // A text may end after each prim, a package before its directory, which is not read.
            let may_end = match bytes {
                TEXT => count(b'{') == count(b'}'),
                PACKAGE => end > BINARY.len(),
                _ => false,
            };
            assert!(may_end || !check(cut), "{end} of {}", bytes.len());
        }
    }
}

#[test]
fn absurd_numbers_are_errors_in_little_memory() {
    for bytes in &FILES[1..4] {
        for at in 0..bytes.len() - 8 {
            for number in [u64::MAX, 1 << 40, 1 << 31, 0x7fff_ffff_ffff_ffff] {
                let mut changed = bytes.to_vec();
                changed[at..at + 8].copy_from_slice(&number.to_le_bytes());
                check(&changed);
            }
        }
    }
}

#[test]
fn what_is_shared_too_often_is_an_error() {
    // Each prim inherits what takes a while to read: time would grow as the square of the length.
    let many = "0.5, ".repeat(100_000);
    let prims: String = (0..2_000)
        .map(|ix| {
            format!(
                "def BasisCurves \"c{ix}\" {{ token type = \"linear\" int[] curveVertexCounts = [2]
                point3f[] points = [(0, 0, 0), (0, 1, 0)] }}\n"
            )
        })
        .collect();
    let text = format!("#usda 1.0\ndef \"a\" {{ float[] primvars:x = [{many}]\n{prims} }}");
    assert!(error(&text).contains("more often"), "{}", error(&text));
    let text = text.replace(&many, "0.5");
    let import = import(&text).unwrap();
    assert_eq!(import.groom.n_strands(), 2_000);
    assert_eq!(import.groom.attribute("x").unwrap().data, [0.5]);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn changed_files_break_no_promise(
        file in 0..FILES.len(),
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>(), 0..3u8), 1..5),
    ) {
        let mut bytes = FILES[file].to_vec();
        for (at, value, how) in changes {
            let at = at.index(bytes.len());
            match how {
                0 => bytes[at] = value,
                1 => bytes[at] ^= 1 << (value % 8),
                _ => { bytes.insert(at, value); }
            }
        }
        check(&bytes);
    }

    #[test]
    fn any_text_is_read_or_refused(text in "[a-z0-9(){}\\[\\]\"'=.,:;<>@#/ \n-]{0,200}") {
        check(format!("#usda 1.0\n{text}").as_bytes());
    }
}

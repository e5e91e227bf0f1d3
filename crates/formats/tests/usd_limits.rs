//! USD files that stand for more than they hold, and names that look like others.

use strandlight_formats::{Import, ImportOptions, Result, SourceFile};

fn import(text: &str, frame: u32) -> Result<Import> {
    let mut options = ImportOptions::default();
    options.frame = frame;
    SourceFile::from_bytes(text.as_bytes())?.import(&options)
}

/// A prim of this name with two strands of two points, and `more`.
fn lines(name: &str, more: &str) -> String {
    format!(
        "def BasisCurves \"{name}\" {{
    uniform token type = \"linear\"
    int[] curveVertexCounts = [2, 2]
    point3f[] points = [(0, 0, 0), (0, 1, 0), (1, 0, 0), (1, 1, 0)]
    {more}
}}
"
    )
}

fn assert_too_much(text: &str) {
    let error = import(text, 0).expect_err("too much").to_string();
    assert!(
        error.contains("than a file of this length can stand for"),
        "{error}"
    );
}

/// Each prim has a path of its own.
#[test]
fn a_long_name_above_many_prims_is_too_much() {
    let below = |n_prims: usize, length: usize| {
        let prims: String = (0..n_prims)
            .map(|ix| lines(&format!("h{ix}"), ""))
            .collect();
        format!(
            "#usda 1.0\ndef Xform \"{}\" {{\n{prims}}}\n",
            "x".repeat(length)
        )
    };
    assert_too_much(&below(400, 1_000_000));
    assert!(import(&below(400, 100), 0).is_ok());
}

/// A number for each strand is one for each point, where another prim has those.
#[test]
fn constants_of_many_points_are_too_much() {
    let n_primvars = 200;
    let primvars = |interpolation: &str, value: &str| -> String {
        (0..n_primvars)
            .map(|ix| {
                format!("float4[] primvars:p{ix} = [{value}] ( interpolation = \"{interpolation}\" )\n    ")
            })
            .collect()
    };
    let value = "(1, 2, 3, 4)";
    let constant = primvars("constant", value);
    let of_points = primvars("vertex", &[value; 4].join(", "));
    let file = |n_strands: usize| {
        let counts = vec!["2"; n_strands].join(",");
        let points = vec!["(0,0,0),(0,1,0)"; n_strands].join(",");
        let many = lines("many", &constant)
            .replace("[2, 2]", &format!("[{counts}]"))
            .replace(
                "[(0, 0, 0), (0, 1, 0), (1, 0, 0), (1, 1, 0)]",
                &format!("[{points}]"),
            );
        format!("#usda 1.0\n{}{many}", lines("few", &of_points))
    };
    assert_too_much(&file(50_000));
    let small = import(&file(10), 0).expect("little");
    assert_eq!(small.groom.attributes.len(), n_primvars + 1);
}

/// The values of a prim far up are looked through for every prim below it.
#[test]
fn many_values_above_many_prims_are_too_much() {
    let values: String = (0..6000)
        .map(|ix| format!("float primvars:p{ix} = 1\n"))
        .collect();
    let prims: String = (0..6000).map(|ix| lines(&format!("h{ix}"), "")).collect();
    assert_too_much(&format!(
        "#usda 1.0\ndef Xform \"all\" {{\n{values}{prims}}}\n"
    ));
}

#[test]
fn a_pivot_of_an_orientation_moves_as_other_translations_do() {
    let more = "double3 xformOp:translate:orientPivot.timeSamples = { 0: (0, 0, 0), 2: (20, 0, 0) }
    double3 xformOp:translate.timeSamples = { 0: (0, 0, 0), 1: (0, 0, 10), 2: (0, 0, 20) }
    uniform token[] xformOpOrder = [\"xformOp:translate:orientPivot\", \"xformOp:translate\"]";
    let text = format!("#usda 1.0\n{}", lines("hair", more));
    let moved = import(&text, 1).expect("hair");
    assert_eq!(moved.groom.points[0], [10.0, 0.0, 10.0]);
}

#[test]
fn hair_that_is_hidden_is_read_and_told() {
    let hidden = "token visibility = \"invisible\"";
    let below = format!("def Xform \"all\" {{\n{hidden}\n{}}}\n", lines("hair", ""));
    for (text, path) in [(lines("hair", hidden), "/hair"), (below, "/all/hair")] {
        let import = import(&format!("#usda 1.0\n{text}"), 0).expect("hair");
        let notes: Vec<&str> = import.notes.iter().map(|note| &*note.text).collect();
        assert_eq!(
            notes,
            [format!(
                "{path} is hidden in its file, and read all the same"
            )]
        );
    }
}

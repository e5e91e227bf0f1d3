use super::*;
use crate::usd::layer::{Layer, Source};
use crate::usd::model::Numbers;

fn numbers_of(text: &str) -> Option<Numbers<f64>> {
    numbers(text.as_bytes(), 0..text.len()).unwrap()
}

fn layer_of(bytes: &[u8]) -> Result<Layer<'_>> {
    let root = parse(bytes)?;
    Ok(Layer::new(root, Source::Text(bytes), bytes.len()))
}

#[test]
fn numbers_of_all_kinds_are_read() {
    for (text, width, data) in [
        ("7.", 1, &[7.0][..]),
        ("[.5, -7., 1e3, +2]", 1, &[0.5, -7.0, 1000.0, 2.0]),
        ("(1, 2, 3)", 3, &[1.0, 2.0, 3.0]),
        ("[(1,2),\n # three\n (3,4),]", 2, &[1.0, 2.0, 3.0, 4.0]),
        ("( (1, 0), (2, 3) )", 4, &[1.0, 0.0, 2.0, 3.0]),
        ("[inf, -inf]", 1, &[f64::INFINITY, f64::NEG_INFINITY]),
        ("[]", 1, &[]),
        ("true", 1, &[1.0]),
    ] {
        let expected = Some(Numbers {
            width,
            data: data.to_vec(),
        });
        assert_eq!(numbers_of(text), expected, "{text}");
    }
    assert!(numbers_of("nan").unwrap().data[0].is_nan());
    for text in ["None", "\"a\"", "@a.usd@", "[\"a\"]"] {
        assert_eq!(numbers_of(text), None, "{text}");
    }
    for text in ["[(1,2),(1)]", "[1,(1,2)]", "[1, a]", "()", "[(1,2), 3]"] {
        assert!(
            numbers::<f64>(text.as_bytes(), 0..text.len()).is_err(),
            "{text}"
        );
    }
}

#[test]
fn properties_and_metadata_are_found() {
    let text = r#"#usda 1.0
("a comment" upAxis = "Z"; metersPerUnit = .01
 subLayers = [@./other.usda@ (offset = 1; scale = 2)]
 customLayerData = { string a = "}" ; dictionary b = { int c = 1 } } )
reorder rootPrims = ["World"]
def Xform "World" ( doc = '''it's a "doc" (' '''
    prepend references = @a.usda@</A> (offset = 10) kind = "group" delete payload = @b.usd@
    variants = { string look = "thin" }
    prepend variantSets = "look") {
  custom uniform token[] order = ["a", "b\"c"] // a comment
  Vec3f[] points = [(.5, 7., 1e3)] ( interpolation = 'vertex' ) ; float w = None
  float x.timeSamples = { 2: 1, 1: .5, 3: None, }
  add rel material:binding = </World/Looks(a)>
  prepend float y.connect = [</a.b>, </c{v=w}d.e>]
  /* more */ matrix4d m = ( (1,0,0,0), (0,1,0,0), (0,0,1,0), (0,0,0,1) )
  variantSet "look" = { "thin" (active = true) { float w2 = 1 } "thick" { def "Below" {} } }
  over "Child" { asset a = @@@x@y.png@@@
  }
}
"#;
    let layer = layer_of(text.as_bytes()).unwrap();
    let root = &layer.root;
    let word = |key| layer.word(&root.fields, key).unwrap();
    assert_eq!(word("upAxis").as_deref(), Some("Z"));
    assert_eq!(
        layer.number(&root.fields, "metersPerUnit").unwrap(),
        Some(0.01)
    );
    assert_eq!(
        layer.assets(&root.fields["subLayers"]).unwrap(),
        ["@./other.usda@"]
    );
    let world = &root.children[0];
    assert_eq!((&*world.name, &*world.type_name), ("World", "Xform"));
    assert_eq!(world.specifier, Specifier::Def);
    assert!(!world.fields.contains_key("payload"));
    assert_eq!(
        layer.assets(&world.fields["references"]).unwrap(),
        ["@a.usda@"]
    );
    let property = |name: &str| &world.properties[name];
    let order = property("order").default.as_ref().unwrap();
    assert_eq!(layer.strings(order).unwrap(), ["a", "b\"c"]);
    assert_eq!(property("points").type_name, "Vec3f[]");
    let interpolation = layer.word(&property("points").fields, "interpolation");
    assert_eq!(interpolation.unwrap().as_deref(), Some("vertex"));
    assert!(layer.is_blocked(property("w").default.as_ref().unwrap()));
    let samples = &property("x").samples;
    let times: Vec<f64> = samples.iter().map(|(time, _)| *time).collect();
    assert_eq!(times, [1.0, 2.0, 3.0]);
    assert!(layer.is_blocked(&samples[2].1));
    assert_eq!(property("y").default, None);
    let matrix = layer.numbers::<f64>(property("m").default.as_ref().unwrap());
    assert_eq!(matrix.unwrap().unwrap().width, 16);
    assert_eq!(world.variants["look"].len(), 2);
    assert_eq!(world.children[0].specifier, Specifier::Over);

    let mut layer = layer_of(text.as_bytes()).unwrap();
    assert_eq!(layer.select_variants().unwrap(), 0);
    let world = &layer.root.children[0];
    assert!(world.properties.contains_key("w2") && world.children.len() == 1);
}

#[test]
fn faults_name_their_place() {
    for (text, place, what) in [
        ("#usda 1.0\ndef \"a\" {", (2, 10), "`}` is missing"),
        (
            "#usda 1.0\ndef \"a\" { float x = [(1] }",
            (2, 24),
            "bracket",
        ),
        ("#usda 1.0\ndef \"a\" { float x = \"a\n", (2, 21), "string"),
        ("#usda 1.0\ndef a {", (2, 7), "in quotes"),
        ("#usda 1.0\n= 1", (2, 1), "neither"),
    ] {
        let error = layer_of(text.as_bytes()).unwrap_err();
        let expected = format!("line {}, column {}: ", place.0, place.1);
        assert!(error.to_string().starts_with(&expected), "{error}");
        assert!(error.to_string().contains(what), "{error}");
    }
    let deep = "def \"a\" {".repeat(MAX_DEPTH + 1);
    assert!(
        layer_of(deep.as_bytes())
            .unwrap_err()
            .to_string()
            .contains("128")
    );
    let deep = format!("def \"a\" {{ float x = {}", "(".repeat(100_000));
    assert!(layer_of(deep.as_bytes()).is_err());
}

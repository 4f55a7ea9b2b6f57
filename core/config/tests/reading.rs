//! Complete error messages of documents with valid syntax and wrong content.

use manifactor_config::{Document, Errors, Fault, Format, Section};
use manifactor_graph::register;
use schemars::JsonSchema;
use serde::Deserialize;

trait Shape: Send + Sync {
    fn area(&self) -> f64;
}
manifactor_graph::kind!(dyn Shape, "shape");
trait Ink: Send + Sync {}
manifactor_graph::kind!(dyn Ink, "ink");

/// A disc.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Disc {
    radius: f64,
    #[serde(default)]
    centre: Option<[f64; 2]>,
}
impl Shape for Disc {
    fn area(&self) -> f64 {
        self.radius * self.radius * 3.0 + self.centre.map_or(0.0, |c| c[0])
    }
}
register!(dyn Shape, "disc", Disc);

/// A box.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Rectangle {
    sides: Sides,
}
#[derive(Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
enum Sides {
    Square(f64),
    Oblong { width: f64, height: f64 },
}
impl Shape for Rectangle {
    fn area(&self) -> f64 {
        match self.sides {
            Sides::Square(side) => side * side,
            Sides::Oblong { width, height } => width * height,
        }
    }
}
register!(dyn Shape, "rectangle", Rectangle);

/// Several shapes as one.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Group {
    #[schemars(with = "Vec<serde_json::Value>")]
    shapes: Vec<Box<dyn Shape>>,
}
impl Shape for Group {
    fn area(&self) -> f64 {
        self.shapes.iter().map(|shape| shape.area()).sum()
    }
}
register!(dyn Shape, "group", Group);

/// Black.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Black {}
impl Ink for Black {}
register!(dyn Ink, "black", Black);

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(dead_code)]
struct Sheet {
    width: f64,
    height: u32,
    name: Option<String>,
}

fn read<T>(
    format: Format,
    text: &str,
    with: impl FnOnce(&mut Section<'_>) -> Option<T>,
) -> Result<T, String> {
    let document = Document::parse("file", text, format).map_err(|e| e.to_string())?;
    let errors = Errors::new();
    let value = document.section(&errors).and_then(|mut section| {
        let value = with(&mut section);
        section.finish();
        value
    });
    errors.finish(value).map_err(|e| e.to_string())
}

fn said<T>(format: Format, text: &str, with: impl FnOnce(&mut Section<'_>) -> Option<T>) -> String {
    read(format, text, with).err().expect("an error")
}

fn shapes(section: &mut Section<'_>) -> Option<f64> {
    let errors = section.errors();
    let shapes: Vec<_> =
        section.nodes("shapes").iter().filter_map(|node| node.read::<Box<dyn Shape>>(errors)).collect();
    Some(shapes.iter().map(|s| s.area()).sum())
}

#[test]
fn registered_types_are_read_by_name() {
    let text = "shapes = [{ type = 'disc', radius = 2 }, { sides = { square = 3.0 }, type = 'rectangle' }]";
    assert_eq!(read(Format::Toml, text, shapes), Ok(21.0));
}

#[test]
fn errors_of_a_type_within_a_type_are_at_their_place() {
    let text = "
[[shapes]]
type = 'group'
shapes = [
    { type = 'disc', radius = 1 },
    { type = 'group', shapes = [{ type = 'disc', radius = 'one' }] },
]
[[shapes]]
type = 'group'
shapes = [{ type = 'group', shapes = [{ type = 'dics' }] }]
";
    assert_eq!(
        said(Format::Toml, text, shapes),
        "file:6:59: expected a number, found the text \"one\"\n\
         file:10:48: unknown shape `dics` (did you mean `disc`? there are `disc`, `group` and `rectangle`)"
    );
    let mended = text.replace("'one'", "2").replace("'dics'", "'disc', radius = 3");
    assert_eq!(read(Format::Toml, &mended, shapes), Ok(42.0));
}

#[test]
fn all_errors_of_a_document_are_told_at_once() {
    let text = "
[[shapes]]
type = 'dics'
radius = 1.0

[[shapes]]
type = 'disc'
raduis = 1.0
center = [1.0, 2.0]

[[shapes]]
type = 'rectangle'
sides = { oblong = { width = 1.0, height = 'tall' } }

[[shapes]]
type = 'disc'
radius = 2.0
centre = [1.0, inf]

[[shapes]]
type = 'black'

[sheet]
";
    assert_eq!(
        said(Format::Toml, text, shapes),
        "file:3:8: unknown shape `dics` (did you mean `disc`? there are `disc`, `group` and `rectangle`)\n\
         file:8:1: unknown field `raduis` (did you mean `radius`? there are `radius` and `centre`)\n\
         file:9:1: unknown field `center` (did you mean `centre`? there are `radius` and `centre`)\n\
         file:13:44: expected a number, found the text \"tall\"\n\
         file:18:16: `inf` is not a finite number\n\
         file:21:8: `black` is an ink, not a shape (there are `disc`, `group` and `rectangle`)\n\
         file:23:2: unknown field `sheet` (there is only `shapes`)"
    );
}

#[test]
fn yaml_and_json_point_as_exactly() {
    let yaml =
        "shapes:\n- type: disc\n  radius: 1\n  centre: [1, 2, 3]\n- type: rectangle\n  sides: {sqare: 1}\n";
    assert_eq!(
        said(Format::Yaml, yaml, shapes),
        "file:4:11: expected fewer elements, found 3 elements\n\
         file:6:11: unknown field `sqare` (did you mean `square`? there are `square` and `oblong`)"
    );
    let json = "{\"shapes\": [\n {\"type\": \"disc\", \"radius\": null},\n {\"type\": 3},\n {\"typ\": \"disc\"},\n \"disc\"]}";
    assert_eq!(
        said(Format::Json, json, shapes),
        "file:2:29: expected a number, found nothing\n\
         file:3:11: expected the name of a shape, found the number 3\n\
         file:4:3: unknown field `typ` (did you mean `type`?)\n\
         file:5:2: expected a table with the `type` of a shape, found the text \"disc\" (write { type = \"disc\" })"
    );
}

#[test]
fn plain_types_say_what_was_expected() {
    let sheet = |section: &mut Section<'_>| section.required::<Sheet>("sheet");
    let both = "[sheet]\nwidth = true\n[other]\n";
    assert_eq!(
        said(Format::Toml, both, sheet),
        "file:2:9: expected a number, found true\nfile:3:2: unknown field `other` (there is only `sheet`)"
    );
    assert_eq!(said(Format::Toml, "[sheet]\nwidth = 1\n", sheet), "file:1:1: missing field `height`");
    assert_eq!(
        said(Format::Yaml, "sheet:\n  width: 1\n  height: -2\n", sheet),
        "file:3:11: expected a whole number, 0 or more, found the number -2"
    );
    assert_eq!(
        said(Format::Toml, "sheet = { width = 1, height = 2.5 }\n", sheet),
        "file:1:31: expected a whole number, 0 or more, found the number 2.5"
    );
    assert_eq!(said(Format::Toml, "sheet = 1\n", sheet), "file:1:9: expected a table, found the number 1");
    assert_eq!(said(Format::Json, "[]", sheet), "file:1:1: expected a table, found an array");
}

#[test]
fn what_is_misspelled_is_not_missing_as_well() {
    let two = |s: &mut Section<'_>| Some((s.required::<f64>("sigma")?, s.required::<f64>("scale")?));
    assert_eq!(
        said(Format::Toml, "sigam = 1\n", |s| {
            let _ = s.optional::<f64>("scale");
            s.required::<f64>("sigma")
        }),
        "file:1:1: unknown field `sigam` (did you mean `sigma`? there are `scale` and `sigma`)"
    );
    assert_eq!(said(Format::Toml, "sigma = 1\n", two), "file:1:1: missing field `scale`");
}

#[test]
fn parts_may_be_left_out_and_the_rest_read_as_one() {
    let parts = |section: &mut Section<'_>| {
        let shape = section.optional::<Box<dyn Shape>>("shape").map(|s| s.area());
        let mut sheet = section.optional_section("sheet")?;
        let tags: Vec<String> = sheet.or_default("tags");
        let sheet: Option<Sheet> = sheet.rest();
        Some((shape, tags.len(), format!("{:?}", sheet?)))
    };
    let sheet = "Sheet { width: 1.0, height: 2, name: None }".to_owned();
    assert_eq!(
        read(Format::Toml, "sheet = { width = 1, tags = ['a'], height = 2 }", parts),
        Ok((None, 1, sheet.clone()))
    );
    let shape = "[sheet]\nwidth = 1\nheight = 2\n[shape]\ntype = 'disc'\nradius = 1\n";
    assert_eq!(read(Format::Toml, shape, parts), Ok((Some(3.0), 0, sheet)));
    assert_eq!(
        said(Format::Toml, "[sheet]\nwidth = 1\nheight = 2\ncolour = 'red'\ntags = 3\n", parts),
        "file:4:1: unknown field `colour` (there are `width`, `height`, `name` and `tags`)\n\
         file:5:8: expected an array, found the number 3"
    );
}

#[test]
fn callers_report_at_a_field_that_they_took() {
    let text = "[camera]\nwidth = 0\n";
    let said = said(Format::Toml, text, |section| {
        let mut camera = section.section("camera")?;
        let width = camera.required::<u32>("width")?;
        if width == 0 {
            camera.report("width", Fault::with_help("an image has pixels", "give its width"));
        }
        camera.finish();
        Some(width)
    });
    assert_eq!(said, "file:2:9: an image has pixels (give its width)");
}

#[test]
fn files_that_cannot_be_read_say_why() {
    let open = |path: &str| Document::open(path).err().map(|e| e.to_string()).unwrap();
    assert_eq!(
        open("run.ini"),
        "run.ini:1:1: the extension of this file names no known format (use .toml, .json, .yaml or .yml)"
    );
    assert!(open("no/such/run.toml").starts_with("no/such/run.toml:1:1: cannot be read: "));
    let path = std::env::temp_dir().join(format!("manifactor-config-{}.toml", std::process::id()));
    std::fs::write(&path, b"a = 1\nb = \"\xff\"\n").unwrap();
    let said = open(path.to_str().unwrap());
    std::fs::remove_file(&path).unwrap();
    assert!(said.ends_with(":2:6: cannot be read: the text is not UTF-8 from here on"), "{said}");
}

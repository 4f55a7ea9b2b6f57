use crate::harness::{Case, account, text};

const TWO: &str = "VERTEX_SE2 0 0 0 0\nVERTEX_SE2 1 1 0 0\n";
const EDGE: &str = "EDGE_SE2 0 1 1 0 0 100 0 0 100 0 100\n";
const SPACE: &str = "VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\nVERTEX_SE3:QUAT 1 1 0 0 0 0 0 1\n";
const IDENTITY: &str = "1 0 0 0 0 0 1 0 0 0 0 1 0 0 0 1 0 0 1 0 1";

/// Two planar poses, followed by these lines.
fn plane(name: &'static str, lines: &str) -> Case {
    text(name, format!("{TWO}{lines}\n"))
}

/// Two 3D poses, and an edge with this relative pose and information.
fn space(name: &'static str, relative: &str, information: &str) -> Case {
    text(name, format!("{SPACE}EDGE_SE3:QUAT 0 1 {relative} {information}\n"))
}

#[test]
fn g2o_files() {
    let latin1 = [TWO.as_bytes(), b"# caf\xe9\n", EDGE.as_bytes()].concat();
    let utf16: Vec<u8> = format!("{TWO}{EDGE}").encode_utf16().flat_map(u16::to_le_bytes).collect();
    let cases = vec![
        text("empty", ""),
        text("blank lines", "\n \n\t\n"),
        text("comments only", "# nothing\n"),
        ("binary", vec![0, 159, 146, 150, 0, 1, 2, 3]),
        ("Latin-1", latin1),
        ("UTF-16", utf16),
        ("gzip", vec![0x1f, 0x8b, 8, 0, 0, 0, 0, 0, 0, 3]),
        ("byte order mark", [b"\xef\xbb\xbf", TWO.as_bytes(), EDGE.as_bytes()].concat()),
        text("carriage returns", format!("{TWO}{EDGE}").replace('\n', "\r\n")),
        text("tabs", format!("{TWO}{EDGE}").replace(' ', "\t")),
        text("NUL in a line", format!("{TWO}EDGE_SE2 0 1 1 0 0\0 100 0 0 100 0 100\n")),
        text("vertices only", TWO),
        plane("unknown tags", "EDGE_FOO 0 1 1\nEDGE_FOO 0 1 2\nBAR\nEDGE_SE2 0 1 1 0 0 100 0 0 100 0 100"),
        plane("vertex cut short", "VERTEX_SE2 2 1 0"),
        plane("edge cut short", "EDGE_SE2 0 1 1 0 0 100 0 0 100"),
        plane("edge without numbers", "EDGE_SE2"),
        plane("too many numbers", "EDGE_SE2 0 1 1 0 0 100 0 0 100 0 100 7 8"),
        plane("a word for a number", "EDGE_SE2 0 1 one 0 0 100 0 0 100 0 100"),
        plane("decimal commas", "EDGE_SE2 0 1 1,5 0 0 100 0 0 100 0 100"),
        plane("hexadecimal", "EDGE_SE2 0 1 0x10 0 0 100 0 0 100 0 100"),
        plane("not a number", "EDGE_SE2 0 1 nan 0 0 100 0 0 100 0 100"),
        plane("infinite", "EDGE_SE2 0 1 inf 0 0 100 0 0 100 0 100"),
        plane("too large for f64", "EDGE_SE2 0 1 1e999 0 0 100 0 0 100 0 100"),
        text("value not a number", format!("VERTEX_SE2 0 0 0 nan\nVERTEX_SE2 1 1 0 0\n{EDGE}")),
        plane("vertex twice", &format!("VERTEX_SE2 1 5 5 0\n{EDGE}")),
        plane("edge to a vertex that is not there", "EDGE_SE2 0 7 1 0 0 100 0 0 100 0 100"),
        plane("edge of one vertex", "EDGE_SE2 1 1 1 0 0 100 0 0 100 0 100"),
        plane("negative number of a vertex", "EDGE_SE2 -1 1 1 0 0 100 0 0 100 0 100"),
        plane(
            "number of a vertex beyond 64 bits",
            "EDGE_SE2 0 99999999999999999999999 1 0 0 100 0 0 100 0 100",
        ),
        plane("broken number of a vertex", "EDGE_SE2 0 1.5 1 0 0 100 0 0 100 0 100"),
        plane("information zero", "EDGE_SE2 0 1 1 0 0 0 0 0 0 0 0"),
        plane("information negative", "EDGE_SE2 0 1 1 0 0 -1 0 0 -1 0 -1"),
        plane("information indefinite", "EDGE_SE2 0 1 1 0 0 1 2 0 1 0 1"),
        plane("information not a number", "EDGE_SE2 0 1 1 0 0 nan 0 0 1 0 1"),
        plane("information all but zero", "EDGE_SE2 0 1 1 0 0 1e-320 0 0 1e-320 0 1e-320"),
        plane("information all but infinite", "EDGE_SE2 0 1 1 0 0 1e308 0 0 1e308 0 1e308"),
        plane("all but infinite", "EDGE_SE2 0 1 1e308 0 0 100 0 0 100 0 100"),
        plane("FIX of no vertex", &format!("{EDGE}FIX 9")),
        plane("FIX of nothing", &format!("{EDGE}FIX")),
        plane("FIX of a word", &format!("{EDGE}FIX all")),
        plane("everything held", &format!("{EDGE}FIX 0\nFIX 1")),
        plane(
            "in two parts",
            &format!("{EDGE}VERTEX_SE2 2 0 0 0\nVERTEX_SE2 3 0 0 0\nEDGE_SE2 2 3 1 0 0 1 0 0 1 0 1"),
        ),
        text("edges only, in two parts", "EDGE_SE2 0 1 1 0 0 1 0 0 1 0 1\nEDGE_SE2 2 3 1 0 0 1 0 0 1 0 1\n"),
        plane("plane and space", "EDGE_SE3:QUAT 0 1 1 0 0 0 0 0 1 1 0 0 0 0 0 1 0 0 0 0 1 0 0 0 1 0 0 1 0 1"),
        plane("landmark as a pose", "VERTEX_XY 2 1 1\nEDGE_SE2 0 2 1 0 0 100 0 0 100 0 100"),
        plane("pose as a landmark", "EDGE_SE2_XY 0 1 1 0 1 0 1"),
        text("a million columns", format!("{TWO}EDGE_SE2 0 1{}\n", " 1".repeat(1_000_000))),
        text("a word of a million letters", format!("{TWO}{}\n", "X".repeat(1_000_000))),
        space("quaternion zero", "1 0 0 0 0 0 0", IDENTITY),
        space("quaternion not of length one", "1 0 0 0 0 0 2", IDENTITY),
        space("quaternion not a number", "1 0 0 0 0 0 nan", IDENTITY),
        space("information in space indefinite", "1 0 0 0 0 0 1", &IDENTITY.replacen("1 0", "1 5", 1)),
        space("information in space cut short", "1 0 0 0 0 0 1", "1 0 0 0 0 0 1"),
        text("vertex with a quaternion of zero", "VERTEX_SE3:QUAT 0 0 0 0 0 0 0 0\n"),
    ];
    insta::assert_snapshot!(account("graph.g2o", "solve FILE", cases));
}

#[test]
fn toro_files() {
    let cases = vec![
        text("edge cut short", "VERTEX2 0 0 0 0\nVERTEX2 1 1 0 0\nEDGE2 0 1 1 0 0 1 0\n"),
        text(
            "equivalence of no vertex",
            "VERTEX2 0 0 0 0\nVERTEX2 1 1 0 0\nEDGE2 0 1 1 0 0 1 0 1 1 0 0\nEQUIV 0 9\n",
        ),
        text("equivalence cut short", "VERTEX2 0 0 0 0\nEQUIV 0\n"),
        text("information indefinite", "VERTEX2 0 0 0 0\nVERTEX2 1 1 0 0\nEDGE2 0 1 1 0 0 1 0 -1 1 0 0\n"),
        text("angles not a number", "VERTEX3 0 0 0 0 nan 0 0\nVERTEX3 1 0 0 0 0 0 0\n"),
    ];
    insta::assert_snapshot!(account("graph.graph", "solve FILE", cases));
}

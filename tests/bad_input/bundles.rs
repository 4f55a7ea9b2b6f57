use crate::harness::{account, text};

const POINTS: &str = "0 0 -3\n1 0 -4\n0 1 -5\n1 1 -4\n";

/// Two cameras that see four points, with one change.
fn bundle(from: &str, to: &str) -> String {
    let mut all = String::from("2 4 8\n");
    for point in 0..4 {
        all += &format!("0 {point} {point}.5 1.5\n1 {point} {point}.25 0.5\n");
    }
    let cameras = "0 0 0 0 0 0 100 0 0\n0 0 0 -1 0 0 100 0 0\n";
    let all = all + cameras + POINTS;
    assert!(all.contains(from), "{from}");
    all.replacen(from, to, 1)
}

#[test]
fn bal_files() {
    let cases = vec![
        text("empty", ""),
        text("header cut short", "2 4\n"),
        text("header of words", "two four eight\n"),
        text("negative counts", bundle("2 4 8", "-2 4 8")),
        text("broken counts", bundle("2 4 8", "2.5 4 8")),
        text("counts beyond all memory", bundle("2 4 8", "1000000000000 4 1000000000000000")),
        text("counts beyond 64 bits", bundle("2 4 8", "2 4 99999999999999999999999")),
        text("fewer observations than announced", bundle("2 4 8", "2 4 9")),
        text("more observations than announced", bundle("2 4 8", "2 4 7")),
        text("more points than there are", bundle("2 4 8", "2 5 8")),
        text("camera that is not there", bundle("1 3", "7 3")),
        text("point that is not there", bundle("1 3", "1 9")),
        text("observation twice", bundle("1 3", "0 3")),
        text("pixel not a number", bundle("0.5 1.5", "nan 1.5")),
        text("pixel of words", bundle("0.5 1.5", "left 1.5")),
        text("camera not a number", bundle("0 0 0 0 0 0 100", "0 0 0 0 nan 0 100")),
        text("focal length zero", bundle("0 0 0 0 0 0 100", "0 0 0 0 0 0 0")),
        text("point behind its cameras", bundle("0 0 -3", "0 0 3")),
        text("nothing seen", "1 1 0\n0 0 0 0 0 0 100 0 0\n0 0 -3\n"),
        ("binary", vec![0; 64]),
    ];
    insta::assert_snapshot!(account("scene.bal", "solve FILE", cases));
}

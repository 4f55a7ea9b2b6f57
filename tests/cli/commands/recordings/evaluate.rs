use crate::{folder, manifactor, path};

const TRUTH: &str = "0 0 0 0 0 0 0 1\n1 1 0 0 0 0 0 1\n2 1 1 0 0 0 0 1\n3 0 1 0.5 0 0 0 1\n";

#[test]
fn a_moved_trajectory_has_no_error_once_it_is_aligned() {
    // half a turn about z, and a translation of 5 m
    let moved = "0 5 0 0 0 0 1 0\n1 4 0 0 0 0 1 0\n2 4 -1 0 0 0 1 0\n3 5 -1 0.5 0 0 1 0\n";
    let folder = folder(&[("truth.txt", TRUTH), ("moved.txt", moved)]);
    let files = format!("{} {}", path(&folder, "truth.txt"), path(&folder, "moved.txt"));
    let ate = |options: &str| {
        let json = manifactor(&format!("evaluate {files} {options} --json")).ended(0).json();
        (json["ate"]["rmse"].as_f64().unwrap(), json["rpe"]["translation"]["rmse"].as_f64().unwrap())
    };
    assert!(ate("").0 < 1e-12 && ate("--align first").0 < 1e-12 && ate("--align sim3").0 < 1e-12);
    let (unaligned, relative) = ate("--align none");
    assert!(unaligned > 3.0 && relative < 1e-12);
}

#[test]
fn the_table_names_its_units() {
    let folder = folder(&[("truth.txt", TRUTH)]);
    let file = path(&folder, "truth.txt");
    let text = manifactor(&format!("evaluate {file} {file}")).ended(0).stdout;
    assert!(
        text.contains("4 matched poses (4 in the estimate, 4 in the truth)")
            && text.contains("ATE, m")
            && text.contains("RPE rotation, rad"),
        "{text}"
    );
}

#[test]
fn lines_that_are_late_or_repeat_a_timestamp_are_counted() {
    let folder = folder(&[("truth.txt", &format!("{TRUTH}3 50 0 0 0 0 0 1\n2.97 0 1 0.5 0 0 0 1\n"))]);
    let file = path(&folder, "truth.txt");
    let ran = manifactor(&format!("evaluate {file} {file}")).ended(0);
    ran.complains("1 line (5) with the timestamp of an earlier line: left out; the first line counts");
    ran.complains("1 line (6) late: moved to their place by time");
}

#[test]
fn clocks_that_do_not_meet_are_an_error() {
    let folder = folder(&[("truth.txt", TRUTH), ("late.txt", "100 0 0 0 0 0 0 1\n")]);
    let ran = manifactor(&format!("evaluate {} {}", path(&folder, "truth.txt"), path(&folder, "late.txt")));
    ran.ended(2).complains("do the two share a clock?");
}

#[test]
fn a_malformed_trajectory_is_shown_with_its_line() {
    let folder = folder(&[("truth.txt", TRUTH), ("bad.txt", "0 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 7\n")]);
    let ran = manifactor(&format!("evaluate {} {}", path(&folder, "truth.txt"), path(&folder, "bad.txt")));
    ran.ended(2).complains("bad.txt:2:1");
}

#[test]
fn boxes_that_do_not_meet_are_an_error() {
    let header = "timestamp,class_name,score,xmin,ymin,xmax,ymax,object_key\n";
    let (one, other) = (format!("{header}0,cup,0.5,1,1,5,5,3\n"), format!("{header}9,cup,0.5,1,1,5,5,3\n"));
    let folder = folder(&[("one.csv", &one), ("other.csv", &other)]);
    let (one, other) = (path(&folder, "one.csv"), path(&folder, "other.csv"));
    let ran = manifactor(&format!("evaluate --boxes {one} {one}")).ended(0);
    assert!(
        ran.stdout.contains("1 box, 1 true object, 0 estimated objects with 3 boxes or more"),
        "{}",
        ran.stdout
    );
    manifactor(&format!("evaluate --boxes {one} {other}"))
        .ended(2)
        .complains("boxes match if their timestamps and their four sides are equal");
    manifactor(&format!("evaluate --boxes {one} {one} --delta 3")).ended(2).complains("cannot be used with");
}

#[test]
fn the_order_of_rows_does_not_change_the_scores_of_boxes() {
    // each frame has two objects for one box, and the third object never resolves the ambiguity
    let row = |time: usize, side: usize, object: usize| format!("{time},cup,0.5,{side},1,50,50,{object}\n");
    let frame = |time: usize| [row(time, 1, 7), row(time, 1, 3), row(time, 1, 0), row(time, 2, 5 + time % 2)];
    let mut rows: Vec<String> = (0..40).flat_map(frame).collect();
    rows.push(row(50, 3, 7));
    let header = "timestamp,class_name,score,xmin,ymin,xmax,ymax,object_key\n";
    let file = |rows: &[String]| format!("{header}{}", rows.concat());
    let one = file(&rows);
    // a fixed shuffle: 53 is coprime to the number of rows, 161
    let shuffled: Vec<String> = (0..rows.len()).map(|i| rows[i * 53 % rows.len()].clone()).collect();
    rows.reverse();
    let folder = folder(&[("one.csv", &one), ("two.csv", &file(&rows)), ("three.csv", &file(&shuffled))]);
    let [one, two, three] = ["one.csv", "two.csv", "three.csv"].map(|name| path(&folder, name));
    let scores =
        |a, b| manifactor(&format!("evaluate --boxes {a} {b} --json")).ended(0).json()["scores"].clone();
    let whole = scores(&one, &one);
    assert_eq!((&whole["f1"], &whole["identity_f1"]), (&1.0.into(), &1.0.into()));
    for (a, b) in [(&one, &two), (&two, &one), (&three, &two), (&one, &three)] {
        assert_eq!(scores(a, b), whole);
    }
}

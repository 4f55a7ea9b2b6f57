use super::*;

fn run() -> Table {
    let header =
        ["", "ATE (m)", "position (m)", "shape", "quality", "objects", "boxes", "cost", "iterations", "time"];
    let mut table =
        Table::of_numbers(&header).with_priority(&["ATE (m)", "position (m)", "shape", "quality", "cost"]);
    table.row(["before the solve", "0.02893", "0.04518", "0.5099", "0.5992", "18", "3280", "-", "-", "-"]);
    table.row([
        "QuadricSLAM",
        "0.01465",
        "0.02502",
        "0.4232",
        "0.4722",
        "18",
        "3280",
        "1722.22",
        "13",
        "772.5 ms",
    ]);
    table.row([
        "with orientation factors",
        "0.01436",
        "0.02471",
        "0.4283",
        "0.4713",
        "18",
        "3280",
        "1777.94",
        "57",
        "3.92 s",
    ]);
    table
}

fn fields() -> Table {
    let mut table = Table::of_words(&["field", "default", "what it is"]);
    table.row([
        "min_views",
        "3",
        "Objects that are seen in fewer frames than this are not mapped: their place is not known.",
    ]);
    table.row(["initialiser", "{ type = \"svd\" }", "Where objects begin."]);
    table
}

#[track_caller]
fn fits(table: &Table, width: usize) {
    let text = table.at(width);
    assert!(text.lines().all(|line| line.width() <= width), "{text}");
    for cell in table.rows.iter().map(|row| &row[0]) {
        assert!(text.contains(cell.as_str()), "{cell} is broken:\n{text}");
    }
}

#[test]
fn every_width_from_60_on_holds_the_table() {
    for width in 60..200 {
        fits(&run(), width);
        fits(&fields(), width);
    }
}

#[test]
fn at_60_columns_the_errors_stay() {
    assert_eq!(
        run().at(60),
        "\
────────────────────────────────────────────────────────────
                              ATE  position   shape  quality
                              (m)       (m)
────────────────────────────────────────────────────────────
before the solve          0.02893   0.04518  0.5099   0.5992
QuadricSLAM               0.01465   0.02502  0.4232   0.4722
with orientation factors  0.01436   0.02471  0.4283   0.4713
────────────────────────────────────────────────────────────
Not shown at this width: objects, boxes, cost, iterations,
time."
    );
}

#[test]
fn at_80_columns_cost_and_objects_join() {
    assert_eq!(
        run().at(80),
        "\
──────────────────────────────────────────────────────────────────────────────
                              ATE  position   shape  quality  objects     cost
                              (m)       (m)
──────────────────────────────────────────────────────────────────────────────
before the solve          0.02893   0.04518  0.5099   0.5992       18        -
QuadricSLAM               0.01465   0.02502  0.4232   0.4722       18  1722.22
with orientation factors  0.01436   0.02471  0.4283   0.4713       18  1777.94
──────────────────────────────────────────────────────────────────────────────
Not shown at this width: boxes, iterations, time."
    );
}

#[test]
fn at_120_columns_all_is_shown() {
    assert_eq!(
        run().at(120),
        "\
───────────────────────────────────────────────────────────────────────────────────────────────────────────
                              ATE  position   shape  quality  objects  boxes     cost  iterations      time
                              (m)       (m)
───────────────────────────────────────────────────────────────────────────────────────────────────────────
before the solve          0.02893   0.04518  0.5099   0.5992       18   3280        -           -         -
QuadricSLAM               0.01465   0.02502  0.4232   0.4722       18   3280  1722.22          13  772.5 ms
with orientation factors  0.01436   0.02471  0.4283   0.4713       18   3280  1777.94          57    3.92 s
───────────────────────────────────────────────────────────────────────────────────────────────────────────"
    );
}

#[test]
fn words_are_broken_between_words() {
    assert_eq!(
        fields().at(60),
        "\
────────────────────────────────────────────────────────────
field        default           what it is
────────────────────────────────────────────────────────────
min_views    3                 Objects that are seen in
                               fewer frames than this are
                               not mapped: their place is
                               not known.
initialiser  { type = \"svd\" }  Where objects begin.
────────────────────────────────────────────────────────────"
    );
}

#[test]
fn rows_are_turned_where_names_leave_no_room() {
    let mut table = Table::of_numbers(&["", "ATE (m)", "cost"]);
    let name = "a name of a variant that is nearly as long as the line is";
    table.row([name, "0.01465", "1722.22"]);
    assert_eq!(table.at(60), format!("{name}\n  ATE (m)  0.01465\n  cost     1722.22"));
}

#[test]
fn names_do_not_command_the_terminal() {
    let mut table = Table::of_numbers(&["variant", "\u{9b}31m"]);
    table.row(["red \u{1b}[31m", "1\nconverged"]);
    let text = table.at(80);
    assert!(!text.contains(|c: char| c.is_control() && c != '\n'), "{text:?}");
    assert!(text.contains("red \\u{1b}[31m") && text.contains("1\\nconverged"), "{text}");
}

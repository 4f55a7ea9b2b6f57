use super::*;
use serde_json::json;

/// Reads boxes of an image of 640 × 480 pixels from files in a folder.
fn read(format: serde_json::Value, files: &[(&str, &str)]) -> Result<Vec<DetectionRow>, String> {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in files {
        let file = folder.path().join(name);
        std::fs::create_dir_all(file.parent().unwrap()).unwrap();
        std::fs::write(file, text).unwrap();
    }
    let format: DetectionFormat = serde_json::from_value(format).map_err(|error| error.to_string())?;
    format.read(folder.path(), [640, 480]).map_err(|error| error.to_string())
}

/// A cup at 10.5 s and a book at 11 s, in pixels.
fn expected() -> Vec<DetectionRow> {
    vec![
        DetectionRow::of_box(10.5, "cup", 0.75, [64.0, 96.0, 192.0, 240.0]),
        DetectionRow::of_box(11.0, "book", 0.5, [320.0, 240.0, 480.0, 360.0]),
    ]
}

fn coco(edit: impl FnOnce(&mut serde_json::Value)) -> String {
    let mut file = json!({
        "images": [
            {"id": 7, "file_name": "rgb/10.5.png", "width": 640, "height": 480},
            {"id": 9, "file_name": "rgb/11.0.png", "width": 640, "height": 480},
        ],
        "categories": [{"id": 47, "name": "cup"}, {"id": 84, "name": "book"}],
        "annotations": [
            {"image_id": 7, "category_id": 47, "bbox": [64.0, 96.0, 128.0, 144.0], "score": 0.75},
            {"image_id": 9, "category_id": 84, "bbox": [320.0, 240.0, 160.0, 120.0], "score": 0.5},
        ],
    });
    edit(&mut file);
    file.to_string()
}

const YOLO: [(&str, &str); 3] = [
    ("names.txt", "cup\nbook\n"),
    ("labels/10.5.txt", "0 0.2 0.35 0.2 0.3 0.75\n"),
    ("labels/11.0.txt", "1 0.5 0.5 0.75 0.5 0.75 0.75 0.5 0.75 0.5\n"),
];

#[test]
fn one_recording_is_the_same_in_all_formats() {
    let close = |found: Vec<DetectionRow>| {
        assert_eq!(found.len(), 2);
        for (found, expected) in found.iter().zip(expected()) {
            assert_eq!((found.timestamp, found.score), (expected.timestamp, expected.score));
            let sides = |row: &DetectionRow| [row.xmin, row.ymin, row.xmax, row.ymax];
            assert!(
                sides(found).iter().zip(sides(&expected)).all(|(a, b)| (a - b).abs() < 1e-9),
                "{found:?}"
            );
        }
        found
    };
    let file = coco(|_| ());
    let found = close(read(json!({"format": "coco", "file": "a.json"}), &[("a.json", &file)]).unwrap());
    assert_eq!(found, expected());
    let results = serde_json::from_str::<serde_json::Value>(&file).unwrap()["annotations"].to_string();
    let format = json!({"format": "coco", "file": "results.json", "images": "a.json"});
    close(read(format, &[("a.json", &file), ("results.json", &results)]).unwrap());
    let yolo = json!({"format": "yolo", "folder": "labels", "classes": "names.txt"});
    let found = close(read(yolo, &YOLO).unwrap());
    assert_eq!(found[1].class_name, "book");
    let frames = json!({"rate": 2.0, "start": 10.0});
    let mot = json!({"format": "mot", "file": "det.txt", "class": "person", "frames": frames});
    let lines = "2,-1,64,96,128,144,0.75,-1,-1,-1\n3,-1,320,240,160,120,0.5,-1,-1,-1\n";
    close(read(mot, &[("det.txt", lines)]).unwrap());
    let kitti = json!({"format": "kitti", "file": "0009.txt", "frames": {"times": "times.txt"}});
    let rest = "1.5 1.6 3.9 0 1.5 20 0.1";
    let lines = format!(
        "1 3 cup 0 0 0.1 64 96 192 240 {rest} 0.75\n1 -1 DontCare -1 -1 -10 1 1 9 9 -1 -1 -1 -10 -10 -10 -10\n2 4 book 0 0 0.1 320 240 480 360 {rest} 0.5\n"
    );
    let found = close(read(kitti, &[("0009.txt", &lines), ("times.txt", "10\n10.5\n11\n")]).unwrap());
    assert_eq!(found[0].class_name, "cup");
}

#[test]
fn a_form_or_unit_that_does_not_fit_is_named() {
    let of_coco = |edit: &dyn Fn(&mut serde_json::Value)| {
        read(json!({"format": "coco", "file": "a.json"}), &[("a.json", &coco(edit))]).unwrap_err()
    };
    let boxes = |boxes: [[f64; 4]; 2]| {
        of_coco(&move |file| {
            for (i, sides) in boxes.iter().enumerate() {
                file["annotations"][i]["bbox"] = json!(sides);
            }
        })
    };
    let frames = json!({"times": "times.txt"});
    let of_mot = |lines: &str| {
        let format = json!({"format": "mot", "file": "det.txt", "class": "person", "frames": frames});
        read(format, &[("det.txt", lines), ("times.txt", "10\n11\n")]).unwrap_err()
    };
    let of_yolo = |line: &str| {
        let files = [YOLO[0], ("labels/10.5.txt", line)];
        read(json!({"format": "yolo", "folder": "labels", "classes": "names.txt"}), &files).unwrap_err()
    };
    let of_kitti = |line: &str| {
        let format = json!({"format": "kitti", "file": "a.txt", "frames": {"times": "times.txt"}});
        read(format, &[("a.txt", line), ("times.txt", "10\n11\n")]).unwrap_err()
    };
    let faults = [
        (boxes([[0.1, 0.2, 0.2, 0.3], [0.5, 0.5, 0.3, 0.2]]), "expected pixels, not shares"),
        (
            boxes([[400.0, 300.0, 600.0, 470.0], [320.0, 240.0, 600.0, 460.0]]),
            "last two numbers are the right",
        ),
        (
            boxes([[500.0, 300.0, 240.0, 300.0], [500.0, 330.0, 260.0, 290.0]]),
            "first two numbers are the centre",
        ),
        (boxes([[1200.0, 300.0, 60.0, 70.0], [900.0, 700.0, 60.0, 40.0]]), "up to x = 1260 and y = 740"),
        (boxes([[10.0, 300.0, -60.0, 70.0], [90.0, 70.0, 60.0, 40.0]]), "annotation 1: expected a box"),
        (
            of_coco(&|file| file["images"][0]["width"] = json!(1280)),
            "1280 × 480 pixels, and `camera` has 640 × 480",
        ),
        (of_coco(&|file| file["annotations"][0]["image_id"] = json!(8)), "annotation 1: there is no image"),
        (
            of_coco(&|file| file["annotations"][1]["category_id"] = json!(8)),
            "annotation 2: there is no category",
        ),
        (
            of_coco(&|file| file["annotations"][1]["score"] = json!(80.0)),
            "expected a score from 0 to 1, got 80",
        ),
        (of_coco(&|file| file["images"][0]["file_name"] = json!("left.png")), "is no time in seconds"),
        (
            of_coco(&|file| {
                file["categories"].as_array_mut().unwrap().push(json!({"id": 47, "name": "spoon"}));
            }),
            "two categories have the id",
        ),
        (
            of_coco(&|file| {
                let again = json!({"id": file["images"][0]["id"], "file_name": "12.5.png"});
                file["images"].as_array_mut().unwrap().push(again);
            }),
            "two images have the id",
        ),
        (of_coco(&|file| *file = json!([])), "set `images` to the file"),
        (of_coco(&|file| *file = json!({"images": []})), "missing field `categories`"),
        (of_mot("0,-1,1,1,9,9,0.5,-1,-1,-1\n"), "det.txt:1: image 0 comes before the first one, 1"),
        (of_mot("3,-1,1,1,9,9,0.5,-1,-1,-1\n"), "has 2 times, from image 1"),
        (of_mot("1,-1,1,1,9,9,-0.5\n"), "expected a score from 0 to 1"),
        (
            read(
                json!({"format": "mot", "file": "det.txt", "class": "person", "frames": frames}),
                &[("det.txt", "1,-1,1,1,9,9,0.5\n"), ("times.txt", "10\n10\n")],
            )
            .unwrap_err(),
            "times.txt:2: expected a time after that of the image before, 10 s, got 10 s",
        ),
        (of_mot("1 -1 1 1 9 9 0.5\n"), "expected 7 fields"),
        (of_mot("1,-1,x,1,9,9,0.5\n"), "det.txt:1: expected a finite number"),
        (
            of_yolo("0 320 240 50 60\n"),
            "10.5.txt:1: expected numbers from 0 to 1, as shares of the image, got 320",
        ),
        (of_yolo("2 0.5 0.5 0.1 0.1\n"), "there is no class 2: the list of classes has 2"),
        (of_yolo("0 0.5 0.5 0.1\n"), "expected 5 fields"),
        (of_yolo("0 0.4 0.5 0.9 0.95\n0 0.3 0.3 0.9 0.9\n"), "last two numbers are the right"),
        (
            of_kitti("2 3 Car 0 0 0 1 1 9 9 1 1 1 1 1 1 1\n"),
            "if images are numbered from 1, set `frames.first = 1`",
        ),
        (of_kitti("1 3 Car 0 0 0 9 1 1 9 1 1 1 1 1 1 1\n"), "expected a box with xmin ≤ xmax"),
        (of_kitti("1 Car 9 1 1 9\n"), "expected 17 fields"),
    ];
    for (fault, words) in faults {
        assert!(fault.contains(words), "{fault}");
    }
    let neither = json!({"format": "kitti", "file": "a.txt", "frames": {}});
    assert!(read(neither, &[("a.txt", "")]).unwrap_err().contains("either `rate` or `times`"));
}

#[test]
fn keypoints_after_a_box_are_no_outline() {
    let yolo = json!({"format": "yolo", "folder": "labels", "classes": "names.txt"});
    let sides = |line: &str| {
        let files = [("names.txt", "\u{feff}cup\nbook\n"), ("labels/10.5.txt", line)];
        let row = read(yolo.clone(), &files).unwrap().remove(0);
        assert_eq!(row.class_name, "cup");
        [row.xmin, row.ymin, row.xmax, row.ymax].map(|x| (x * 10.0).round() / 10.0)
    };
    let of_box = sides("0 0.5 0.5 0.2 0.4\n");
    assert_eq!(of_box, [256.0, 144.0, 384.0, 336.0]);
    // two and three keypoints, of which one is hidden
    assert_eq!(sides("0 0.5 0.5 0.2 0.4 0.45 0.4 2 0.55 0.6 1\n"), of_box);
    assert_eq!(sides("0 0.5 0.5 0.2 0.4 0.45 0.4 2 0 0 0 0.55 0.6 1\n"), of_box);
    // an outline of five corners
    assert_eq!(sides("0 0.5 0.5 0.6 0.5 0.6 0.6 0.55 0.7 0.5 0.6\n"), [320.0, 240.0, 384.0, 336.0]);
}

#[test]
fn a_list_of_classes_has_one_name_per_line() {
    let fault = |name: &str, text: &str| {
        let yolo = json!({"format": "yolo", "folder": "labels", "classes": name});
        read(yolo, &[(name, text), ("labels/10.5.txt", "0 0.5 0.5 0.1 0.1\n")]).unwrap_err()
    };
    for (name, text, words) in [
        ("data.yaml", "names: [cup]\n", "write the `names` of the YAML file as lines"),
        ("names.txt", "cup\n\nbook\n", "names.txt:2: expected a class, got an empty line"),
        ("names.txt", "0: cup\n1: book\n", "names.txt:1: expected the name of a class alone"),
        ("names.txt", "train: a\nnames:\n", "names.txt:2: expected the name of a class alone"),
    ] {
        let fault = fault(name, text);
        assert!(fault.contains(words), "{fault}");
    }
}

#[test]
fn rows_of_a_truth_that_are_not_considered_are_no_objects() {
    let mot = json!({"format": "mot", "file": "gt.txt", "class": "person", "frames": {"times": "times.txt"}});
    let rows = "1,1,1,1,9,9,1,1,1.0\n1,2,20,1,9,9,0,8,0.5\n2,3,1,1,9,9,1,1,0.2\n";
    assert_eq!(read(mot.clone(), &[("gt.txt", rows), ("times.txt", "10\n11\n")]).unwrap().len(), 2);
    // detections with a score of zero have ten fields
    let rows = "1,-1,1,1,9,9,0,-1,-1,-1\n";
    assert_eq!(read(mot, &[("gt.txt", rows), ("times.txt", "10\n11\n")]).unwrap().len(), 1);
}

#[test]
fn a_crowd_is_no_object() {
    let file = coco(|file| file["annotations"][0]["iscrowd"] = json!(1));
    let rows = read(json!({"format": "coco", "file": "a.json"}), &[("a.json", &file)]).unwrap();
    assert_eq!(rows.iter().map(|row| row.class_name.as_str()).collect::<Vec<_>>(), ["book"]);
}

use super::*;

#[test]
fn before_the_first_frame_there_is_a_map_of_nothing() {
    let state = LiveMap::new("desk", "only").to_json();
    assert_eq!((&state["phase"], &state["frames"]), (&"waiting".into(), &0.into()));
    let scene = &state["run"]["variants"][0];
    assert_eq!((&scene["name"], &scene["frames"]), (&"only".into(), &json!([])));
    assert!(state["cost"].is_null());
}

#[test]
fn a_phase_keeps_the_cost_that_is_known() {
    let mut map = LiveMap::new("desk", "only");
    map.enter(Phase::Solving { iteration: 3 }, Some(2.5));
    map.enter(Phase::Ended("all is written".to_owned()), None);
    let state = map.to_json();
    assert_eq!((&state["phase"], &state["words"]), (&"ended".into(), &"all is written".into()));
    assert_eq!(state["cost"], 2.5);
}

#[test]
fn a_box_has_its_label_behind_what_is_drawn() {
    let measured = BoundingBox::new([1.0, 2.0, 3.0, 4.5]).unwrap();
    let nameless = LiveBox::Nameless(measured, "<script>".to_owned());
    assert_eq!(nameless.to_json(), json!([null, [1, 2, 3, 4.5], null, "<script>"]));
    let seen = SeenBox::new(ObjectId(7), measured, None, &NO_CAMERA);
    assert_eq!(LiveBox::Named(seen, "cup 7".to_owned()).to_json(), json!([7, [1, 2, 3, 4.5], null, "cup 7"]));
}

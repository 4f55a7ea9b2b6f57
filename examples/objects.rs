//! An object is mapped as an ellipsoid from its boxes in images. It is seen from one side only, so an orientation factor helps.
//! `cargo run --release --example objects`
#![allow(clippy::print_stdout, reason = "an example prints")]
use manifactor::geometry::{Camera, Se3, So3};
use manifactor::prelude::*;
use manifactor::quadric::{BoundingBox, BoundingBoxFactor, BoxModel, DualQuadric, VerticalOrientationSmooth};
use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let camera = Camera::new([525.0, 525.0, 320.0, 240.0], 640, 480)?;
    let quadric = |tilt, size: [f64; 3]| DualQuadric {
        pose: Se3::new(So3::exp(&Vector3::new(0.0, tilt, 0.0)), Vector3::new(0.0, 2.0, 0.0)),
        semi_axes: size.into(),
    };
    let bottle = quadric(0.0, [0.05, 0.05, 0.15]);
    // cameras on an arc of 80°; their z axis points along the world's y axis
    let forward = So3::exp(&Vector3::new(-std::f64::consts::FRAC_PI_2, 0.0, 0.0));
    for orientation in [false, true] {
        let (mut graph, mut values) = (Graph::new(), Values::new());
        for i in 0..8 {
            let angle = (f64::from(i) - 3.5) * 0.2;
            let turn = So3::exp(&Vector3::new(0.0, 0.0, angle));
            let position = Vector3::new(2.0 * angle.sin(), 2.0 - 2.0 * angle.cos(), 0.3);
            let pose = Se3::new(So3::compose(&turn, &forward), position);
            let mut seen = BoundingBoxFactor {
                bounding_box: BoundingBox::new([0.0; 4])?,
                camera,
                model: BoxModel::Standard,
            };
            let exact = seen.predict(&pose, &bottle).ok_or("the object is behind a camera")?.bounds();
            // a detector is wrong by up to a pixel
            let wrong = |side: usize| (f64::from(i) * 7.3 + side as f64 * 2.9).sin();
            seen.bounding_box = BoundingBox::new(std::array::from_fn(|side| exact[side] + wrong(side)))?;
            let key = Key::indexed("x", i);
            values.insert(key.clone(), pose);
            graph.fix(key.clone());
            graph.add([key, "q0".into()], seen).noise(Noise::sigma(1.0)?);
        }
        values.insert("q0", quadric(0.4, [0.1, 0.1, 0.1]));
        if orientation {
            graph.add(["q0"], VerticalOrientationSmooth::default()).noise(Noise::sigma(0.01)?);
        }
        let solution = solve(&graph, &values, &Auto::default(), &mut Silent)?;
        let found = solution.values.get::<DualQuadric>("q0")?;
        println!(
            "{} an orientation factor: tilt {:.1}°, semi-axes {:.3?} m, {}",
            if orientation { "with" } else { "without" },
            found.major_axis().z.abs().min(1.0).acos().to_degrees(),
            found.semi_axes.as_slice(),
            solution.outcome.termination,
        );
    }
    Ok(())
}

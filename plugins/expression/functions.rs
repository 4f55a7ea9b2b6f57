//! Functions of numbers and vectors. Those of rotations, poses and objects are registered where these are defined.
use manifactor_graph::register_functions;
use nalgebra::{Vector2, Vector3, Vector6};

register_functions! {
    /// Sum.
    "+" fn add(a: f64, b: f64) -> f64 { a + b }

    /// Difference.
    "-" fn subtract(a: f64, b: f64) -> f64 { a - b }

    /// The other sign.
    "-" fn negate(a: f64) -> f64 { -a }

    /// Product.
    "*" fn multiply(a: f64, b: f64) -> f64 { a * b }

    /// Quotient.
    "/" fn divide(a: f64, b: f64) -> f64 { a / b }

    /// A power; the exponent has to be constant.
    "^" fn power(a: f64, exponent: f64) -> f64 {
        let n = exponent.re();
        if n.fract() == 0.0 && n.abs() <= 64.0 { a.powi(n as i32) } else { a.powf(exponent) }
    }

    /// The absolute value. At zero it has a kink; the derivative taken there is that of a > 0.
    fn abs(a: f64) -> f64 { if a < T::zero() { -a } else { a } }

    /// The square root. Its derivative at zero is infinite.
    fn sqrt(a: f64) -> f64 { a.sqrt() }

    /// The exponential.
    fn exp(a: f64) -> f64 { a.exp() }

    /// The natural logarithm.
    fn ln(a: f64) -> f64 { a.ln() }

    /// The sine of an angle in radians.
    fn sin(a: f64) -> f64 { a.sin() }

    /// The cosine of an angle in radians.
    fn cos(a: f64) -> f64 { a.cos() }

    /// The tangent of an angle in radians.
    fn tan(a: f64) -> f64 { a.tan() }

    /// The angle of a sine, in radians. Its derivative at ±1 is infinite.
    fn asin(a: f64) -> f64 { a.asin() }

    /// The angle of a cosine, in radians. Its derivative at ±1 is infinite: `angle(a, b)` has no such place but 0 and π.
    fn acos(a: f64) -> f64 { a.acos() }

    /// The angle of a tangent, in radians.
    fn atan(a: f64) -> f64 { a.atan() }

    /// The lesser of two, the first of equals.
    fn min(a: f64, b: f64) -> f64 { if b < a { b } else { a } }

    /// The greater of two, the first of equals.
    fn max(a: f64, b: f64) -> f64 { if b > a { b } else { a } }

    /// A branch: `a` where the first is above zero, `b` elsewhere. Its derivative is that of the one that is taken.
    "where" fn branch(positive: f64, a: f64, b: f64) -> f64 { if positive > T::zero() { a } else { b } }

    /// The vector of these; `[x, y]` is short for it.
    fn vector(x: f64, y: f64) -> Vector2<f64> { Vector2::new(x, y) }

    /// The vector of these; `[x, y, z]` is short for it.
    fn vector(x: f64, y: f64, z: f64) -> Vector3<f64> { Vector3::new(x, y, z) }

    /// The first component.
    fn x(v: Vector2<f64>) -> f64 { v.x }

    /// The second component.
    fn y(v: Vector2<f64>) -> f64 { v.y }

    /// The first component.
    fn x(v: Vector3<f64>) -> f64 { v.x }

    /// The second component.
    fn y(v: Vector3<f64>) -> f64 { v.y }

    /// The third component.
    fn z(v: Vector3<f64>) -> f64 { v.z }

    /// The vector product.
    fn cross(a: Vector3<f64>, b: Vector3<f64>) -> Vector3<f64> { a.cross(&b) }

    /// The area between two vectors, with its sign.
    fn cross(a: Vector2<f64>, b: Vector2<f64>) -> f64 { a.x * b.y - a.y * b.x }

    /// Where a point is seen, in the frame of a camera that looks along z: (x, y)/z.
    fn project(v: Vector3<f64>) -> Vector2<f64> { v.xy() / v.z }

    /// The logarithm of each component.
    fn ln(v: Vector3<f64>) -> Vector3<f64> { v.map(|x| x.ln()) }

    /// The absolute value of each component.
    fn abs(v: Vector3<f64>) -> Vector3<f64> { v.map(|x| if x < T::zero() { -x } else { x }) }
}

macro_rules! vectors {
    ($($vector:ty),+) => { $(register_functions! {
        /// Sum.
        "+" fn add(a: $vector, b: $vector) -> $vector { a + b }

        /// Difference.
        "-" fn subtract(a: $vector, b: $vector) -> $vector { a - b }

        /// The other way.
        "-" fn negate(v: $vector) -> $vector { -v }

        /// The vector, scaled.
        "*" fn scale(v: $vector, by: f64) -> $vector { v * by }

        /// The vector, scaled.
        "*" fn scale(by: f64, v: $vector) -> $vector { v * by }

        /// The vector, divided by a number.
        "/" fn shorten(v: $vector, by: f64) -> $vector { v / by }

        /// Component by component.
        fn multiply(a: $vector, b: $vector) -> $vector { a.component_mul(&b) }

        /// Component by component.
        fn divide(a: $vector, b: $vector) -> $vector { a.component_div(&b) }

        /// The scalar product.
        fn dot(a: $vector, b: $vector) -> f64 { a.dot(&b) }

        /// The sum of the squares.
        fn norm_squared(v: $vector) -> f64 { v.norm_squared() }

        /// The length. At zero it has a kink; the derivative taken there is zero.
        fn norm(v: $vector) -> f64 {
            let squared = v.norm_squared();
            if squared > T::zero() { squared.sqrt() } else { squared }
        }

        /// The vector, one long.
        fn unit(v: $vector) -> $vector { v / v.norm_squared().sqrt() }

        /// How far apart two points are. Where they meet, its derivative is taken as zero.
        fn distance(a: $vector, b: $vector) -> f64 {
            let squared = (a - b).norm_squared();
            if squared > T::zero() { squared.sqrt() } else { squared }
        }

        /// A branch: `a` where the first is above zero, `b` elsewhere. Its derivative is that of the one that is taken.
        "where" fn branch(positive: f64, a: $vector, b: $vector) -> $vector { if positive > T::zero() { a } else { b } }

        /// The sum of the components.
        fn sum(v: $vector) -> f64 { v.iter().fold(T::zero(), |sum, x| sum + *x) }

        /// The greatest component, the first of equals.
        fn largest(v: $vector) -> f64 { v.iter().fold(v[0], |most, x| if *x > most { *x } else { most }) }

        /// The least component, the first of equals.
        fn smallest(v: $vector) -> f64 { v.iter().fold(v[0], |least, x| if *x < least { *x } else { least }) }
    })+ };
}
vectors!(Vector2<f64>, Vector3<f64>, Vector6<f64>);

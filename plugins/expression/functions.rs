//! Functions of numbers and vectors. The crates of rotations, poses and objects register the functions of
//! those types.
use manifactor_graph::register_functions;
use nalgebra::{Vector2, Vector3, Vector6};

register_functions! {
    /// The sum.
    "+" fn add(a: f64, b: f64) -> f64 { a + b }

    /// The difference.
    "-" fn subtract(a: f64, b: f64) -> f64 { a - b }

    /// The negative.
    "-" fn negate(a: f64) -> f64 { -a }

    /// The product.
    "*" fn multiply(a: f64, b: f64) -> f64 { a * b }

    /// The quotient.
    "/" fn divide(a: f64, b: f64) -> f64 { a / b }

    /// The power; the exponent must be constant.
    "^" fn power(a: f64, exponent: f64) -> f64 {
        let n = exponent.re();
        if n.fract() == 0.0 && n.abs() <= 64.0 { a.powi(n as i32) } else { a.powf(exponent) }
    }

    /// The absolute value. It has a kink at zero; the derivative for a > 0 is used there.
    fn abs(a: f64) -> f64 { if a < T::zero() { -a } else { a } }

    /// The square root. Its derivative at zero is infinite.
    fn sqrt(a: f64) -> f64 { a.sqrt() }

    /// The exponential function.
    fn exp(a: f64) -> f64 { a.exp() }

    /// The natural logarithm.
    fn ln(a: f64) -> f64 { a.ln() }

    /// The sine of an angle in radians.
    fn sin(a: f64) -> f64 { a.sin() }

    /// The cosine of an angle in radians.
    fn cos(a: f64) -> f64 { a.cos() }

    /// The tangent of an angle in radians.
    fn tan(a: f64) -> f64 { a.tan() }

    /// The arcsine, in radians. Its derivative at ±1 is infinite.
    fn asin(a: f64) -> f64 { a.asin() }

    /// The arccosine, in radians. Its derivative at ±1 is infinite; `angle(a, b)` has kinks only at 0 and π.
    fn acos(a: f64) -> f64 { a.acos() }

    /// The arctangent, in radians.
    fn atan(a: f64) -> f64 { a.atan() }

    /// The smaller of two numbers, the first if they are equal.
    fn min(a: f64, b: f64) -> f64 { if b < a { b } else { a } }

    /// The larger of two numbers, the first if they are equal.
    fn max(a: f64, b: f64) -> f64 { if b > a { b } else { a } }

    /// A branch: `a` if `positive` is above zero, otherwise `b`. Its derivative is taken from the selected
    /// branch.
    "where" fn branch(positive: f64, a: f64, b: f64) -> f64 { if positive > T::zero() { a } else { b } }

    /// The vector of two components; `[x, y]` is short for it.
    fn vector(x: f64, y: f64) -> Vector2<f64> { Vector2::new(x, y) }

    /// The vector of three components; `[x, y, z]` is short for it.
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

    /// The cross product.
    fn cross(a: Vector3<f64>, b: Vector3<f64>) -> Vector3<f64> { a.cross(&b) }

    /// The signed area of the parallelogram between two vectors.
    fn cross(a: Vector2<f64>, b: Vector2<f64>) -> f64 { a.x * b.y - a.y * b.x }

    /// The projection (x, y)/z of a point in the frame of a camera that looks along z.
    fn project(v: Vector3<f64>) -> Vector2<f64> { v.xy() / v.z }

    /// The logarithm of each component.
    fn ln(v: Vector3<f64>) -> Vector3<f64> { v.map(|x| x.ln()) }

    /// The absolute value of each component.
    fn abs(v: Vector3<f64>) -> Vector3<f64> { v.map(|x| if x < T::zero() { -x } else { x }) }
}

macro_rules! vectors {
    ($($vector:ty),+) => { $(register_functions! {
        /// The sum.
        "+" fn add(a: $vector, b: $vector) -> $vector { a + b }

        /// The difference.
        "-" fn subtract(a: $vector, b: $vector) -> $vector { a - b }

        /// The vector in the opposite direction.
        "-" fn negate(v: $vector) -> $vector { -v }

        /// The scaled vector.
        "*" fn scale(v: $vector, by: f64) -> $vector { v * by }

        /// The scaled vector.
        "*" fn scale(by: f64, v: $vector) -> $vector { v * by }

        /// The vector divided by a number.
        "/" fn shorten(v: $vector, by: f64) -> $vector { v / by }

        /// The componentwise product.
        fn multiply(a: $vector, b: $vector) -> $vector { a.component_mul(&b) }

        /// The componentwise quotient.
        fn divide(a: $vector, b: $vector) -> $vector { a.component_div(&b) }

        /// The scalar product.
        fn dot(a: $vector, b: $vector) -> f64 { a.dot(&b) }

        /// The squared length.
        fn norm_squared(v: $vector) -> f64 { v.norm_squared() }

        /// The length. It has a kink at zero; the derivative returned there is zero.
        fn norm(v: $vector) -> f64 {
            let squared = v.norm_squared();
            if squared > T::zero() { squared.sqrt() } else { squared }
        }

        /// The vector, normalized to length one.
        fn unit(v: $vector) -> $vector { v / v.norm_squared().sqrt() }

        /// The distance between two points. If they coincide, the derivative returned is zero.
        fn distance(a: $vector, b: $vector) -> f64 {
            let squared = (a - b).norm_squared();
            if squared > T::zero() { squared.sqrt() } else { squared }
        }

        /// A branch: `a` if `positive` is above zero, otherwise `b`. Its derivative is taken from the selected
        /// branch.
        "where" fn branch(positive: f64, a: $vector, b: $vector) -> $vector { if positive > T::zero() { a } else { b } }

        /// The sum of the components.
        fn sum(v: $vector) -> f64 { v.iter().fold(T::zero(), |sum, x| sum + *x) }

        /// The largest component, the first of equal ones.
        fn largest(v: $vector) -> f64 { v.iter().fold(v[0], |most, x| if *x > most { *x } else { most }) }

        /// The smallest component, the first of equal ones.
        fn smallest(v: $vector) -> f64 { v.iter().fold(v[0], |least, x| if *x < least { *x } else { least }) }
    })+ };
}
vectors!(Vector2<f64>, Vector3<f64>, Vector6<f64>);

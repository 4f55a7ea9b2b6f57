//! All forms of a noise model whiten consistently, and invalid noise models are rejected.
use manifactor_graph::Noise;
use manifactor_graph::noise::NoiseError;
use nalgebra::DMatrix;
use proptest::prelude::*;

/// Covariances of three rows, with standard deviations from 0.01 to 10.
fn covariance() -> impl Strategy<Value = DMatrix<f64>> {
    let root = proptest::collection::vec(-1.0..1.0, 9).prop_map(|v| DMatrix::from_vec(3, 3, v));
    let scales = proptest::collection::vec(0.01..10.0f64, 3);
    (root, scales).prop_map(|(root, s)| {
        let s = DMatrix::from_diagonal(&s.into());
        &s * (&root * root.transpose() + DMatrix::identity(3, 3) * 0.1) * &s
    })
}
fn close(a: &DMatrix<f64>, b: &DMatrix<f64>) -> bool {
    (a - b).amax() <= 1e-9 * b.amax()
}
fn information(noise: &Noise) -> DMatrix<f64> {
    let w = noise.whitener(3).unwrap().matrix(3);
    assert_eq!(w.lower_triangle().amax(), w.diagonal().amax(), "W is upper triangular");
    w.tr_mul(&w)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(256))]

    #[test]
    fn covariance_and_information_whiten_alike(covariance in covariance()) {
        let inverse = covariance.clone().try_inverse().unwrap();
        let inverse = (&inverse + inverse.transpose()) * 0.5;
        let of_covariance = information(&Noise::covariance(covariance).unwrap());
        let of_information = information(&Noise::information(inverse.clone()).unwrap());
        prop_assert!(close(&of_covariance, &inverse) && close(&of_information, &inverse));
    }

    #[test]
    fn rows_that_are_not_observed_are_marginalized(covariance in covariance()) {
        let inverse = covariance.clone().try_inverse().unwrap();
        let inverse = (&inverse + inverse.transpose()) * 0.5;
        let kept = covariance.clone().remove_row(1).remove_column(1).try_inverse().unwrap();
        let expected = kept.insert_row(1, 0.0).insert_column(1, 0.0);
        for noise in [Noise::covariance(covariance).unwrap(), Noise::information(inverse).unwrap()] {
            let found = information(&noise.observing(&[true, false, true]));
            prop_assert!(close(&found, &expected), "{found} {expected}");
        }
    }

    #[test]
    fn standard_deviations_are_a_diagonal_covariance(s in proptest::array::uniform3(0.01..10.0f64)) {
        let variances = DMatrix::from_diagonal(&s.map(|s| s * s).to_vec().into());
        let full = information(&Noise::covariance(variances).unwrap());
        prop_assert!(close(&information(&Noise::sigmas(&s).unwrap()), &full));
        let alike = information(&Noise::sigma(s[0]).unwrap());
        prop_assert!(close(&alike, &information(&Noise::sigmas(&[s[0]; 3]).unwrap())));
    }

    #[test]
    fn documents_read_back(covariance in covariance(), mask in any::<bool>()) {
        let noise = Noise::covariance(covariance).unwrap();
        let noise = if mask { noise.observing(&[true, false, true]) } else { noise };
        let text = serde_json::to_string(&noise).unwrap();
        prop_assert_eq!(serde_json::from_str::<Noise>(&text).unwrap(), noise);
    }
}

#[test]
fn unit_noise_changes_nothing() {
    assert_eq!(information(&Noise::unit()), DMatrix::identity(3, 3));
    let masked = information(&Noise::unit().observing(&[true, false, true]));
    assert_eq!(masked, DMatrix::from_diagonal(&vec![1.0, 0.0, 1.0].into()));
}

#[test]
fn a_measured_information_matrix_is_handed_back_as_it_was() {
    let m = DMatrix::from_row_slice(2, 2, &[2.0, 0.1, 0.1, 3.0]);
    assert_eq!(Noise::information(m.clone()).unwrap().information_matrix(2).unwrap(), m);
}

#[test]
fn what_is_no_noise_is_refused() {
    for s in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-320] {
        assert!(matches!(Noise::sigma(s), Err(NoiseError::NotPositive(_))), "{s}");
    }
    let matrix = |entries: &[f64]| Noise::information(DMatrix::from_row_slice(2, 2, entries));
    assert!(
        matches!(matrix(&[1.0, 2.0, 2.0, 1.0]), Err(NoiseError::NotPositiveDefinite { smallest }) if smallest < 0.0)
    );
    assert!(matches!(matrix(&[1.0, 0.0, 0.0, 0.0]), Err(NoiseError::NotPositiveDefinite { .. })));
    assert!(matches!(matrix(&[1.0, 0.5, 0.4, 1.0]), Err(NoiseError::NotSymmetric { row: 0, column: 1, .. })));
    assert!(matches!(matrix(&[1.0, 0.0, 0.0, f64::NAN]), Err(NoiseError::NotFinite(1, 1))));
}

#[test]
fn a_noise_has_to_fit_its_residual() {
    let two = Noise::sigmas(&[1.0, 2.0]).unwrap();
    let wrong = Err(NoiseError::Dimension { expected: 3, found: 2, names: &[] });
    assert_eq!(two.whitener(3), wrong);
    let masked = Noise::unit().observing(&[true, false]);
    assert_eq!(masked.whitener(3), wrong);
    let nothing = Noise::unit().observing(&[false; 3]);
    assert_eq!(nothing.whitener(3), Err(NoiseError::NothingObserved));
}

#[test]
fn documents_are_checked() {
    let read = |text: &str| serde_json::from_str::<Noise>(text).map_err(|e| e.to_string());
    assert_eq!(read("{}"), Ok(Noise::unit()));
    assert_eq!(read(r#"{ "sigma": 2 }"#), Ok(Noise::sigma(2.0).unwrap()));
    let error = |text| read(text).unwrap_err();
    assert!(error(r#"{ "sigma": 1, "sigmas": [1] }"#).contains("got sigma and sigmas"));
    assert!(error(r#"{ "covariance": [[1, 0], [0]] }"#).contains("row 1 has 1 entries"));
    assert!(error(r#"{ "sigma": -1 }"#).contains("above zero, got -1"));
    assert!(error(r#"{ "std": 1 }"#).contains("unknown field `std`"));
}

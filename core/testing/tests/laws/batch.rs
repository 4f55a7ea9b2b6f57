//! The terms of a batch in H and g equal those of the factor's own Jacobian, whitened and weighted.
use crate::dynamic::Chain;
use crate::toy::{Area, SOUND, Spot, Spread};
use manifactor_graph::batch::Member;
use manifactor_graph::column::{Columns, FIXED};
use manifactor_graph::loss::{Cauchy, Loss};
use manifactor_graph::normal_equations::{NormalEquations, Slot};
use manifactor_graph::{Factor, Noise, Variable};
use nalgebra::{DMatrix, DVector};
use std::any::TypeId;

/// A factor in a small problem, with the first scalar of each two-dimensional variable and its held
/// directions.
struct Setup<'a> {
    factor: &'a dyn Factor,
    spots: Vec<Spot>,
    starts: Vec<u32>,
    held: Vec<u32>,
    noise: Noise,
    loss: Option<&'a dyn Loss>,
}

impl<'a> Setup<'a> {
    /// Creates a setup with all variables free, in order.
    fn new(factor: &'a dyn Factor, count: usize) -> Self {
        let spots = (0..count).map(|i| Spot([0.3 * i as f64 - 0.5, 0.2 + 0.1 * i as f64].into()));
        Self {
            factor,
            spots: spots.collect(),
            starts: (0..count as u32).map(|i| 2 * i).collect(),
            held: vec![0; count],
            noise: Noise::unit(),
            loss: None,
        }
    }
    fn variables(&self) -> Vec<&dyn Variable> {
        self.spots.iter().map(|s| s as &dyn Variable).collect()
    }
    fn rows(&self) -> usize {
        self.factor.erased().signature().rows.unwrap()
    }
    fn size(&self) -> usize {
        self.starts.iter().filter(|s| **s != FIXED).map(|s| *s as usize + 2).max().unwrap_or(0)
    }

    /// Computes H, g and the cost by the batch.
    fn by_batch(&self) -> (DMatrix<f64>, DVector<f64>, f64) {
        let n = self.size();
        // entry (i, j) of the packed lower triangle
        let packed = |i: usize, j: usize| j * n - j * (j + 1) / 2 + i;
        let mut columns = Columns::default();
        let place = columns.add(TypeId::of::<Spot>(), self.variables()[0].erased().new_column());
        self.variables().iter().for_each(|v| columns.column_mut(place).push(*v));
        let mut slots = vec![];
        for (a, &sa) in self.starts.iter().enumerate() {
            for &sb in &self.starts[..=a] {
                let swapped = sa < sb;
                let (row, column) =
                    if swapped { (sb as usize, sa as usize) } else { (sa as usize, sb as usize) };
                let free = sa != FIXED && sb != FIXED;
                let (at, stride) = if free { (packed(row, column), n - column - 1) } else { (0, 0) };
                slots.push(Slot { at, stride: stride as u32, swapped });
            }
        }
        let whitener = self.noise.whitener(self.rows()).unwrap();
        let mut batch = self.factor.erased().new_batch(&whitener, self.loss);
        batch.push(&Member {
            entry: 7,
            factor: self.factor.erased().as_any(),
            index: &(0..self.spots.len() as u32).collect::<Vec<_>>(),
            starts: &self.starts,
            fixed: &self.held,
            slots: &slots,
            whitener: &whitener,
            loss: self.loss,
        });
        let (mut h, mut g) = (vec![0.0; n * (n + 1) / 2], vec![0.0; n]);
        let evaluation = batch.linearize(&columns, &mut NormalEquations { h: &mut h, g: &mut g });
        assert_eq!(batch.cost(&columns).cost, evaluation.cost);
        let h = DMatrix::from_fn(n, n, |i, j| h[packed(i.max(j), i.min(j))]);
        (h, g.into(), evaluation.cost)
    }

    /// Computes H, g and the cost from one dense Jacobian.
    fn by_hand(&self) -> (DMatrix<f64>, DVector<f64>, f64) {
        let linearization = self.factor.erased().linearize(&self.variables()).unwrap();
        let w = self.noise.whitener(self.rows()).unwrap().matrix(self.rows());
        let mut j = DMatrix::zeros(self.rows(), self.size());
        for (v, block) in linearization.jacobians.iter().enumerate() {
            for c in (0..2).filter(|c| self.starts[v] != FIXED && self.held[v] >> c & 1 == 0) {
                j.set_column(self.starts[v] as usize + c, &block.column(c));
            }
        }
        let (j, r) = (&w * j, &w * DVector::from(linearization.residual));
        let (rho, weight) = self.loss.map_or((r.norm_squared(), 1.0), |l| l.erased().rho(r.norm_squared()));
        (j.tr_mul(&j) * weight, j.tr_mul(&r) * weight, 0.5 * rho)
    }

    fn check(&self) {
        let ((h, g, cost), (h2, g2, cost2)) = (self.by_batch(), self.by_hand());
        assert!(h2.amax() > 0.0 && g2.amax() > 0.0);
        assert!((&h - &h2).amax() < 1e-12 * h2.amax(), "{h} {h2}");
        assert!((&g - &g2).amax() < 1e-12 * g2.amax() && (cost - cost2).abs() < 1e-12, "{g} {g2}");
    }
}

fn correlated() -> Noise {
    Noise::covariance(DMatrix::from_row_slice(2, 2, &[2.0, 0.5, 0.5, 1.0])).unwrap()
}

#[test]
fn a_pair_adds_its_blocks_in_either_order() {
    let area = Area::<SOUND> { area: 1.0 };
    let mut setup = Setup::new(&area as &dyn Factor, 2);
    setup.check();
    setup.starts = vec![2, 0];
    setup.check();
}

#[test]
fn every_form_of_noise_and_a_loss_count() {
    let (area, loss) = (Area::<SOUND> { area: 1.0 }, Cauchy::new(0.5).unwrap());
    let forms = [
        Noise::sigma(0.2).unwrap(),
        Noise::sigmas(&[0.2, 3.0]).unwrap(),
        correlated(),
        Noise::sigma(0.2).unwrap().observing(&[true, false]),
        correlated().observing(&[false, true]),
    ];
    for noise in forms {
        for loss in [None, Some(&loss as &dyn Loss)] {
            Setup { noise: noise.clone(), loss, ..Setup::new(&area, 2) }.check();
        }
    }
}

#[test]
fn a_fixed_variable_has_no_place() {
    let area = Area::<SOUND> { area: 1.0 };
    Setup { starts: vec![FIXED, 0], ..Setup::new(&area, 2) }.check();
    Setup { starts: vec![0, FIXED], ..Setup::new(&area, 2) }.check();
}

#[test]
fn held_directions_have_empty_columns() {
    let area = Area::<SOUND> { area: 1.0 };
    let setup = Setup { held: vec![0b10, 0b01], noise: correlated(), ..Setup::new(&area, 2) };
    setup.check();
    let (h, g, _) = setup.by_batch();
    for held in [1, 2] {
        assert_eq!((h.column(held).amax(), h.row(held).amax(), g[held]), (0.0, 0.0, 0.0));
    }
}

#[test]
fn any_number_of_variables_adds_all_its_pairs() {
    // more than eight variables need allocated blocks
    for count in [1, 2, 3, 8, 11] {
        let mut setup = Setup::new(&Spread {}, count);
        setup.check();
        setup.starts.reverse();
        setup.check();
        if count > 2 {
            setup.starts = (0..count as u32).map(|i| if i == 1 { FIXED } else { 2 * i }).collect();
            setup.held[0] = 0b11;
            setup.check();
        }
    }
}

#[test]
fn rows_and_variables_by_number_add_the_same() {
    // from one row to the largest number; more than eight variables need allocated lists
    for count in 2..=10 {
        let (chain, loss) = (Chain::from(count), Cauchy::new(0.5).unwrap());
        let mut setup = Setup { loss: Some(&loss), ..Setup::new(&chain, count) };
        setup.check();
        setup.starts.reverse();
        setup.check();
        setup.starts[0] = FIXED;
        setup.held[1] = 0b10;
        setup.check();
    }
}

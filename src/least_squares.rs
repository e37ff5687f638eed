//! Least squares with lower bounds on the unknowns.

/// Normal equations ½·xᵀHx − bᵀx of a weighted least-squares problem. Rows are added one by one.
#[derive(Clone, Debug)]
pub(crate) struct NormalEquations {
    n: usize,
    h: Vec<f64>,
    b: Vec<f64>,
}

/// Largest number of sweeps over all unknowns; each costs n².
const MAX_SWEEPS: usize = 500;
/// Relative change of the largest unknown at which the sweeps end.
const TOLERANCE: f64 = 1e-6;

impl NormalEquations {
    pub(crate) fn new(unknowns: usize) -> Self {
        Self { n: unknowns, h: vec![0.0; unknowns * unknowns], b: vec![0.0; unknowns] }
    }

    /// Adds weight · (row·x − wanted)². The row consists of its nonzero entries in ascending order.
    pub(crate) fn add(&mut self, row: &[(usize, f64)], wanted: f64, weight: f64) {
        debug_assert!(row.is_sorted_by_key(|(i, _)| *i), "only the upper triangle of H is filled");
        for (k, &(i, a)) in row.iter().enumerate() {
            let weighted = weight * a;
            self.b[i] += weighted * wanted;
            if weighted != 0.0 {
                let h = &mut self.h[i * self.n..(i + 1) * self.n];
                for &(j, c) in &row[k..] {
                    h[j] += weighted * c;
                }
            }
        }
    }

    /// Minimizes the sum over x ≥ floor, by coordinate descent from a start.
    pub(crate) fn solve(&self, start: &[f64], floor: &[f64]) -> Vec<f64> {
        let mut x: Vec<f64> = start.iter().zip(floor).map(|(x, floor)| x.max(*floor)).collect();
        let h = self.symmetric();
        for _ in 0..MAX_SWEEPS {
            let (mut change, mut largest) = (0.0_f64, 1e-30_f64);
            for i in 0..self.n {
                let row = &h[i * self.n..(i + 1) * self.n];
                if row[i] <= 0.0 {
                    continue;
                }
                let gradient = row.iter().zip(&x).map(|(a, b)| a * b).sum::<f64>() - self.b[i];
                let next = (x[i] - gradient / row[i]).max(floor[i]);
                // Scaled to each unknown's own uncertainty, so that all unknowns weigh the same.
                let scale = row[i].sqrt();
                change = change.max((next - x[i]).abs() * scale);
                largest = largest.max(next * scale);
                x[i] = next;
            }
            if change <= TOLERANCE * largest {
                break;
            }
        }
        x
    }

    /// The x ≥ 0 that minimizes the sum, for few unknowns: solved directly, without the unknown with the most negative
    /// value until no value is negative. Unknowns that the equations do not determine are 0.
    pub(crate) fn solve_non_negative(&self) -> Vec<f64> {
        let mut active: Vec<usize> = (0..self.n).collect();
        loop {
            let Some(inverse) = self.only(&active).inverse() else {
                return vec![0.0; self.n];
            };
            let rows = inverse.chunks(active.len().max(1));
            let values: Vec<f64> = rows.map(|row| row.iter().zip(&active).map(|(a, i)| a * self.b[*i]).sum()).collect();
            let min = (0..active.len()).min_by(|a, b| values[*a].total_cmp(&values[*b]));
            match min {
                Some(min) if values[min] < 0.0 && active.len() > 1 => {
                    active.remove(min);
                }
                _ => {
                    let mut x = vec![0.0; self.n];
                    active.iter().zip(values).for_each(|(i, value)| x[*i] = value.max(0.0));
                    return x;
                }
            }
        }
    }

    /// The x that minimizes the sum, solved directly. `None` if the equations do not determine it.
    pub(crate) fn solve_unbounded(&self) -> Option<Vec<f64>> {
        let inverse = self.inverse()?;
        Some(inverse.chunks(self.n).map(|row| row.iter().zip(&self.b).map(|(a, b)| a * b).sum()).collect())
    }

    /// The equations with some of the unknowns only; the others are 0.
    fn only(&self, unknowns: &[usize]) -> Self {
        let h = unknowns.iter().flat_map(|i| unknowns.iter().map(move |j| self.h[i * self.n + j])).collect();
        Self { n: unknowns.len(), h, b: unknowns.iter().map(|i| self.b[*i]).collect() }
    }

    /// Inverse of H by Gauss-Jordan elimination with pivoting; `None` if H is singular.
    pub(crate) fn inverse(&self) -> Option<Vec<f64>> {
        let n = self.n;
        let (mut a, mut inverse) = (self.symmetric(), vec![0.0; n * n]);
        for i in 0..n {
            inverse[i * n + i] = 1.0;
        }
        for column in 0..n {
            let pivot = (column..n).max_by(|i, j| a[i * n + column].abs().total_cmp(&a[j * n + column].abs()))?;
            let value = a[pivot * n + column];
            if value.abs() < 1e-30 {
                return None;
            }
            for k in 0..n {
                a.swap(pivot * n + k, column * n + k);
                inverse.swap(pivot * n + k, column * n + k);
            }
            for k in 0..n {
                a[column * n + k] /= value;
                inverse[column * n + k] /= value;
            }
            for row in (0..n).filter(|row| *row != column) {
                let factor = a[row * n + column];
                for k in 0..n {
                    a[row * n + k] -= factor * a[column * n + k];
                    inverse[row * n + k] -= factor * inverse[column * n + k];
                }
            }
        }
        Some(inverse)
    }

    /// H with its lower triangle.
    fn symmetric(&self) -> Vec<f64> {
        let mut h = self.h.clone();
        for i in 0..self.n {
            for j in 0..i {
                h[i * self.n + j] = h[j * self.n + i];
            }
        }
        h
    }

    /// Diagonal entry of H.
    pub(crate) fn diagonal(&self, i: usize) -> f64 {
        self.h[i * self.n + i]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_of_a_mixture_are_recovered_without_the_part_that_is_not_in_it() {
        let parts = [[1.0, 0.0, 1.0, 0.5], [0.0, 1.0, 1.0, 0.1], [1.0, 1.0, 0.0, 0.7]];
        let mut equations = NormalEquations::new(3);
        for sample in 0..4 {
            let row: Vec<(usize, f64)> = parts.iter().map(|part| part[sample]).enumerate().collect();
            equations.add(&row, 0.25 * parts[0][sample] + 0.75 * parts[2][sample], 1.0);
        }
        let x = equations.solve_non_negative();
        assert!(x.iter().zip([0.25, 0.0, 0.75]).all(|(a, b)| (a - b).abs() < 1e-9), "{x:?}");
        // x = −1 is not allowed: y alone makes the best of y = 1 and y + x = 0.
        let mut equations = NormalEquations::new(2);
        equations.add(&[(1, 1.0)], 1.0, 1.0);
        equations.add(&[(0, 1.0), (1, 1.0)], 0.0, 1.0);
        assert_eq!(equations.solve_non_negative(), [0.0, 0.5]);
    }

    #[test]
    fn negative_answers_are_held_at_zero_and_the_rest_makes_the_best_of_it() {
        // x + y = 1, x = 2: unbounded (2, −1); bounded y = 0 and x = 1.5.
        let mut equations = NormalEquations::new(2);
        equations.add(&[(0, 1.0), (1, 1.0)], 1.0, 1.0);
        equations.add(&[(0, 1.0)], 2.0, 1.0);
        let x = equations.solve(&[0.0; 2], &[0.0; 2]);
        assert!((x[0] - 1.5).abs() < 1e-6 && x[1] == 0.0, "{x:?}");
        // y ≥ 0.5: x = (0.5 + 2) / 2.
        let x = equations.solve(&[0.0; 2], &[0.0, 0.5]);
        assert!((x[0] - 1.25).abs() < 1e-6 && x[1] == 0.5, "{x:?}");
    }

    #[test]
    fn the_inverse_undoes_the_matrix() {
        let mut equations = NormalEquations::new(3);
        equations.add(&[(0, 1.0), (1, 2.0)], 0.0, 1.0);
        equations.add(&[(1, 1.0), (2, -1.0)], 0.0, 2.0);
        equations.add(&[(0, 3.0), (2, 1.0)], 0.0, 0.5);
        let inverse = equations.inverse().expect("three independent rows");
        let h = equations.symmetric();
        for i in 0..3 {
            for j in 0..3 {
                let product: f64 = (0..3).map(|k| h[i * 3 + k] * inverse[k * 3 + j]).sum();
                assert!((product - f64::from(u8::from(i == j))).abs() < 1e-9);
            }
        }
        assert!(NormalEquations::new(2).inverse().is_none());
    }
}

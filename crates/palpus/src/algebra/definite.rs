//! Linear systems with a symmetric positive definite matrix of a few rows, by Cholesky's factors.

/// x with `matrix` · x = `right`; `None` if the matrix is not positive definite, by rounding or by nature.
///
/// Only what stands on and below the diagonal is looked at. Rows of different units do no harm: the factors of a matrix with scaled rows
/// and columns are the scaled factors.
pub fn solve_definite<const N: usize>(mut matrix: [[f64; N]; N], mut right: [f64; N]) -> Option<[f64; N]> {
    // The factor L takes the matrix's place, row by row; L y = right on the way.
    for i in 0..N {
        for j in 0..i {
            let sum: f64 = (0..j).map(|k| matrix[i][k] * matrix[j][k]).sum();
            matrix[i][j] = (matrix[i][j] - sum) / matrix[j][j];
        }
        let square: f64 = matrix[i][..i].iter().map(|x| x * x).sum();
        let pivot = matrix[i][i] - square;
        if !(pivot > 0.0 && pivot.is_finite()) {
            return None;
        }
        matrix[i][i] = pivot.sqrt();
        let sum: f64 = (0..i).map(|k| matrix[i][k] * right[k]).sum();
        right[i] = (right[i] - sum) / matrix[i][i];
    }
    // Lᵀ x = y.
    for i in (0..N).rev() {
        let sum: f64 = (i + 1..N).map(|k| matrix[k][i] * right[k]).sum();
        right[i] = (right[i] - sum) / matrix[i][i];
    }
    right.iter().all(|x| x.is_finite()).then_some(right)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solving_undoes_multiplying_whatever_the_units() {
        // Rows of a Vandermonde matrix, times its transpose, in units from 1e-6 to 1.
        let unit = |i: usize| 10f64.powi(-((i % 7) as i32));
        let row = |i: usize, k: usize| (0.3 + 0.1 * i as f64).powi(k as i32);
        let mut matrix = [[0.0; 6]; 6];
        for (i, line) in matrix.iter_mut().enumerate() {
            for (j, entry) in line.iter_mut().enumerate() {
                let product: f64 = (0..6).map(|k| row(i, k) * row(j, k)).sum();
                *entry = (product + if i == j { 1.0 } else { 0.0 }) * unit(i) * unit(j);
            }
        }
        let expected = [1.0, -20.0, 3e3, 4.0, -5e5, 0.6];
        let right = matrix.map(|line| line.iter().zip(&expected).map(|(m, x)| m * x).sum());
        let found = solve_definite(matrix, right).expect("positive definite");
        for (x, y) in found.iter().zip(&expected) {
            assert!((x - y).abs() < 1e-9 * y.abs(), "{found:?}");
        }
    }

    #[test]
    fn what_cannot_be_solved_is_said() {
        assert_eq!(solve_definite([[0.0; 3]; 3], [0.0; 3]), None);
        assert_eq!(solve_definite([[1.0, 0.0], [2.0, 1.0]], [1.0, 1.0]), None);
        assert_eq!(solve_definite([[f64::NAN]], [1.0]), None);
        assert_eq!(solve_definite([[f64::INFINITY]], [1.0]), None);
    }
}

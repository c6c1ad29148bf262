//! Eigenvalues and eigenvectors of symmetric matrices.

use glam::{DMat3, DVec3};

use super::tolerance::JACOBI_SWEEPS;

/// Returns the eigenvalues of a symmetric matrix in ascending order, and its eigenvectors in the
/// same order. The eigenvectors are the columns of a rotation matrix. The method is Jacobi's.
pub fn eigen(matrix: DMat3) -> (DVec3, DMat3) {
    let mut a = matrix.to_cols_array_2d();
    let mut v = DMat3::IDENTITY.to_cols_array_2d();
    for _ in 0..JACOBI_SWEEPS {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            if a[p][q] == 0.0 {
                continue;
            }
            let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
            let t = theta.signum() / (theta.abs() + theta.hypot(1.0));
            let cosine = 1.0 / t.hypot(1.0);
            let sine = t * cosine;
            for row in &mut a {
                (row[p], row[q]) = (cosine * row[p] - sine * row[q], sine * row[p] + cosine * row[q]);
            }
            for k in 0..3 {
                (a[p][k], a[q][k]) = (cosine * a[p][k] - sine * a[q][k], sine * a[p][k] + cosine * a[q][k]);
                (v[p][k], v[q][k]) = (cosine * v[p][k] - sine * v[q][k], sine * v[p][k] + cosine * v[q][k]);
            }
            (a[p][q], a[q][p]) = (0.0, 0.0);
        }
    }
    let mut order = [0, 1, 2];
    order.sort_by(|&i, &j| a[i][i].total_cmp(&a[j][j]));
    let [x, y, _] = order.map(|k| DVec3::from(v[k]).normalize());
    let z = x.cross(y).normalize();
    (DVec3::from(order.map(|k| a[k][k])), DMat3::from_cols(x, y, z))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eigenvalues_and_axes_restore_the_matrix() {
        let m = DMat3::from_cols_array(&[4.0, 1.0, -2.0, 1.0, 2.0, 0.5, -2.0, 0.5, 3.0]);
        let (values, axes) = eigen(m);
        let again = axes * DMat3::from_diagonal(values) * axes.transpose();
        assert!((again - m).to_cols_array().iter().all(|x| x.abs() < 1e-14));
        assert!(values.x <= values.y && values.y <= values.z && axes.determinant() > 0.0);
    }
}

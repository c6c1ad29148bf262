//! Finds the meaning of the columns of a CSV file.

/// Indices of the columns of time, position and quaternion, and their units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Columns {
    /// Column of the time and the unit of its values in seconds; `None` for poses without times.
    pub(super) time: Option<(usize, f64)>,
    /// Columns of x, y and z.
    pub(super) position: [usize; 3],
    /// Unit of the position in metres; `None` if the column names contain no unit.
    pub(super) metres: Option<f64>,
    /// Columns of x, y, z and w.
    pub(super) quaternion: [usize; 4],
}

const TIMES: [&str; 3] = ["t", "time", "timestamp"];
/// Suffixes of the name of a time column, with the unit in seconds.
const TIME_UNITS: [(&str, f64); 5] = [("", 1.0), ("_s", 1.0), ("_ms", 1e-3), ("_us", 1e-6), ("_ns", 1e-9)];
/// Prefixes of the name of a coordinate column; the letter of the axis follows.
const POSITIONS: [&str; 6] = ["t", "p", "", "pos_", "position_", "translation_"];
/// Suffixes of the name of a coordinate column, with the unit in metres.
const LENGTH_UNITS: [(&str, Option<f64>); 4] =
    [("", None), ("_m", Some(1.0)), ("_cm", Some(1e-2)), ("_mm", Some(1e-3))];
const QUATERNION: [&str; 4] = ["qx", "qy", "qz", "qw"];

/// Finds the columns by the names in a header; the error names the missing columns.
pub(super) fn find(header: &str) -> Result<Columns, String> {
    let names: Vec<&str> = header.split(',').map(|name| name.trim().trim_matches('"')).collect();
    let place = |wanted: &str| names.iter().position(|name| name.eq_ignore_ascii_case(wanted));
    let time = TIMES.iter().find_map(|name| {
        TIME_UNITS.iter().find_map(|(unit, seconds)| Some((place(&format!("{name}{unit}"))?, *seconds)))
    });
    let mut quaternion = [0; 4];
    for (into, name) in quaternion.iter_mut().zip(QUATERNION) {
        *into = place(name).ok_or_else(|| format!("the header has no column {name}"))?;
    }
    // The names of the three coordinates have the same prefix and suffix.
    let position = POSITIONS.iter().find_map(|beginning| {
        LENGTH_UNITS.iter().find_map(|(unit, metres)| {
            let axis = |letter: &str| place(&format!("{beginning}{letter}{unit}"));
            Some(([axis("x")?, axis("y")?, axis("z")?], *metres))
        })
    });
    let (position, metres) =
        position.ok_or("the header has no position: columns tx, ty and tz (or px_m, py_m, pz_m; x, y, z)")?;
    Ok(Columns { time, position, metres, quaternion })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_found_by_name() {
        let robot = find("t_s,px_m,py_m,pz_m,qw,qx,qy,qz,fx_N,fy_N,fz_N,tx_Nm,ty_Nm,tz_Nm").unwrap();
        let expected =
            Columns { time: Some((0, 1.0)), position: [1, 2, 3], metres: Some(1.0), quaternion: [5, 6, 7, 4] };
        assert_eq!(robot, expected);
        let poses = find("tx,ty,tz,qx,qy,qz,qw").unwrap();
        assert_eq!((poses.time, poses.metres, poses.position), (None, None, [0, 1, 2]));
        let other = find("\"qw\", qz, qy, qx, X_mm, y_mm, z_mm, Time_ns").unwrap();
        assert_eq!((other.time, other.metres, other.position), (Some((7, 1e-9)), Some(1e-3), [4, 5, 6]));
        assert!(find("t,qx,qy,qz,qw,x,y").unwrap_err().contains("tx, ty and tz"));
        assert!(find("t,tx,ty,tz,qx,qy,qz").unwrap_err().contains("qw"));
        assert!(find("").is_err());
    }
}

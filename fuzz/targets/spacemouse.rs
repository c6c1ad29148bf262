//! Reports of a SpaceMouse. For all reports, the pose of the state has a unit quaternion and the
//! velocity is within its limits.
#![no_main]

use std::io::{self, Read};

use palpus_device::{HapticDevice, SpaceMouse};
use palpus_fuzz::{Allowance, Bytes, Seed, target};

/// Returns the reports with their lengths, and sometimes an error of the system.
struct Reports(Vec<u8>, usize);

impl Read for Reports {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let mut bytes = Bytes::new(self.0.get(self.1..).unwrap_or_default());
        if bytes.is_empty() {
            return Err(io::ErrorKind::WouldBlock.into());
        }
        let length = bytes.byte();
        self.1 += 1;
        match length {
            251 => return Err(io::ErrorKind::WouldBlock.into()),
            252 => return Err(io::ErrorKind::Interrupted.into()),
            253 => return Err(io::ErrorKind::NotFound.into()),
            _ => {}
        }
        let report = bytes.take(usize::from(length).min(buffer.len()));
        buffer[..report.len()].copy_from_slice(report);
        self.1 += report.len();
        Ok(report.len())
    }
}

fn run(data: &[u8]) {
    let mut mouse = SpaceMouse::of_reports(Reports(data.to_vec(), 0), "SpaceMouse");
    for _ in 0..16 {
        let Ok(state) = mouse.read() else { return };
        assert!(state.pose.is_valid(), "{state:?}");
        assert!(state.twist.linear.abs().max_element() <= 0.121 && state.twist.angular.abs().max_element() <= 1.61);
        assert!(state.time.is_finite() && state.time >= 0.0);
    }
}

fn seeds() -> Vec<Seed> {
    let reports = [
        &[7, 1, 0x5e, 1, 0xa2, 0xfe, 0, 0][..],
        &[13, 1, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12],
        &[3, 3, 0b10, 0],
        &[251],
    ];
    vec![("reports".to_owned(), reports.concat())]
}

target!(run: run, allowance: Allowance { per_byte: 4, always: 1 << 16 }, seeds: seeds);

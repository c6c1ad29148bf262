//! Pictures of the whole window, each in its own file.

use std::fs::OpenOptions;
use std::io;
use std::path::{Path, PathBuf};

use eframe::egui::ColorImage;

use crate::picture::Picture;

/// Folder of the pictures.
const FOLDER: &str = "palpus-out";
/// Largest number of pictures in a folder.
const MOST: u32 = 100_000;

/// Writes the screen content into the first free file; returns its name.
pub(super) fn keep(image: &ColorImage) -> Result<PathBuf, String> {
    keep_in(Path::new(FOLDER), image).map_err(|error| format!("no picture could be written into {FOLDER}: {error}"))
}

fn keep_in(folder: &Path, image: &ColorImage) -> io::Result<PathBuf> {
    std::fs::create_dir_all(folder)?;
    let [width, height] = image.size;
    let mut picture = Picture::new(width, height, [0; 3]);
    for (k, pixel) in image.pixels.iter().enumerate() {
        picture.set_pixel(k % width, k / width, [pixel.r(), pixel.g(), pixel.b()]);
    }
    let file = free(folder)?;
    picture.write_png(&file)?;
    Ok(file)
}

/// Creates the first file whose name is free.
fn free(folder: &Path) -> io::Result<PathBuf> {
    for k in 1..MOST {
        let path = folder.join(format!("window-{k}.png"));
        match OpenOptions::new().write(true).create_new(true).open(&path) {
            Ok(_) => return Ok(path),
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
            Err(error) => return Err(error),
        }
    }
    Err(io::Error::other("there are too many already"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use eframe::egui::Color32;

    #[test]
    fn no_picture_overwrites_another() {
        let folder = std::env::temp_dir().join(format!("palpus-shot-{}", std::process::id()));
        let image = ColorImage::filled([3, 2], Color32::RED);
        let files: Vec<PathBuf> =
            (0..3).map(|_| keep_in(&folder, &image).expect("the picture can be written")).collect();
        let names: Vec<_> = files.iter().filter_map(|file| file.file_name()?.to_str()).collect();
        assert_eq!(names, ["window-1.png", "window-2.png", "window-3.png"]);
        assert!(files.iter().all(|file| std::fs::read(file).is_ok_and(|bytes| bytes.starts_with(b"\x89PNG"))));
        std::fs::remove_dir_all(&folder).expect("the folder can be deleted");
    }
}

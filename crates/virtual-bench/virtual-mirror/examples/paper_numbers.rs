//! Prints what the paper published of its mirror beside what the virtual one (`mirrors/paper.toml`) shows.

use virtual_mirror::paper::LOOP_HZ;
use virtual_mirror::{ConfigError, MirrorConfig, PaperNumbers};

fn main() -> Result<(), ConfigError> {
    let config = match std::env::args().nth(1) {
        Some(path) => MirrorConfig::from_file(path)?,
        None => MirrorConfig::paper(),
    };
    let (published, shown) = (PaperNumbers::PUBLISHED, PaperNumbers::measure(&config)?);
    println!(
        "{:38} {:>10} {:>10} {:>7}",
        "", "published", "virtual", "ratio"
    );
    let line = |what: &str, published: f64, shown: f64| {
        println!(
            "{what:38} {published:10.3} {shown:10.3} {:7.3}",
            shown / published
        );
    };
    line(
        "displacement at 3.5 V (um)",
        published.z_3v5_um,
        shown.z_3v5_um,
    );
    line(
        "displacement at 1.9 V (um, inferred)",
        published.z_1v9_um,
        shown.z_1v9_um,
    );
    line("t95 of a step to 2 V (ms)", published.t95_ms, shown.t95_ms);
    line("creep ends (s)", published.creep_s, shown.creep_s);
    for (i, hz) in LOOP_HZ.into_iter().enumerate() {
        line(
            &format!("loop at {hz} Hz (um)"),
            published.loops[i].width_um,
            shown.loops[i].width_um,
        );
    }
    for (axis, published, shown) in [
        ("x", published.tilt_x, shown.tilt_x),
        ("y", published.tilt_y, shown.tilt_y),
    ] {
        line(
            &format!("tilt {axis}, mean from 2 V (deg)"),
            published.mean_deg,
            shown.mean_deg,
        );
        line(
            &format!("tilt {axis}, standard deviation (deg)"),
            published.sd_deg,
            shown.sd_deg,
        );
    }
    let ranges = shown.loops.map(|l| format!("{:.1}", l.range_um)).join(", ");
    println!("range of the loops shrinks (um):       {ranges}");
    println!(
        "ringing after the step:                {:.1} % of it",
        100.0 * shown.ringing
    );
    Ok(())
}

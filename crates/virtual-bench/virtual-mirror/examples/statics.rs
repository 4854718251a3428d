//! Prints the static curve of a mirror file, or of the default one.

use virtual_mirror::{MirrorConfig, VirtualMirror};

fn main() -> Result<(), virtual_mirror::ConfigError> {
    let config = match std::env::args().nth(1) {
        Some(path) => MirrorConfig::from_file(path)?,
        None => MirrorConfig::bench(),
    };
    let mut mirror = VirtualMirror::new(&config)?;
    println!(
        "{:>5} {:>9} {:>9} {:>9} {:>27} {:>8} {:>8}",
        "V", "z um", "tilt x", "tilt y", "I mA", "mean K", "max K"
    );
    for step in 0..=35 {
        let volts = f64::from(step) * 0.1;
        mirror.advance([volts; 4], 10.0);
        let s = mirror.state();
        let [a, b, c, d] = s.current_a.map(|i| i * 1e3);
        let mean = s.heater_mean_k.iter().sum::<f64>() / 4.0;
        println!(
            "{volts:5.1} {:9.3} {:9.4} {:9.4} {a:6.3} {b:6.3} {c:6.3} {d:6.3} {mean:8.2} {:8.2}",
            s.z_um, s.tilt_x_deg, s.tilt_y_deg, s.hottest_k
        );
    }
    Ok(())
}

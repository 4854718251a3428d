//! Boots an image and says how far it came and how fast: `cargo run -p silicon-twin --example boot -- IMAGE SECONDS`.

use std::time::Instant;

use emulated_board::Connected;
use silicon_twin::board::Board;
use silicon_twin::{Image, Twin};
use virtual_mirror::MirrorConfig;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let path = arguments.next().ok_or("an image is missing")?;
    let seconds = arguments.next().map_or(Ok(0.1), |text| text.parse())?;
    let image = Image::from_elf(&std::fs::read(path)?)?;
    let board = Board::new(&Connected::Mirror(Box::new(MirrorConfig::bench())))?;
    let mut twin = Twin::new(image, board)?;
    let start = Instant::now();
    let outcome = twin.run_for(seconds);
    let wall_s = start.elapsed().as_secs_f64();
    let instructions = twin.cpu.instructions() as f64;
    println!(
        "{:.4} s of the board in {wall_s:.3} s; {:.1} million instructions, {:.1} MIPS",
        twin.seconds(),
        instructions / 1e6,
        instructions / 1e6 / wall_s
    );
    println!(
        "{} ticks, {} feeds of the watchdog",
        twin.chip.trace.ticks(),
        twin.chip.watchdog_feeds()
    );
    println!("last: {:?}", twin.chip.trace.last());
    println!("trace {}", twin.chip.trace.hash());
    let us = |cycles: u64| cycles as f64 / twin.chip.clock.hz() * 1e6;
    for (name, number) in [
        ("ADC1_2", 18),
        ("control loop", 53),
        ("USB_LP", 20),
        ("TIM15", 24),
    ] {
        let handling = twin.timing.interrupt(number);
        let mean = handling.cycles / handling.count.max(1);
        println!(
            "{name}: {} times, mean {:.2} us, longest {:.2} us",
            handling.count,
            us(mean),
            us(handling.longest)
        );
    }
    println!(
        "asleep {:.1} %",
        twin.timing.asleep as f64 / twin.chip.clock.cycles as f64 * 100.0
    );
    match twin.chip.usb_host.device() {
        Some(device) => println!("USB: {device:02x?}"),
        None => println!("USB: {:?}", twin.chip.usb_host.failure()),
    }
    outcome?;
    Ok(())
}

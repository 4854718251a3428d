//! Samples as a block of definite length (IEEE 488.2, 8.7.9).

use mirror_protocol::Telemetry;
use quantities::Span;

use crate::board::Board;
use crate::error::ToolError;
use crate::scpi::{Error, Kind};

/// Samples of one trace: four megabytes of rows, and as many as wait in this tool while it is busy.
pub(super) const MOST_ROWS: u32 = 65_536;
/// Ticks that a 32-bit float tells from one another.
const MOST_TICKS: u32 = 1 << f32::MANTISSA_DIGITS;

/// The columns of a row.
pub(super) const COLUMNS: [(&str, &str); 15] = [
    (
        "t_s",
        "time from the first sample, in the board's time; a multiple of its control tick, exactly so once it is rounded to one",
    ),
    ("V1_V", "drive of actuator 1"),
    ("V2_V", "of 2"),
    ("V3_V", "of 3"),
    ("V4_V", "of 4"),
    ("I1_A", "current of actuator 1"),
    ("I2_A", "of 2"),
    ("I3_A", "of 3"),
    ("I4_A", "of 4"),
    (
        "dT1_K",
        "temperature of heater 1 above ambient; NaN where it is driven too little to tell",
    ),
    ("dT2_K", "of 2"),
    ("dT3_K", "of 3"),
    ("dT4_K", "of 4"),
    (
        "z_m",
        "the board's position sensor; NaN where it has none, or skipped a sample",
    ),
    ("limits", "the limits that act, as a sum"),
];

/// Takes `count` samples, one every `period`.
///
/// # Errors
/// Where they are too many, or the board does not send them.
pub(super) async fn take(board: &Board, count: u32, period: Span) -> Result<Vec<u8>, TraceError> {
    let period_ticks = board.period_ticks(period)?;
    if count > MOST_ROWS || u64::from(count) * u64::from(period_ticks) > MOST_TICKS.into() {
        let longest = board.span(0, MOST_TICKS);
        let said = format!("a trace has at most {MOST_ROWS} samples and lasts at most {longest}");
        return Err(TraceError::Scpi(Error::new(Kind::DataOutOfRange, said)));
    }
    let samples = board.samples(period_ticks, count).await?;
    let first_tick = samples[0].tick;
    let time_s = |sample: &Telemetry| board.span(first_tick, sample.tick).s;
    let rows = samples
        .iter()
        .flat_map(|sample| row(time_s(sample), sample));
    Ok(block(&rows.flat_map(f32::to_le_bytes).collect::<Vec<u8>>()))
}

/// Why there is no trace.
pub(super) enum TraceError {
    Tool(ToolError),
    Scpi(Error),
}

impl From<ToolError> for TraceError {
    fn from(error: ToolError) -> Self {
        Self::Tool(error)
    }
}

fn row(time_s: f64, sample: &Telemetry) -> [f32; COLUMNS.len()] {
    let [v1, v2, v3, v4] = sample.drive_v;
    let [i1, i2, i3, i4] = sample.current_a;
    let [t1, t2, t3, t4] = sample
        .temperature_k
        .map(|kelvin| kelvin.unwrap_or(f32::NAN));
    let z_m = sample.sensor_z_um.map_or(f32::NAN, |um| um * 1e-6);
    let limits = f32::from(sample.limits);
    [
        time_s as f32,
        v1,
        v2,
        v3,
        v4,
        i1,
        i2,
        i3,
        i4,
        t1,
        t2,
        t3,
        t4,
        z_m,
        limits,
    ]
}

fn block(bytes: &[u8]) -> Vec<u8> {
    let length = bytes.len().to_string();
    let mut block = format!("#{}{length}", length.len()).into_bytes();
    block.extend(bytes);
    block
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_block_tells_its_length_and_a_row_stands_as_the_columns_say() {
        assert_eq!(block(b"abc"), b"#13abc");
        assert_eq!(&block(&[0; 1234])[..6], b"#41234");
        let sample = Telemetry {
            drive_v: [1.0, 2.0, 3.0, 4.0],
            current_a: [5.0, 6.0, 7.0, 8.0],
            temperature_k: [Some(9.0), None, Some(11.0), Some(12.0)],
            limits: 3,
            sensor_z_um: Some(120.0),
            ..Telemetry::default()
        };
        let row = row(0.5, &sample);
        let at = |name| {
            row[COLUMNS
                .iter()
                .position(|(column, _)| *column == name)
                .expect(name)]
        };
        assert_eq!((at("t_s"), at("V1_V"), at("V4_V")), (0.5, 1.0, 4.0));
        assert_eq!((at("I2_A"), at("dT3_K"), at("limits")), (6.0, 11.0, 3.0));
        assert!(at("dT2_K").is_nan());
        assert!((at("z_m") - 120e-6).abs() < 1e-10);
    }
}

//! What the live view knows, as a frame of a terminal of any size: what matters most is at the top, and what does not fit
//! is left out.

use mirror_protocol::{Pose, Room};
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Modifier, Style};
use ratatui::text::Line;
use ratatui::widgets::Paragraph;

use super::chart;
use super::keys;
use super::state::State;
use crate::commands::{Uncertainty, explain};
use crate::names::{limit_names, state_name};
use crate::report::{decimal, row, row_of_known};

/// What was missed and lost stands in one line, count by count, from so many columns on.
const COUNTS: u16 = 80;
/// Four numbers with their unit stand beside their name from so many columns on.
const WIDE: u16 = 60;
/// Four numbers without it.
const MEDIUM: u16 = 38;
/// Fewer rows or columns show no curve.
const LEAST_CHART: (u16, u16) = (24, 5);

const TITLE: Style = Style::new().add_modifier(Modifier::BOLD);
const ALARM: Style = Style::new().fg(Color::Red).add_modifier(Modifier::BOLD);

/// Draws the frame.
pub(super) fn draw(state: &State, frame: &mut Frame) {
    let area = frame.area();
    let foot = foot(state, area);
    let foot_rows = foot.len() as u16;
    let body_rows = area.height.saturating_sub(foot_rows);
    let mut body = body(state, area.width);
    body.truncate(body_rows.into());
    let [top, middle, bottom] = Layout::vertical([
        Constraint::Length(body.len() as u16),
        Constraint::Min(0),
        Constraint::Length(foot_rows),
    ])
    .areas(area);
    frame.render_widget(Paragraph::new(body), top);
    frame.render_widget(Paragraph::new(foot), bottom);
    draw_charts(state, frame, middle);
}

fn draw_charts(state: &State, frame: &mut Frame, area: Rect) {
    let (columns, rows) = LEAST_CHART;
    if area.height < rows || area.width < columns {
        return;
    }
    if area.width < 2 * columns {
        return chart::draw_position(state, frame, area);
    }
    let [left, right] = Layout::horizontal([Constraint::Fill(1); 2]).areas(area);
    chart::draw_position(state, frame, left);
    chart::draw_rises(state, frame, right);
}

/// What happened, the keys, and what was lost: the first of them on the smallest terminals.
fn foot(state: &State, area: Rect) -> Vec<Line<'static>> {
    let notice = match state.entry.as_str() {
        "" => state.notice.clone(),
        entry => format!("go to {entry}_"),
    };
    if area.height < 3 {
        return Vec::new();
    }
    let mut foot = vec![Line::from(notice)];
    if area.height >= 8 {
        foot.push(Line::styled(
            keys_that_fit(area.width),
            Style::new().add_modifier(Modifier::DIM),
        ));
    }
    if area.height >= 12 {
        foot.splice(..0, counts(state, area.width));
    }
    foot
}

/// The keys and what they do, whole ones only.
fn keys_that_fit(columns: u16) -> String {
    let mut fitting: Vec<&str> = Vec::new();
    for key in keys::HELP.split("  ") {
        fitting.push(key);
        if fitting.join("  ").len() > columns.into() {
            fitting.pop();
        }
    }
    fitting.join("  ")
}

/// What was missed and lost; in sums where there is no room for more, as a count that is cut off is another one.
fn counts(state: &State, columns: u16) -> Vec<Line<'static>> {
    let (health, on_the_way) = (&state.status.health, state.lost);
    let (missed, late) = (health.missed_ticks, health.late_ticks);
    let by_board = state.status.dropped_samples;
    if columns >= COUNTS {
        return vec![Line::from(format!(
            "ticks      {missed} missed, {late} late; samples lost: {on_the_way} on the way, {by_board} by the board"
        ))];
    }
    let ticks = u64::from(missed) + u64::from(late);
    let samples = on_the_way + u64::from(by_board);
    if columns >= MEDIUM {
        let told = format!("{ticks} ticks, {samples} samples");
        return vec![named("lost", &told, columns)];
    }
    vec![
        named("ticks", &format!("{ticks} late"), columns),
        named("samples", &format!("{samples} lost"), columns),
    ]
}

/// The numbers, the most important first.
fn body(state: &State, columns: u16) -> Vec<Line<'static>> {
    let mut lines = title(state, columns);
    lines.extend(position(state, columns));
    lines.push(channels(state, columns));
    lines.push(named("limited", &limits(state), columns));
    lines.extend(actuators(state, columns).map(Line::from));
    lines.extend(
        state
            .latest
            .room
            .map(|room| named("room", &surroundings(room), columns)),
    );
    lines
}

/// A name and what is told of it.
fn named(name: &str, told: &str, columns: u16) -> Line<'static> {
    let name_columns = if columns >= MEDIUM { 10 } else { 8 };
    Line::from(format!("{name:<name_columns$} {told}"))
}

fn title(state: &State, columns: u16) -> Vec<Line<'static>> {
    let up_s = f64::from(state.latest.tick) / f64::from(state.tick_hz);
    let board = format!("{}  up {up_s:.1} s", state.board);
    let driven = state.driver();
    let recorded = state.recorded.as_ref().map(|recorded| {
        format!(
            "REC {} samples to {}",
            recorded.samples,
            recorded.file.display()
        )
    });
    if columns >= WIDE {
        let driven = driven.map_or("not driven".to_owned(), |driver| format!("driven {driver}"));
        let parts: Vec<String> = [board, driven].into_iter().chain(recorded).collect();
        return vec![Line::styled(parts.join("  "), TITLE)];
    }
    let title = recorded.unwrap_or(board);
    let driven = driven.unwrap_or_else(|| "-".to_owned());
    vec![
        Line::styled(title, TITLE),
        named("driven", &driven, columns),
    ]
}

fn position(state: &State, columns: u16) -> Vec<Line<'static>> {
    let um = |um: Option<f64>| um.map_or_else(|| "-".to_owned(), |um| format!("{um:.3} um"));
    let Pose { z_um, tilt_rad } = state.latest.pose;
    let asked = um(state.asked_um);
    let told = Uncertainty::from(&state.latest);
    let z_um = decimal(z_um);
    let pose = match told.z_um {
        // Cut off, a number is another one.
        Some(interval) if columns < MEDIUM => format!("{z_um:.1} ±{interval:.1}"),
        Some(interval) => format!("{z_um:.3} ± {interval:.3} um"),
        None => format!("{z_um:.3} um"),
    };
    let sensor = um(state.latest.sensor_z_um.map(decimal));
    let mut lines = if columns >= WIDE {
        let settling = told
            .settling()
            .map_or(String::new(), |it| format!(", {it}"));
        let told = format!("asked {asked}, pose {pose}, sensor {sensor}{settling}");
        vec![named("position", &told, columns)]
    } else {
        [("asked", asked), ("pose", pose), ("sensor", sensor)]
            .map(|(name, told)| named(name, &told, columns))
            .into()
    };
    if let Some([x, y]) = tilt_rad.map(|tilts| tilts.map(|rad| decimal(rad).to_degrees())) {
        lines.push(named("tilts", &format!("{x:.3} deg, {y:.3} deg"), columns));
    }
    lines
}

fn channels(state: &State, columns: u16) -> Line<'static> {
    if let Some((channel, fault)) = state.tripped() {
        let told = match explain::sentence(fault) {
            Some(sentence) => format!("{channel} tripped: {fault} ({sentence})"),
            None => format!("{channel} tripped: {fault}"),
        };
        return named("channels", &told, columns).style(ALARM);
    }
    let states = state.latest.states.map(state_name);
    let told = match states.iter().all(|one| *one == states[0]) {
        true => format!("all {}", states[0]),
        false => states.join(", "),
    };
    named("channels", &told, columns)
}

fn limits(state: &State) -> String {
    let names = limit_names(state.latest.limits);
    match names[..] {
        [] => "by nothing".to_owned(),
        [only] => {
            let sentence = explain::sentence(only).unwrap_or_default();
            format!("{only} ({sentence})")
        }
        _ => names.join(", "),
    }
}

/// How much warmer the surroundings are than at calibration, with its standard deviation.
fn surroundings(room: Room) -> String {
    let kelvin = |hundredths: f64| hundredths / 100.0;
    let (rise_k, deviation_k) = (
        kelvin(room.rise_ck.into()),
        kelvin(room.deviation_ck.into()),
    );
    format!("{rise_k:+.2} ± {deviation_k:.2} K")
}

/// Drives, currents and temperature rises: of each actuator, or where there is no room, of the highest.
fn actuators(state: &State, columns: u16) -> [String; 3] {
    let drive_v = state.latest.drive_v.map(decimal);
    let current_ma = state.latest.current_a.map(|ampere| 1e3 * decimal(ampere));
    let rise_k = state.latest.temperature_k.map(|kelvin| kelvin.map(decimal));
    if columns >= WIDE {
        return [
            format!("drives     {}", row(drive_v, 3, "V")),
            format!("currents   {}", row(current_ma, 3, "mA")),
            format!("temp. rise {}", row_of_known(rise_k, 1, "K")),
        ];
    }
    let line = |name: &str, unit: &str, decimals: usize, values: [Option<f64>; 4]| {
        if columns >= MEDIUM {
            let cell = |value: Option<f64>| match value {
                Some(value) => format!("{value:>6.decimals$}"),
                None => format!("{:>6}", "-"),
            };
            let label = format!("{name} {unit}");
            return format!("{label:<14}{}", values.map(cell).concat());
        }
        let highest = values.into_iter().flatten().max_by(f64::total_cmp);
        match highest {
            Some(highest) => format!("{name:<10} {highest:.decimals$} {unit}"),
            None => format!("{name:<10} -"),
        }
    };
    [
        line("drives", "V", 2, drive_v.map(Some)),
        line("currents", "mA", 2, current_ma.map(Some)),
        line("temp. rise", "K", 1, rise_k),
    ]
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::path::Path;

    use control_core::{Limit, Limits};
    use mirror_protocol::{ChannelState, Health, Status, Telemetry};
    use proptest::prelude::*;
    use protection::Fault;
    use ratatui::Terminal;
    use ratatui::backend::TestBackend;

    use super::*;
    use crate::commands::monitor::state::Recorded;

    const PERIOD_TICKS: u16 = 100;

    /// A sample `t_s` after a move from 20 to 60 um began, which a first-order lag of half a second follows.
    fn sample(t_s: f64) -> Telemetry {
        let moved = 1.0 - (-t_s.max(0.0) / 0.5).exp();
        let sensor_um = 20.0 + 40.0 * moved;
        Telemetry {
            tick: (1e4 * (t_s + 20.0)) as u32,
            drive_v: [1.9, 0.2, 0.0, 1.876],
            current_a: [4.43e-3, 0.554e-3, 0.0, 4.4e-3],
            temperature_k: [
                Some(48.8 * moved as f32),
                Some(0.7),
                None,
                Some(40.0 * moved as f32),
            ],
            states: [ChannelState::Driving; 4],
            sensor_z_um: Some(sensor_um as f32),
            pose: Pose {
                z_um: if t_s < 0.0 { 20.0 } else { 60.0 },
                tilt_rad: None,
            },
            uncertainty: Some(mirror_protocol::Uncertainty {
                z_nm: 412,
                tilt_urad: 0,
            }),
            settles_in_ms: Some(0),
            ..Telemetry::default()
        }
    }

    fn status(telemetry: Telemetry) -> Status {
        Status {
            health: Health {
                lease_left_ms: Some(100),
                ..Health::default()
            },
            max_position_um: 173.7,
            ..crate::board::tests::status(telemetry)
        }
    }

    /// What is known eight seconds into the move, of which the view missed a tenth of a second.
    fn moving() -> State {
        let mut state = State::new("emulated", 10_000, PERIOD_TICKS, status(sample(-4.0)));
        let steps = (-400..800).filter(|step| !(300..310).contains(step));
        for step in steps {
            state.take(&sample(f64::from(step) * 0.01));
        }
        state.drives(60.0);
        state.recorded = Some(Recorded {
            file: "monitor.csv".into(),
            samples: 1234,
        });
        state
    }

    /// The frame as text, its colours and the blanks at its right left out.
    fn frame(state: &State, columns: u16, rows: u16) -> String {
        let mut terminal = Terminal::new(TestBackend::new(columns, rows)).expect("it is memory");
        terminal
            .draw(|frame| draw(state, frame))
            .expect("it is memory");
        let buffer = terminal.backend().buffer();
        let row = |y: u16| -> String {
            let line: String = (0..columns).map(|x| buffer[(x, y)].symbol()).collect();
            line.trim_end().to_owned() + "\n"
        };
        (0..rows).map(row).collect()
    }

    /// `MIRROR_WRITE_PAGES=1` writes the file anew.
    fn assert_is_golden(name: &str, frame: &str) {
        let path = Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("tests/golden")
            .join(name);
        if std::env::var_os("MIRROR_WRITE_PAGES").is_some() {
            fs::write(&path, frame).expect("it can be written");
        }
        let golden = fs::read_to_string(&path).unwrap_or_default();
        assert_eq!(frame, golden, "{name}:\n{frame}");
    }

    #[test]
    fn frames_are_as_in_the_golden_files() {
        let mut state = moving();
        for (columns, rows) in [(80, 24), (40, 12), (20, 10), (20, 24)] {
            let name = format!("monitor-{columns}x{rows}.txt");
            assert_is_golden(&name, &frame(&state, columns, rows));
        }
        let mut tripped = state.latest;
        tripped.states = [ChannelState::Off; 4];
        tripped.states[1] = ChannelState::Tripped(Fault::OpenHeater.code());
        tripped.drive_v = [0.0; 4];
        tripped.tick += u32::from(PERIOD_TICKS);
        state.take(&tripped);
        state.lets_go("channel 2 has turned the board off");
        state.status.health.lease_left_ms = None;
        state.recorded = None;
        assert_is_golden("monitor-tripped.txt", &frame(&state, 80, 24));
    }

    #[test]
    fn no_count_and_no_key_is_cut_off_in_a_narrow_terminal() {
        let mut state = moving();
        state.status.health.missed_ticks = 12_345;
        state.lost = 67_890;
        for columns in 20..100 {
            let shown = frame(&state, columns, 24);
            assert!(shown.contains("12345") && shown.contains("6789"), "{shown}");
            let keys = shown.lines().last().expect("the keys");
            assert!(
                keys.split("  ")
                    .all(|key| keys::HELP.split("  ").any(|whole| whole == key)),
                "{keys}"
            );
        }
    }

    #[test]
    fn a_limit_is_told_with_what_it_means() {
        let mut state = moving();
        let mut limits = Limits::NONE;
        limits.insert(Limit::Cooling);
        state.latest.limits = limits.bits();
        let shown = frame(&state, 120, 24);
        assert!(
            shown.contains("cooling (The mirror should have cooled faster than it can)"),
            "{shown}"
        );
    }

    #[test]
    fn a_room_that_is_known_is_told_with_its_deviation() {
        let mut state = moving();
        state.latest.room = Some(Room {
            rise_ck: -899,
            deviation_ck: 4,
        });
        for (columns, told) in [
            (80, "room       -8.99 ± 0.04 K"),
            (24, "room     -8.99 ± 0.04 K"),
        ] {
            let shown = frame(&state, columns, 24);
            assert!(shown.contains(told), "{shown}");
        }
    }

    #[test]
    fn the_guide_shows_the_golden_frame() {
        let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/guide/monitor.md");
        let page = fs::read_to_string(page).expect("the page");
        let golden = include_str!("../../../tests/golden/monitor-80x24.txt");
        let indented: Vec<String> = golden
            .lines()
            .map(|line| format!("    {line}").trim_end().to_owned())
            .collect();
        assert!(
            page.contains(&indented.join("\n")),
            "docs/guide/monitor.md shows another frame"
        );
    }

    proptest! {
        #[test]
        fn any_terminal_and_any_sample_make_a_frame(
            columns in 1_u16..200, rows in 1_u16..60, drive in any::<f32>(), current in any::<f32>(),
            rise in any::<Option<f32>>(), z in any::<f32>(), sensor in any::<Option<f32>>(), limits in any::<u16>(),
            fault in any::<u8>(), tick in any::<u32>(), notice in ".{0,300}",
        ) {
            let mut state = moving();
            let told = mirror_protocol::Uncertainty { z_nm: limits, tilt_urad: limits };
            state.take(&Telemetry {
                trigger: mirror_protocol::Trigger::from_bits(fault),
                room: None,
                uncertainty: Some(told),
                settles_in_ms: Some(told.z_nm),
                tick,
                drive_v: [drive; 4],
                current_a: [current; 4],
                temperature_k: [rise; 4],
                limits,
                states: [ChannelState::Tripped(fault); 4],
                sensor_z_um: sensor,
                pose: Pose { z_um: z, tilt_rad: Some([z, drive]) },
            });
            state.notice = notice;
            frame(&state, columns, rows);
        }
    }
}

//! What the live view knows, as a frame of a terminal of any size: what matters most is at the top, and what does not fit
//! is left out.

use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Modifier, Style};
use ratatui::text::Line;
use ratatui::widgets::Paragraph;

use super::chart;
use super::keys;
use super::lines::{body, counts};
use super::state::State;

/// Fewer rows or columns show no curve.
const LEAST_CHART: (u16, u16) = (24, 5);

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

#[cfg(test)]
mod tests {
    use std::fs;
    use std::path::Path;

    use control_core::{Limit, Limits};
    use mirror_protocol::{ChannelState, Health, Pose, Room, Status, Telemetry};
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
        state.drives(calibration::PlatePose {
            z_um: 60.0,
            ..calibration::PlatePose::default()
        });
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
    fn a_board_that_is_gone_is_told_whole_in_any_terminal() {
        let mut state = moving();
        state.loses();
        for columns in 20..100 {
            let shown = frame(&state, columns, 40);
            let words: Vec<&str> = shown.split_whitespace().collect();
            let told = "gone: it was unplugged, reset, or its emulator ended. Plug it in, or start it again: the view goes on by itself";
            assert!(words.join(" ").contains(told), "{shown}");
            assert!(!shown.contains("driven from here"), "{shown}");
        }
    }

    #[test]
    fn a_fault_is_told_whole_in_any_terminal() {
        let mut state = moving();
        state.latest.states[1] = ChannelState::Tripped(Fault::OpenHeater.code());
        for columns in 20..100 {
            let shown = frame(&state, columns, 40);
            let words: Vec<&str> = shown.split_whitespace().collect();
            let told =
                "2 tripped: open-heater (A heater is driven and no current flows through it)";
            assert!(words.join(" ").contains(told), "{shown}");
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

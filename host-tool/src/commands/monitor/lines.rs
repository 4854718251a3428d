//! The live view's lines: what is known of the board in words and numbers, as wide as the terminal lets them be.

use std::iter;

use mirror_protocol::{Pose, Room};
use ratatui::style::{Color, Modifier, Style};
use ratatui::text::Line;
use textwrap::{Options, WordSplitter};

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
const TITLE: Style = Style::new().add_modifier(Modifier::BOLD);
const ALARM: Style = Style::new().fg(Color::Red).add_modifier(Modifier::BOLD);

/// The numbers, the most important first.
pub(super) fn body(state: &State, columns: u16) -> Vec<Line<'static>> {
    let mut lines = title(state, columns);
    if let Some(gone) = &state.gone {
        let told = wrapped("board", gone, columns).into_iter();
        lines.extend(told.map(|line| line.style(ALARM)));
    }
    lines.extend(position(state, columns));
    lines.extend(channels(state, columns));
    lines.extend(wrapped("limited", &limits(state), columns));
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
    let name_columns = name_columns(columns);
    Line::from(format!("{name:<name_columns$} {told}"))
}

/// A name and the words that are told of it, all of them, in as many lines as they take.
fn wrapped(name: &str, told: &str, columns: u16) -> Vec<Line<'static>> {
    let room = usize::from(columns).saturating_sub(name_columns(columns) + 1);
    // Names of faults have hyphens, and are not parted there.
    let whole = Options::new(room.max(1)).word_splitter(WordSplitter::NoHyphenation);
    let lines = textwrap::wrap(told, whole).into_iter();
    let names = iter::once(name).chain(iter::repeat(""));
    let named = names
        .zip(lines)
        .map(|(name, line)| named(name, &line, columns));
    named.collect()
}

fn name_columns(columns: u16) -> usize {
    if columns >= MEDIUM { 10 } else { 8 }
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
        if state.gone.is_some() {
            return vec![Line::styled(
                format!("{board}, then gone; shown as it was"),
                TITLE,
            )];
        }
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
    let asked = um(state.asked.map(|pose| pose.z_um));
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

fn channels(state: &State, columns: u16) -> Vec<Line<'static>> {
    if let Some((channel, fault)) = state.tripped() {
        let told = match explain::sentence(fault) {
            Some(sentence) => format!("{channel} tripped: {fault} ({sentence})"),
            None => format!("{channel} tripped: {fault}"),
        };
        let lines = wrapped("channels", &told, columns).into_iter();
        return lines.map(|line| line.style(ALARM)).collect();
    }
    let states = state.latest.states.map(state_name);
    let told = match states.iter().all(|one| *one == states[0]) {
        true => format!("all {}", states[0]),
        false => states.join(", "),
    };
    wrapped("channels", &told, columns)
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

/// What was missed and lost; in sums where there is no room for more, as a count that is cut off is another one.
pub(super) fn counts(state: &State, columns: u16) -> Vec<Line<'static>> {
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

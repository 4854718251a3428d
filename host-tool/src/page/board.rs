//! The board in the page: which calibration it has, and what it reached before and after.

use std::fmt::Write;

use charts::escaped;
use control_core::Calibration;
use control_core::calibration::{Lag, Parts};

use super::print::in_print;
use super::run::Run;
use crate::report::decimal;
use crate::tried::{Tried, before_and_after, figures};

impl Run {
    /// The section of the board, where the page has a trial.
    pub(super) fn board_section(&self, page: &mut String) {
        let (Some(tried), Some(calibration)) = (&self.inside.tried, &self.calibration) else {
            return;
        };
        page.push_str("<section id=\"board\" aria-labelledby=\"board-h\"><h2 id=\"board-h\">The board, before and after its calibration</h2>");
        self.provenance(tried, calibration, page);
        errors(tried, page);
        page.push_str("<p>Before on the left, after on the right, each on its own scale.</p>");
        for row in before_and_after(&tried.before, &tried.after) {
            page.push_str("<figure class=\"pair\">");
            for panel in &row {
                let _ = write!(page, "<div class=\"chart-box\">{}</div>", panel.to_svg());
            }
            page.push_str("</figure>");
        }
        numbers(calibration.parts(), page);
        page.push_str("</section>\n");
    }

    fn provenance(&self, tried: &Tried, calibration: &Calibration, page: &mut String) {
        let origin = calibration.parts().origin;
        let device = origin.device.as_str();
        let _ = write!(
            page,
            "<p>Board: {}. Calibrated for <strong>{}</strong>, {}, from the identified model {:016x}; before that: {}.</p>",
            escaped(&tried.board),
            escaped(device),
            escaped(origin.date.as_str()),
            origin.model_hash,
            escaped(&tried.calibrated_before)
        );
        if let Some(other) = another(self.said_of_session("device"), device) {
            let _ = write!(
                page,
                "<p><strong>The session above is of {}:</strong> it may be another mirror than the one that was calibrated.</p>",
                escaped(&other)
            );
        }
        for left in &tried.not_inverted {
            let _ = write!(page, "<p>Not inverted by the board: {}.</p>", escaped(left));
        }
    }
}

/// The mirror of the session, where it is called otherwise than the one that was calibrated.
fn another(of_session: Option<String>, calibrated: &str) -> Option<String> {
    of_session.filter(|device| device.trim() != calibrated)
}

/// What the trials come to, side by side.
fn errors(tried: &Tried, page: &mut String) {
    page.push_str("<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"Positions before and after\"><table id=\"trial\"><caption>What was asked of the board and what it reached, at positions that the calibration was not made from</caption><thead><tr><th scope=\"col\">figure</th><th scope=\"col\">before</th><th scope=\"col\">after</th><th scope=\"col\">unit</th></tr></thead><tbody>");
    for figure in figures(&tried.before.figures(), &tried.after.figures()) {
        let _ = write!(
            page,
            "<tr><th scope=\"row\">{}</th><td>{:.3}</td><td>{:.3}</td><td>{}</td></tr>",
            in_print(&figure.what),
            figure.before,
            figure.after,
            in_print(figure.unit)
        );
    }
    page.push_str("</tbody></table></div>");
}

/// The calibration's numbers, stage by stage.
fn numbers(parts: &Parts, page: &mut String) {
    page.push_str("<h3>The calibration</h3><div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"The calibration\"><table><caption>What the board inverts, by stage; four values are the four actuators&#39;</caption><thead><tr><th scope=\"col\">stage</th><th scope=\"col\">value</th><th scope=\"col\">unit</th><th scope=\"col\" class=\"words\">what</th></tr></thead><tbody>");
    let mut row = |stage: &str, value: String, unit: &str, what: &str| {
        let _ = write!(
            page,
            "<tr><th scope=\"row\">{stage}</th><td>{}</td><td>{}</td><td class=\"words\">{what}</td></tr>",
            escaped(&value),
            in_print(unit)
        );
    };
    let each = |number: fn(&control_core::ActuatorCalibration) -> f32, digits: usize| {
        let values = parts.actuators.each_ref().map(number);
        values.map(|value| format!("{value:.digits$}")).join(" ")
    };
    row(
        "resistance",
        each(|actuator| actuator.cold_resistance.0, 1),
        "ohm",
        "at ambient",
    );
    row(
        "resistance",
        each(|actuator| 1e3 * actuator.tcr.0, 3),
        "10⁻³/K",
        "its temperature coefficient",
    );
    row(
        "heat",
        each(|actuator| actuator.thermal_resistance.0, 0),
        "K/W",
        "temperature rise for a small power",
    );
    row("heat", lags(&parts.heat.fast), "", "fast thermal poles");
    row("heat", lags(&parts.heat.slow), "", "slow thermal poles");
    row(
        "shape",
        each(|actuator| actuator.shape.top().0, 1),
        "um",
        "reached by the tables",
    );
    let plays = parts.memory.plays.iter().filter(|play| play.weight != 0.0);
    let plays = plays.map(|play| part(play.weight, &format!("{:.3} µm", play.radius.0)));
    row(
        "memory",
        listed(plays.collect()),
        "",
        "play operators of the hysteresis, by their radius",
    );
    row("memory", lags(&parts.memory.creep), "", "lags of the creep");
    let bounds = &parts.bounds;
    let highest = format!(
        "{} V, {:.1} mW, {:.0} K",
        decimal(bounds.drive.0),
        1e3 * bounds.power.0,
        bounds.rise.0
    );
    row(
        "drive",
        highest,
        "",
        "highest drive, power and temperature rise",
    );
    let move_time = format!("{:.1} ms", 1e3 * parts.path.move_time.0);
    row("path", move_time, "", "of a move where no limit acts");
    let resonance = &parts.path.resonance;
    if resonance.is_known() {
        let told = format!(
            "{:.1} Hz, Q {:.1}",
            resonance.frequency.0, resonance.quality
        );
        row(
            "path",
            told,
            "",
            "resonance that it leads the plate through",
        );
    }
    page.push_str("</tbody></table></div>");
}

/// Those lags that are used, each with its part of the whole.
fn lags(lags: &[Lag]) -> String {
    let used = lags.iter().filter(|lag| lag.weight != 0.0);
    let told = used.map(|lag| match lag.time.0 {
        seconds if seconds < 1.0 => part(lag.weight, &format!("{:.2} ms", 1e3 * seconds)),
        seconds => part(lag.weight, &format!("{seconds:.2} s")),
    });
    listed(told.collect())
}

fn part(weight: f32, of: &str) -> String {
    format!("{of} ({:.2} %)", 100.0 * weight)
}

fn listed(parts: Vec<String>) -> String {
    match parts.is_empty() {
        true => "none".into(),
        false => parts.join(", "),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use control_core::Second;

    #[test]
    fn a_session_of_another_mirror_is_told() {
        let of = |device: Option<&str>| another(device.map(str::to_owned), "mirror 7");
        assert_eq!(of(Some("mirror 8")).as_deref(), Some("mirror 8"));
        assert_eq!([of(Some("mirror 7 ")), of(None)], [None, None]);
    }

    #[test]
    fn lags_that_are_used_are_told_in_readable_units() {
        let lag = |weight, time| Lag {
            weight,
            time: Second(time),
        };
        let some = [lag(0.6, 0.001), lag(0.0, 9.0), lag(0.4, 4.7)];
        assert_eq!(lags(&some), "1.00 ms (60.00 %), 4.70 s (40.00 %)");
        assert_eq!(lags(&[]), "none");
    }
}

//! The switches and sliders of the effects, which the script brings to life.

use std::fmt::Write;

use charts::escaped;
use lab_view::{Entry, catalogue};
use mirror_model::effect::Parameter;

use super::print::in_print;
use super::run::Run;

/// A slider whose range spans more than this factor moves by factors.
const BY_FACTORS: f64 = 30.0;

/// A form with the fitted models to start from, and every effect with its switch and its sliders.
pub(super) fn controls(run: &Run, best: usize, page: &mut String) {
    page.push_str("<form class=\"controls\" aria-label=\"The model\"><fieldset id=\"models\" disabled><legend>Start from the model</legend>");
    for (index, fit) in run.fits.iter().enumerate() {
        let checked = if index == best { " checked" } else { "" };
        let _ = write!(
            page,
            "<label><input type=\"radio\" name=\"model\" value=\"{index}\"{checked}> {} <small>({:.3} {})</small></label>",
            escaped(&fit.name),
            fit.compared.rms,
            run.unit()
        );
    }
    page.push_str("</fieldset><p class=\"hint\">Switch an effect, or move its slider: curves and errors are computed anew, here. Nothing else is fitted again.</p>");
    let entries = catalogue(&run.own);
    for of_stage in entries.chunk_by(|a, b| a.info.stage == b.info.stage) {
        let _ = write!(
            page,
            "<fieldset class=\"stage\" disabled><legend>{}</legend>",
            of_stage[0].info.stage
        );
        for entry in of_stage {
            effect(run, entry, page);
        }
        page.push_str("</fieldset>");
    }
    page.push_str("</form>");
}

fn effect(run: &Run, entry: &Entry, page: &mut String) {
    let info = &entry.info;
    let form = match entry.form.as_str() {
        "" => String::new(),
        form => format!(" ({form})"),
    };
    let (id, title) = (escaped(&info.id), escaped(&info.title));
    let _ = write!(
        page,
        "<div class=\"effect\" data-effect=\"{id}\" data-form=\"{}\"><label class=\"switch\"><input type=\"checkbox\" role=\"switch\"><span>{id}{}</span></label><p class=\"what\">{title}: <code>{}</code></p>",
        escaped(&entry.form),
        escaped(&form),
        escaped(&info.equation)
    );
    let ranked = run
        .found
        .ranking
        .iter()
        .find(|ranked| ranked.effect == info.id);
    for parameter in info.parameters.iter() {
        // What fits best belongs to one form; the others start as usual.
        let fits = ranked
            .filter(|ranked| ranked.parameters.len() == info.parameters.len())
            .and_then(|ranked| ranked.parameters.get(&*parameter.symbol))
            .map(|estimate| estimate.value)
            .filter(|value| (parameter.low..=parameter.high).contains(value) && *value != 0.0);
        slider(parameter, fits.unwrap_or(parameter.start), &info.id, page);
    }
    page.push_str("</div>");
}

fn slider(parameter: &Parameter, value: f64, effect: &str, page: &mut String) {
    let Parameter { low, high, .. } = *parameter;
    let by_factors = low > 0.0 && high / low > BY_FACTORS;
    let unit = match &*parameter.unit {
        "1" => String::new(),
        unit => in_print(unit),
    };
    let symbol = escaped(&parameter.symbol);
    let _ = write!(
        page,
        "<label class=\"slider\"><span>{symbol}</span><input type=\"range\" min=\"0\" max=\"1000\" data-low=\"{low:?}\" data-high=\"{high:?}\" data-value=\"{value:?}\" data-unit=\"{unit}\"{} aria-label=\"{symbol} of {}\"><output></output></label>",
        if by_factors { " data-factors" } else { "" },
        escaped(effect)
    );
}

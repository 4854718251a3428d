//! The page, from top to bottom.

use std::fmt::Write;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use charts::{Strip, Strips, escaped};
use diagnosis::{ExpectedGains, MEMBERS, Ranked};
use lab_view::View;
use mirror_model::parameter::TABLE;
use mirror_model::{Model, Symbol};

use super::controls::controls;
use super::inside::packed;
use super::print::{in_print, number, prose, sentence};
use super::run::{Fit, Run};
use crate::commands::Diagnosed;

/// The lab's own code for the page; `cargo xtask build-page` builds it.
const LAB_VIEW: &[u8] = include_bytes!("lab-view.wasm");
const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = include_str!("page.js");
const BOARD_LINK: &str = " <a href=\"#board\">Board</a>";
/// Digits of a parameter that are shown: more than any is known to.
const DIGITS: usize = 5;
/// And of a standard error.
const DIGITS_OF_ERRORS: usize = 2;

impl Run {
    /// The page: one file, without a network.
    pub(crate) fn to_html(&self) -> String {
        let wasm = STANDARD.encode(packed(LAB_VIEW));
        let best = self.fits.len().min(2) - 1;
        let shown = View::new(&self.fits[best].model, &self.data).ok();
        let verdict = self.verdict();
        let mut page = format!(
            r##"<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width,initial-scale=1"><meta name="color-scheme" content="light dark">
<meta name="generator" content="host-tool {version}"><title>{verdict}</title>
<link rel="icon" href="data:,"><style>{chart_style}{STYLE}</style></head>
<body><a class="skip" href="#curves">To the curves</a>
<header><p class="kind">Measurement session of an electrothermal mirror{device}</p><h1>{verdict}</h1>
<nav aria-label="Sections"><a href="#verdict">Verdict</a> <a href="#curves">Curves</a> <a href="#evidence">Evidence</a> <a href="#parameters">Parameters</a>{board_link} <a href="#data">Data</a></nav></header><main>
"##,
            version = env!("CARGO_PKG_VERSION"),
            verdict = escaped(&verdict),
            chart_style = charts::STYLE,
            device = self.device(),
            board_link = self.inside.tried.as_ref().map_or("", |_| BOARD_LINK),
        );
        self.verdict_section(&mut page);
        self.curves_section(&mut page, best, shown.as_ref());
        self.evidence_section(&mut page);
        self.parameters_section(&mut page);
        self.board_section(&mut page);
        self.data_section(&mut page);
        let _ = write!(
            page,
            "</main>\n{}\n<script type=\"application/gzip\" id=\"lab-view\">{wasm}</script>\n<script type=\"module\">{SCRIPT}</script></body></html>\n",
            self.inside.to_element()
        );
        page
    }

    /// The device and the date, as the files state them.
    fn device(&self) -> String {
        let said = ["device", "date"].map(|key| self.said_of_session(key));
        let said = said.into_iter().flatten();
        said.map(|what| format!(", {}", escaped(&what))).collect()
    }

    /// What the first of the files that states it does.
    pub(super) fn said_of_session(&self, key: &str) -> Option<String> {
        let line = format!("# {key}=");
        let mut texts = self.inside.opening.files.iter().map(|file| &file.text);
        texts.find_map(|text| Some(text.lines().find_map(|l| l.strip_prefix(&line))?.to_owned()))
    }

    fn verdict_section(&self, page: &mut String) {
        let said = Diagnosed::new(&self.found, ExpectedGains::default()).to_string();
        let flaws = self.flaws();
        let errors = said.lines().skip(1).take_while(|line| !line.is_empty());
        let _ = write!(
            page,
            "<section id=\"verdict\" aria-labelledby=\"verdict-h\"><h2 id=\"verdict-h\">Verdict</h2>{flaws}<ul>"
        );
        for line in errors {
            let _ = write!(page, "<li>{}</li>", sentence(line));
        }
        page.push_str("</ul>");
        if let Some((_, next)) = said.split_once("\nMeasure next: ") {
            let (command, why) = next.split_once('\n').unwrap_or((next, ""));
            let _ = write!(
                page,
                "<p><strong>Measure next:</strong> <code>{}</code></p><p>{}</p>",
                escaped(command),
                prose(why)
            );
        }
        page.push_str("</section>\n");
    }

    fn curves_section(&self, page: &mut String, best: usize, shown: Option<&View>) {
        page.push_str("<section id=\"curves\" aria-labelledby=\"curves-h\"><h2 id=\"curves-h\">Measured against the model</h2><div class=\"bench\">");
        controls(self, best, page);
        page.push_str("<div class=\"shown\">");
        let Some(view) = shown else {
            page.push_str(
                "<p>The fitted model has no finite answer to show.</p></div></div></section>",
            );
            return;
        };
        let _ = write!(
            page,
            "<p class=\"error\" role=\"status\" aria-live=\"polite\">Error <output id=\"error\">{}</output> rms{}<span id=\"state\"></span></p>",
            view.error,
            view.current_error
                .as_ref()
                .map_or(String::new(), |error| format!(
                    "; of the currents <output id=\"current-error\">{error}</output>"
                )),
        );
        page.push_str("<h3>By experiment</h3>");
        for (index, experiment) in view.experiments.iter().enumerate() {
            if let [curves, left] = &experiment.charts[..] {
                let _ = write!(
                    page,
                    "<figure class=\"pair\" data-experiment=\"{index}\"><div class=\"chart-box\">{curves}</div><div class=\"chart-box\">{left}</div><figcaption>{}: error <output>{}</output> {} rms</figcaption></figure>",
                    escaped(&experiment.experiment),
                    experiment.rms,
                    self.unit(),
                );
            }
        }
        experiments_table(page, view, self.unit());
        if !view.stages.is_empty() {
            stages(page, view);
        }
        page.push_str("<h3>In words</h3><ul id=\"sentences\">");
        for sentence in &view.sentences {
            let _ = write!(page, "<li>{}</li>", escaped(sentence));
        }
        page.push_str("</ul></div></div></section>\n");
    }

    /// The unit of the session's errors, as it is written in print.
    pub(super) fn unit(&self) -> &'static str {
        if self.data.has_displacement() {
            "µm"
        } else {
            "mA"
        }
    }

    fn evidence_section(&self, page: &mut String) {
        let strips = Strips {
            x: "score (logarithmic)".into(),
            strips: self.found.ranking.iter().map(strip).collect(),
        };
        let unit = self.unit();
        let _ = write!(
            page,
            "<section id=\"evidence\" aria-labelledby=\"evidence-h\"><h2 id=\"evidence-h\">Evidence</h2><p>How much of what the fitted model leaves each effect explains (its score), beside the scores of the same effect on {MEMBERS} virtual mirrors that lack nothing, on the same drives. Of 100 such mirrors 95 stay below the threshold. A score beyond it is evidence only where the model with the effect then leaves no more than such mirrors do.</p><figure><div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"Scores of the effects\">{}</div><figcaption>Scores against their null distributions</figcaption></figure><div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"Ranking of effects\"><table><caption>All effects that change a reading, the best first</caption><thead><tr><th scope=\"col\">effect</th><th scope=\"col\">score</th><th scope=\"col\">threshold</th><th scope=\"col\">weight</th><th scope=\"col\">error with it ({unit})</th><th scope=\"col\">held out ({unit})</th><th scope=\"col\" class=\"words\">why</th></tr></thead><tbody>",
            strips.to_svg()
        );
        for ranked in &self.found.ranking {
            let _ = write!(
                page,
                "<tr><th scope=\"row\">{}</th><td>{:.1}</td><td>{:.1}</td><td>{:.0} %</td><td>{:.3}</td><td>{:.3}</td><td class=\"words\">{}</td></tr>",
                escaped(&ranked.effect),
                ranked.score,
                ranked.threshold,
                100.0 * ranked.weight,
                ranked.error_rms.after,
                ranked.held_out_rms.after,
                escaped(&ranked.why)
            );
        }
        page.push_str("</tbody></table></div>");
        for (what, ids) in [
            (
                "These data would not show, at any plausible size",
                &self.found.invisible,
            ),
            ("The model runs away with", &self.found.infeasible),
        ] {
            if !ids.is_empty() {
                let _ = write!(page, "<p>{what}: {}.</p>", escaped(&ids.join(", ")));
            }
        }
        page.push_str("</section>\n");
    }

    fn parameters_section(&self, page: &mut String) {
        page.push_str("<section id=\"parameters\" aria-labelledby=\"parameters-h\"><h2 id=\"parameters-h\">Parameters</h2><div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"Parameters\"><table><caption>The fitted models, with one standard error where it is known; four values are the four actuators&#39;</caption><thead><tr><th scope=\"col\">parameter</th><th scope=\"col\" class=\"words\">meaning</th><th scope=\"col\">unit</th>");
        for fit in &self.fits {
            let _ = write!(page, "<th scope=\"col\">{}</th>", escaped(&fit.name));
        }
        page.push_str("</tr></thead><tbody>");
        for entry in &TABLE {
            let _ = write!(
                page,
                "<tr><th scope=\"row\">{}</th><td class=\"words\">{}</td><td>{}</td>",
                escaped(entry.name),
                escaped(entry.meaning),
                in_print(entry.unit)
            );
            for fit in &self.fits {
                let _ = write!(page, "<td>{}</td>", parameter(&fit.model, entry.symbol));
            }
            page.push_str("</tr>");
        }
        for fit in &self.fits {
            effects(page, fit, &self.fits);
        }
        page.push_str("</tbody></table></div></section>\n");
    }

    /// Which files are not whole, where any is.
    fn flaws(&self) -> String {
        let told =
            |flaw: &String| format!("<p role=\"note\"><strong>{}</strong></p>", escaped(flaw));
        self.flaws.iter().map(told).collect()
    }

    fn data_section(&self, page: &mut String) {
        let inside = &self.inside;
        page.push_str("<section id=\"data\" aria-labelledby=\"data-h\"><h2 id=\"data-h\">Data, and how to repeat this</h2>");
        page.push_str(&self.flaws());
        if inside.rows_left_out > 0 {
            let _ = write!(
                page,
                "<p><strong>{} rows of dense sampling are left out of this page;</strong> everything in it is computed from the others.</p>",
                inside.rows_left_out
            );
        }
        page.push_str("<ul>");
        for file in &inside.opening.files {
            let rows = file
                .text
                .lines()
                .filter(|line| !line.starts_with('#'))
                .count()
                .saturating_sub(1);
            let _ = write!(
                page,
                "<li><code>{}</code>: {rows} rows</li>",
                escaped(&file.name)
            );
        }
        let _ = writeln!(
            page,
            "</ul><p>The files, the models and all results are inside this page. <code>host-tool replay report.html</code> evaluates them again and says whether anything comes out otherwise.</p><p>Written by <code>host-tool {}</code>. Chance has a part in one thing only, the null ensemble: virtual mirrors with the seeds 0 to {}, on the drives of this session.</p></section>",
            env!("CARGO_PKG_VERSION"),
            MEMBERS - 1
        );
    }
}

fn experiments_table(page: &mut String, view: &View, unit: &str) {
    let _ = write!(
        page,
        "<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"Errors by experiment\"><table id=\"experiments\"><caption>Errors by experiment, measured less modelled</caption><thead><tr><th scope=\"col\">experiment</th><th scope=\"col\">rms ({unit})</th><th scope=\"col\">largest ({unit})</th><th scope=\"col\">% of span</th><th scope=\"col\">currents rms (mA)</th></tr></thead><tbody>"
    );
    for experiment in &view.experiments {
        let known = |value: &Option<String>| value.clone().unwrap_or("–".into());
        let _ = write!(
            page,
            "<tr><th scope=\"row\">{}</th><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>",
            escaped(&experiment.experiment),
            experiment.rms,
            experiment.largest,
            known(&experiment.percent_of_span),
            known(&experiment.current_rms),
        );
    }
    page.push_str("</tbody></table></div>");
}

fn stages(page: &mut String, view: &View) {
    page.push_str("<h3>By stage</h3><p>Each stage is compared at the measured input of that stage, where the drive was steady.</p><div class=\"stages\">");
    for (index, stage) in view.stages.iter().enumerate() {
        let _ = write!(
            page,
            "<figure data-stage=\"{index}\"><div class=\"chart-box\">{}</div><figcaption>{}: {} <output>{}</output></figcaption></figure>",
            stage.chart.as_deref().unwrap_or(""),
            stage.stage,
            stage.what,
            stage.error
        );
    }
    page.push_str("</div>");
}

fn strip(ranked: &Ranked) -> Strip {
    Strip {
        name: ranked.effect.clone(),
        score: ranked.score,
        threshold: ranked.threshold,
        null: ranked.null_scores.clone(),
    }
}

/// A parameter's value, or those of the four actuators, with a standard error.
fn parameter(model: &Model, symbol: Symbol) -> String {
    let values = match model.by_actuator.get(&symbol) {
        Some(each) => each.map(|value| number(value, DIGITS)).join(" "),
        None => number(model.parameters.get(symbol), DIGITS),
    };
    match model.standard_errors.get(&symbol) {
        Some(error) => format!("{values} ± {}", number(*error, DIGITS_OF_ERRORS)),
        None => values,
    }
}

/// The rows of the effects that this fit is the first to have.
fn effects(page: &mut String, fit: &Fit, fits: &[Fit]) {
    for active in &fit.model.effects {
        let of = |fit: &Fit| {
            fit.model
                .effects
                .iter()
                .find(|other| other.id() == active.id())
                .cloned()
        };
        let first = fits.iter().find(|other| of(other).is_some());
        if first.is_none_or(|first| first.name != fit.name) {
            continue;
        }
        let info = active.effect.info();
        for (index, parameter) in info.parameters.iter().enumerate() {
            let _ = write!(
                page,
                "<tr><th scope=\"row\">{}.{}</th><td class=\"words\">{}</td><td>{}</td>",
                escaped(&info.id),
                escaped(&parameter.symbol),
                escaped(&info.equation),
                in_print(&parameter.unit)
            );
            for fit in fits {
                let value = of(fit).map_or("–".into(), |found| {
                    let error = found.standard_errors.get(index).copied().flatten();
                    let error = error.map_or(String::new(), |e| {
                        format!(" ± {}", number(e, DIGITS_OF_ERRORS))
                    });
                    format!("{}{error}", number(found.values[index], DIGITS))
                });
                let _ = write!(page, "<td>{value}</td>");
            }
            page.push_str("</tr>");
        }
    }
}

//! A page of `report` in Chromium, where `MIRROR_BROWSER` names one, opened as the file that it is: it opens without a complaint, its
//! switches work, by mouse and by keyboard, and everybody can read it. With `MIRROR_WRITE_PAGES` the pictures of the book are
//! written anew.

use std::ffi::OsString;
use std::fs;
use std::path::Path;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use headless_browser::{Browser, Key};
use serde_json::{Value, json};

use crate::common::no_boards;
use crate::trial::{trial, written};
use crate::{lab, session};

/// A phone, a tablet, a screen.
const WIDTHS: [u32; 3] = [400, 800, 1280];
const HEIGHT: u32 = 1100;
/// A page can be used after so long, and computes anew in so long (ms): what was asked of it. The least of several tries is held
/// against it, which a busy machine does not lengthen.
const READY_MS: f64 = 1000.0;
const COMPUTED_MS: f64 = 100.0;
const TRIES: usize = 5;
/// Text against its ground, at least (WCAG 2.2, success criterion 1.4.3).
const CONTRAST: f64 = 4.5;
/// A reader who presses Tab gets to any control by then: the page has some 80.
const TABS: usize = 300;

/// The page in a browser.
struct Opened {
    browser: Browser,
}

impl Opened {
    /// What a JavaScript expression is.
    fn value(&mut self, expression: &str) -> Value {
        let value = self.browser.value(expression);
        value.unwrap_or_else(|error| panic!("{expression}: {error:#}"))
    }

    fn ask(&mut self, method: &str, parameters: Value) -> Value {
        let answer = self.browser.ask(method, parameters);
        answer.unwrap_or_else(|error| panic!("{method}: {error:#}"))
    }

    /// Opens it, and returns how long it took until everything could be used (ms).
    fn open(&mut self, page: &Path) -> f64 {
        self.browser.open_file(page).expect("it opens");
        self.browser
            .wait_until("document.body.dataset.ready")
            .expect("it can be used");
        self.value("Number(document.body.dataset.ready)")
            .as_f64()
            .expect("a number")
    }

    fn error(&mut self) -> String {
        let error = self.value("document.getElementById('error').textContent");
        error.as_str().expect("text").to_owned()
    }

    /// Does something that has the page compute anew: the curves and the error are others then. Returns how long it took (ms).
    fn changes(&mut self, what: &str, act: impl FnOnce(&mut Self)) -> f64 {
        let curves = "document.querySelector('.pair').innerHTML";
        let before = (self.value(curves), self.error());
        self.value("delete document.body.dataset.milliseconds");
        act(self);
        self.browser
            .wait_until("document.body.dataset.milliseconds")
            .expect("it computes");
        let after = (self.value(curves), self.error());
        assert_ne!(before.0, after.0, "{what}: the curves");
        assert_ne!(before.1, after.1, "{what}: the error");
        self.value("Number(document.body.dataset.milliseconds)")
            .as_f64()
            .expect("a number")
    }

    fn clicks(&mut self, selector: &str) {
        self.value(&format!("document.querySelector(`{selector}`).click()"));
    }

    fn press(&mut self, key: Key) {
        self.browser.press(key).expect("a browser");
    }

    /// What the page is shown on.
    fn shown_as(&mut self, media: &str, scheme: &str) {
        let features = [json!({"name": "prefers-color-scheme", "value": scheme})];
        self.ask(
            "Emulation.setEmulatedMedia",
            json!({"media": media, "features": features}),
        );
    }

    fn resize(&mut self, width: u32) {
        let size =
            json!({"width": width, "height": HEIGHT, "deviceScaleFactor": 1, "mobile": false});
        self.ask("Emulation.setDeviceMetricsOverride", size);
        let overflows = self.value("document.documentElement.scrollWidth > innerWidth");
        assert_eq!(overflows, false, "wider than a window of {width}");
    }

    /// Writes a picture of the page's top into the book, where that is asked.
    fn picture(&mut self, name: &str) {
        if std::env::var_os("MIRROR_WRITE_PAGES").is_none() {
            return;
        }
        self.value("scrollTo(0, 0)");
        let picture = self.ask("Page.captureScreenshot", json!({}));
        let bytes = STANDARD.decode(picture["data"].as_str().expect("a picture"));
        let path = format!("../docs/pictures/report-{name}.png");
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(path);
        fs::write(path, bytes.expect("base64")).expect("it is written");
    }
}

#[test]
fn a_page_lives_in_a_browser() {
    let Some(program): Option<OsString> = std::env::var_os("MIRROR_BROWSER") else {
        println!("MIRROR_BROWSER names no Chromium: not tried");
        return;
    };
    let place = no_boards();
    let path = place.path().join("report.html");
    let files = session("\"hysteresis\"");
    let trial = written(&trial(3.0, 0.03), place.path());
    let said = lab(&[
        "report",
        &files.to_string_lossy(),
        "--trial",
        &trial.to_string_lossy(),
        "-o",
        &path.to_string_lossy(),
    ]);
    assert_eq!(said.code, 0, "{}", said.err);
    let browser = Browser::start(&program, &place.path().join("profile"));
    let mut page = Opened {
        browser: browser.expect("MIRROR_BROWSER names a Chromium"),
    };
    page.ask("Emulation.setScrollbarsHidden", json!({"hidden": true}));
    page.shown_as("screen", "light");
    page.resize(1280);
    let ready = (0..TRIES).map(|_| page.open(&path));
    let ready_ms = ready.fold(f64::INFINITY, f64::min);
    println!("can be used after {ready_ms:.0} ms");
    assert!(ready_ms < READY_MS, "{ready_ms} ms until it can be used");
    assert_eq!(
        page.value("document.body.dataset.same"),
        "true",
        "the tool's numbers"
    );
    is_named_for_a_screen_reader(&mut page);
    is_read_in_any_light(&mut page);
    is_printed(&mut page);
    switches_change_curves_and_number(&mut page);
    page.open(&path);
    keys_do_what_a_mouse_does(&mut page);
    sliders_tell_their_values_as_in_print(&mut page);
    assert_eq!(
        page.browser.complaints,
        Vec::<String>::new(),
        "errors on the console, or a network that is asked"
    );
}

fn switches_change_curves_and_number(page: &mut Opened) {
    let hysteresis = "[data-effect=hysteresis] [role=switch]";
    let turns = (0..2 * TRIES).map(|_| page.changes("hysteresis", |page| page.clicks(hysteresis)));
    let computed_ms = turns.fold(f64::INFINITY, f64::min);
    println!("computes anew in {computed_ms:.1} ms");
    assert!(
        computed_ms < COMPUTED_MS,
        "{computed_ms} ms to compute anew"
    );
    page.changes("the model without it", |page| page.clicks("[name=model]"));
    // With nothing but what was fitted it is the error that the tool printed beside the model.
    let told = page.value(
        "document.querySelector('[name=model]').parentElement.querySelector('small').textContent",
    );
    let told = told.as_str().expect("text").trim_matches(['(', ')']);
    assert_eq!(page.error(), told);
    page.changes("creep by its slider", |page| {
        page.value(
            "(() => {
               const slider = document.querySelector('[data-effect=creep] input[type=range]');
               slider.value = 900;
               slider.dispatchEvent(new Event('input', { bubbles: true }));
             })()",
        );
    });
    page.changes("creep off", |page| {
        page.clicks("[data-effect=creep] [role=switch]");
    });
    assert_eq!(page.error(), told);
}

/// Tab leads from one control to the next, each shown to be the one, a blank turns a switch and arrows move a slider.
fn keys_do_what_a_mouse_does(page: &mut Opened) {
    let mut unseen = Vec::new();
    let is_there = "document.activeElement.closest('[data-effect=hysteresis]') !== null";
    let mut came = false;
    for _ in 0..TABS {
        page.press(Key::Tab);
        let seen = page.value(
            "(() => {
               const at = document.activeElement;
               const { outlineStyle, outlineWidth } = getComputedStyle(at);
               return outlineStyle !== 'none' && outlineWidth !== '0px' ? '' : at.outerHTML.slice(0, 80);
             })()",
        );
        if seen != "" {
            unseen.push(seen);
        }
        if page.value(is_there) == true {
            came = true;
            break;
        }
    }
    assert!(came, "Tab does not lead to the switch of hysteresis");
    assert_eq!(unseen, Vec::<Value>::new(), "nobody sees where the keys go");
    for what in ["hysteresis off by the keyboard", "and on again"] {
        page.changes(what, |page| page.press(Key::Space));
    }
    page.press(Key::Tab);
    // A step is a thousandth of the way, which the digits of the error may not show.
    page.changes("its size by arrows", |page| {
        (0..50).for_each(|_| page.press(Key::Right));
    });
}

/// At either end of every slider: with a minus sign and powers of ten, and to the three digits that are shown the end itself.
fn sliders_tell_their_values_as_in_print(page: &mut Opened) {
    let told = page.value(
        "[...document.querySelectorAll('.effect input[type=range]')].flatMap((slider) =>
           [[0, 'low'], [1000, 'high']].map(([at, end]) => {
             slider.value = at;
             slider.dispatchEvent(new Event('input'));
             const { unit } = slider.dataset;
             return [Number(slider.dataset[end]), unit, slider.nextElementSibling.textContent, slider.ariaValueText];
           }))",
    );
    let told = told.as_array().expect("sliders");
    let (mut below, mut powers) = (0, 0);
    for slider in told {
        let [end, unit, shown, spoken] = [0, 1, 2, 3].map(|index| &slider[index]);
        let (unit, shown) = (unit.as_str().expect("text"), shown.as_str().expect("text"));
        assert_eq!(spoken, shown);
        let number = shown.strip_suffix(unit).map(str::trim_end);
        let number = number.unwrap_or_else(|| panic!("`{shown}` is not in {unit}"));
        let is_of_print =
            |c: char| c.is_ascii_digit() || "\u{2212}.×⁻".contains(c) || POWERS.contains(c);
        assert!(number.chars().all(is_of_print), "`{shown}`");
        below += usize::from(number.contains('\u{2212}'));
        powers += usize::from(number.contains('×'));
        let end = end.as_f64().expect("a number");
        // The third digit of four is rounded: half of one in a hundred at most.
        assert!(
            (read(number) - end).abs() <= 5e-3 * end.abs(),
            "`{shown}` is {end}"
        );
    }
    assert!(
        below > 0 && powers > 0,
        "{below} and {powers} of {}",
        told.len()
    );
}

const POWERS: &str = "⁰¹²³⁴⁵⁶⁷⁸⁹";

/// The number that stands in print.
fn read(printed: &str) -> f64 {
    let digit = |c: char| match POWERS.chars().position(|power| power == c) {
        Some(digit) => char::from_digit(digit as u32, 10).expect("one digit"),
        None if matches!(c, '⁻' | '\u{2212}') => '-',
        None => c,
    };
    let digits: String = printed.replace("×10", "e").chars().map(digit).collect();
    let number = digits.parse();
    number.unwrap_or_else(|_| panic!("`{printed}` is no number"))
}

/// What a screen reader has to say of controls, charts, tables and headings.
fn is_named_for_a_screen_reader(page: &mut Opened) {
    let tree = page.ask("Accessibility.getFullAXTree", json!({}));
    let nodes = tree["nodes"].as_array().expect("a tree");
    let of = |node: &Value, key: &str| node[key]["value"].as_str().unwrap_or_default().to_owned();
    let is_told = |node: &&Value| node["ignored"] != true;
    let count = |role: &str, least: usize| {
        let all = nodes.iter().filter(is_told);
        let all: Vec<&Value> = all.filter(|node| of(node, "role") == role).collect();
        assert!(all.len() >= least, "{} of {role}, not {least}", all.len());
        let nameless = all.iter().find(|node| of(node, "name").trim().is_empty());
        assert_eq!(nameless, None, "a {role} without a name");
        all.len()
    };
    let effects = count("switch", 20);
    count("slider", effects);
    count("radio", 2);
    count("image", 3);
    count("table", 2);
    count("heading", 6);
    count("link", 6);
    let roles: Vec<String> = nodes.iter().map(|node| of(node, "role")).collect();
    for landmark in ["main", "navigation", "banner", "status"] {
        assert!(
            roles.iter().any(|role| role == landmark),
            "no {landmark}: {roles:?}"
        );
    }
}

/// Every width, and both colour schemes: the text stands out from what it is on.
fn is_read_in_any_light(page: &mut Opened) {
    for scheme in ["light", "dark"] {
        page.shown_as("screen", scheme);
        let faint = page.value(&format!(
            "(() => {{
               const parsed = (text) => text.match(/[\\d.]+/g).map(Number);
               const bright = (rgb) => {{
                 const [r, g, b] = rgb.map((c) => c / 255).map((c) => c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4);
                 return 0.2126 * r + 0.7152 * g + 0.0722 * b;
               }};
               const ground = (element) => {{
                 for (let at = element; at; at = at.parentElement) {{
                   const colour = parsed(getComputedStyle(at).backgroundColor);
                   if (colour[3] !== 0) return colour.slice(0, 3);
                 }}
                 return [255, 255, 255];
               }};
               const contrast = (one, other) => {{
                 const [high, low] = [bright(one), bright(other)].sort((a, b) => b - a);
                 return (high + 0.05) / (low + 0.05);
               }};
               const hasText = (e) => [...e.childNodes].some((n) => n.nodeType === 3 && n.data.trim());
               return [...document.body.querySelectorAll('*')]
                 .filter((e) => hasText(e) && e.getClientRects().length && !e.closest('script, fieldset:disabled'))
                 .map((e) => {{
                   const style = getComputedStyle(e);
                   const ink = parsed(e.closest('svg') ? style.fill : style.color).slice(0, 3);
                   return [contrast(ink, ground(e)), e.textContent.trim().slice(0, 40)];
                 }})
                 .filter(([contrast]) => contrast < {CONTRAST});
             }})()"
        ));
        assert_eq!(faint, json!([]), "too faint to be read, {scheme}");
        for width in WIDTHS {
            page.resize(width);
            if scheme == "light" {
                page.picture(&width.to_string());
            }
        }
        if scheme == "dark" {
            page.picture(scheme);
        }
    }
    page.shown_as("screen", "light");
}

/// On paper there are no controls, and all that is beside them.
fn is_printed(page: &mut Opened) {
    page.shown_as("print", "dark");
    let shown = |selector: &str| {
        format!("document.querySelector('{selector}').getClientRects().length > 0")
    };
    for (selector, is_there) in [(".controls", false), ("nav", false), (".chart", true)] {
        assert_eq!(
            page.value(&shown(selector)),
            is_there,
            "{selector} in print"
        );
    }
    let ground = page.value("getComputedStyle(document.body).backgroundColor");
    assert_eq!(ground, "rgb(255, 255, 255)", "paper is white");
    page.picture("print");
    let printed = page.ask("Page.printToPDF", json!({}));
    let bytes = STANDARD.decode(printed["data"].as_str().expect("a document"));
    assert!(bytes.expect("base64").starts_with(b"%PDF"), "no document");
    page.shown_as("screen", "light");
}

//! The page of `report`, what is inside it, and the lab's code that it carries.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::read::GzDecoder;
use flate2::write::GzEncoder;
use lab_view::{Desk, Opening, Request, catalogue};
use serde_json::Value;
use wasmi::{Engine, Instance, Linker, Memory, Module, Store, TypedFunc};

use crate::common::no_boards;
use crate::trial::{trial, written};
use crate::{lab, place, refuses, session};

/// What a page may weigh (bytes), so that it can be sent by mail.
const LARGE: usize = 2_000_000;

/// A page of the session with no hidden effect and of a trial, which all tests share.
fn page() -> &'static Path {
    static PAGE: OnceLock<PathBuf> = OnceLock::new();
    PAGE.get_or_init(|| {
        let page = place().join("report.html");
        let (files, name) = (session(""), page.to_string_lossy());
        let trial = written(&trial(3.0, 0.03), place());
        let trial = trial.to_string_lossy();
        let words = ["report", &files.to_string_lossy(), "--trial", &trial];
        let said = lab(&[&words[..], &["-o", &name]].concat());
        assert_eq!(said.code, 0, "{}", said.err);
        page
    })
}

#[test]
fn a_page_stands_alone_and_is_replayed_to_the_last_bit() {
    let page = page();
    let html = fs::read_to_string(page).expect("a page");
    assert!(html.len() < LARGE, "{} bytes", html.len());
    // It says what the tool says, and asks nobody.
    let files = session("");
    let found = lab(&["diagnose", "paper", &files.to_string_lossy()]).out;
    let verdict = found.lines().next().expect("a verdict");
    assert!(html.contains(&format!("<h1>{verdict}</h1>")), "{verdict}");
    // What is packed into the page has letters only, and no colon.
    let addresses = html.matches("http:").count() + html.matches("https:").count();
    assert_eq!(
        addresses,
        html.matches("http://www.w3.org/2000/svg").count()
    );
    for id in ["creep", "sensor-gain"] {
        assert!(html.contains(&format!("data-effect=\"{id}\"")));
    }
    let name = page.to_string_lossy();
    let said = lab(&["replay", &name]);
    assert_eq!(said.code, 0, "{}{}", said.out, said.err);
    assert!(said.out.contains("to the last bit"), "{}", said.out);
    let shown = "and so is all that the page shows";
    assert!(said.out.contains(shown), "{}", said.out);
    refuses(
        &["report", &files.to_string_lossy(), "-o", &name],
        "already exists",
    );
}

#[test]
fn the_board_is_in_the_page_with_its_calibration_before_and_after() {
    let html = fs::read_to_string(page()).expect("a page");
    let (_, board) = html.split_once("id=\"board\"").expect("the board");
    let (board, _) = board.split_once("</section>").expect("its end");
    for said in [
        "Board: a made-up board.",
        "Calibrated for <strong>mirror &lt;7&gt;</strong>, 2026-11-21, from the identified model ",
        "before that: as the factory left it",
        "Not inverted by the board: resonance: it still rings.",
        "<th scope=\"row\">error at rest, rms</th><td>3.000</td><td>0.030</td><td>µm</td>",
        "error at rest, after: error (µm) against asked (µm)",
    ] {
        assert!(board.contains(said), "`{said}` is not in {board:.4000}");
    }
    assert_eq!(board.matches("<svg").count(), 8);
    assert!(!board.contains("NaN") && !board.contains("inf"));
}

#[test]
fn what_is_no_whole_trial_is_told() {
    let place = no_boards();
    let files = session("");
    let refused = |change: fn(&mut Value), why: &str| {
        let mut trial = trial(3.0, 0.03);
        change(&mut trial);
        let trial = written(&trial, place.path());
        let (trial, page) = (trial.to_string_lossy(), place.path().join("none.html"));
        let words = ["report", &files.to_string_lossy(), "--trial", &trial];
        refuses(
            &[&words[..], &["-o", &page.to_string_lossy()]].concat(),
            why,
        );
        assert!(!page.exists());
    };
    refused(|trial| *trial = "rubbish".into(), "it states no format");
    refused(|trial| trial["format"] = 9.into(), "it has format 9");
    refused(
        |trial| trial["after"]["rest"]["points"] = Value::Array(vec![]),
        "one of its series has no readings",
    );
    refused(
        |trial| trial["before"]["step"]["points"][0]["reached_um"] = Value::Null,
        "is no trial of a calibration",
    );
    refused(
        |trial| trial["calibration"] = "format = 1".into(),
        "is no trial of a calibration",
    );
}

#[test]
fn what_is_no_whole_page_is_told() {
    let place = no_boards();
    let html = fs::read(page()).expect("a page");
    let file = |name: &str, bytes: &[u8]| {
        let path = place.path().join(name);
        fs::write(&path, bytes).expect("written");
        path.to_string_lossy().into_owned()
    };
    // A disk was full; somebody sent another page.
    let inside = String::from_utf8_lossy(&html)
        .find("id=\"inside\"")
        .expect("data");
    refuses(
        &["replay", &file("cut.html", &html[..inside + 5000])],
        "ends in the middle",
    );
    refuses(
        &["replay", &file("early.html", &html[..1000])],
        "holds no session",
    );
    refuses(
        &["replay", &file("other.html", b"<html></html>")],
        "holds no session",
    );
    refuses(&["replay", "/no/such.html"], "cannot be read");
    let name = place.path().join("none.html");
    refuses(
        &["report", "/no/such.csv", "-o", &name.to_string_lossy()],
        "cannot be read",
    );
    assert!(!name.exists());
}

#[test]
fn a_session_that_a_full_disk_cut_short_is_told_in_its_page_and_by_its_replay() {
    let place = no_boards();
    let files = place.path().join("cut");
    fs::create_dir(&files).expect("a folder");
    for entry in fs::read_dir(session("")).expect("a session") {
        let path = entry.expect("an entry").path();
        let text = fs::read_to_string(&path).expect("text");
        let name = path.file_name().expect("a name");
        // The last line, which says how many rows there are, was not written any more.
        let text = match name == "sweep.csv" {
            true => format!("# ends_with=rows\n{text}"),
            false => text,
        };
        fs::write(files.join(name), text).expect("written");
    }
    let page = place.path().join("cut.html");
    let (files, name) = (files.to_string_lossy(), page.to_string_lossy());
    let said = lab(&["report", &files, "-o", &name]);
    assert_eq!(said.code, 0, "{}", said.err);
    let html = fs::read_to_string(&page).expect("a page");
    const FLAW: &str = "is not whole, and is read for what it has: it was cut short after ";
    for section in ["id=\"verdict\"", "id=\"data\""] {
        let (_, section) = html.split_once(section).expect("a section");
        let (section, _) = section.split_once("</section>").expect("its end");
        assert!(section.contains(FLAW), "{section:.2000}");
    }
    let said = lab(&["replay", &name]);
    assert_eq!(said.code, 0, "{}", said.out);
    assert!(said.sentence().contains(FLAW), "{}", said.err);
}

/// A page whose inside somebody changed.
fn changed(html: &str, change: impl FnOnce(&mut Value)) -> String {
    let (head, rest) = html.split_once("id=\"inside\">").expect("data");
    let (packed, tail) = rest.split_once('<').expect("an end");
    let packed = STANDARD.decode(packed).expect("base64");
    let mut inside = serde_json::from_reader(GzDecoder::new(&packed[..])).expect("JSON");
    change(&mut inside);
    let mut packer = GzEncoder::new(Vec::new(), Compression::fast());
    serde_json::to_writer(&mut packer, &inside).expect("packed");
    let packed = STANDARD.encode(packer.finish().expect("packed"));
    format!("{head}id=\"inside\">{packed}<{tail}")
}

#[test]
fn what_was_changed_in_a_page_is_listed() {
    let place = no_boards();
    let html = fs::read_to_string(page()).expect("a page");
    let other = place.path().join("other.html");
    let was = changed(&html, |inside| {
        inside["version"] = "0.0.9".into();
        inside["results"]["diagnosis"]["verdict"] = "unknown".into();
        inside["tried"]["after"]["rest"]["points"][0]["reached_um"] = 12.0.into();
        let misfit = &mut inside["results"]["diagnosis"]["misfit"];
        *misfit = (misfit.as_f64().expect("a number") * (1.0 + 1e-9)).into();
    });
    fs::write(&other, was).expect("written");
    let said = lab(&["replay", &other.to_string_lossy()]);
    assert_eq!(said.code, 1, "{}", said.out);
    let verdict = "diagnosis.verdict: \"unknown\" in the page, \"none\" now";
    assert!(said.out.contains(verdict), "{}", said.out);
    let moved = "trial.after.rest_largest_um: 0.0";
    assert!(said.out.contains(moved), "{}", said.out);
    assert!(said.out.contains("  1 of ") && said.out.contains("differ by rounding"));
    assert!(
        said.sentence().contains("written by version 0.0.9"),
        "{}",
        said.err
    );

    // A verdict that people read, beside what it was computed from.
    let verdict = "<h1>Nothing is missing";
    let false_one = html.replace(verdict, "<h1>Missing: creep");
    assert_ne!(false_one, html);
    fs::write(&other, false_one).expect("written");
    let said = lab(&["replay", &other.to_string_lossy()]);
    assert_eq!(said.code, 1, "{}", said.out);
    assert!(
        said.out.contains("what it shows, line ") && said.out.contains("Missing: creep"),
        "{}",
        said.out
    );

    // The session itself cannot be read.
    let broken = changed(&html, |inside| {
        inside["opening"]["files"][0]["text"] = "t_s,V_V\n1,x\n".into();
    });
    fs::write(&other, broken).expect("written");
    refuses(&["replay", &other.to_string_lossy()], "is no whole report");
    let broken = changed(&html, |inside| {
        inside["tried"]["calibration"] = "format = 1".into();
    });
    fs::write(&other, broken).expect("written");
    refuses(&["replay", &other.to_string_lossy()], "is no whole report");
}

/// The lab's code as a page runs it.
struct InPage {
    store: Store<()>,
    memory: Memory,
    room: TypedFunc<u32, u32>,
    answer: TypedFunc<(), u32>,
    answer_at: TypedFunc<(), u32>,
}

impl InPage {
    fn new() -> Self {
        let built = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/page/lab-view.wasm");
        let engine = Engine::default();
        let module = Module::new(&engine, fs::read(built).expect("built")).expect("a module");
        let mut store = Store::new(&engine, ());
        let instance: Instance = Linker::new(&engine)
            .instantiate_and_start(&mut store, &module)
            .expect("it imports nothing");
        Self {
            memory: instance.get_memory(&store, "memory").expect("a memory"),
            room: instance.get_typed_func(&store, "room").expect("exported"),
            answer: instance.get_typed_func(&store, "answer").expect("exported"),
            answer_at: instance
                .get_typed_func(&store, "answer_at")
                .expect("exported"),
            store,
        }
    }

    fn answer(&mut self, request: &str) -> String {
        let at = self
            .room
            .call(&mut self.store, request.len() as u32)
            .expect("room");
        let memory = self.memory;
        memory
            .write(&mut self.store, at as usize, request.as_bytes())
            .expect("written");
        let length = self.answer.call(&mut self.store, ()).expect("no panic");
        let at = self.answer_at.call(&mut self.store, ()).expect("a place");
        let mut answer = vec![0; length as usize];
        memory
            .read(&self.store, at as usize, &mut answer)
            .expect("an answer");
        String::from_utf8(answer).expect("text")
    }
}

/// An answer without its pictures, whose places another processor's mathematics may round otherwise.
fn without_pictures(answer: &str) -> Value {
    let mut answer: Value = serde_json::from_str(answer).expect("JSON");
    for (list, picture) in [("experiments", "charts"), ("stages", "chart")] {
        if let Some(list) = answer["view"][list].as_array_mut() {
            for shown in list {
                shown[picture] = Value::Null;
            }
        }
    }
    answer
}

/// A sweep and a sine of the session with hysteresis: some hundred readings, so that an interpreter has them in seconds.
fn opening() -> Opening {
    let folder = session("\"hysteresis\"");
    let file = |name: &str| lab_view::MeasuredText {
        name: name.into(),
        text: fs::read_to_string(folder.join(name)).expect("a file"),
    };
    let own = fs::read_to_string(
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/examples/aging.toml"),
    );
    Opening {
        model: mirror_model::Model::load("reconciled")
            .expect("a preset")
            .to_toml(),
        files: ["sweep.csv", "sine_20.csv"].map(file).into(),
        own_effects: vec![own.expect("an effect")],
    }
}

/// The page's code is built before the tool is, and lies there. Where it says anything else than the crates that it is built of,
/// it is an old one: `cargo xtask build-page` builds it anew. It is interpreted here, 300 times slower than the tool: every fourth
/// effect, and all where a long run asks for what is long.
#[test]
fn the_page_s_code_says_what_the_tool_says_of_every_effect() {
    let opening = opening();
    let (mut desk, mut in_page) = (Desk::default(), InPage::new());
    let mut both = |request: &Request| {
        let request = serde_json::to_string(request).expect("plain data");
        let answers = [desk.answer(&request), in_page.answer(&request)];
        let [here, there] = answers.map(|answer| without_pictures(&answer));
        assert_eq!(here, there, "cargo xtask build-page: {request:.200}");
        here
    };
    let opened = both(&Request::Open(opening.clone()));
    assert!(
        opened["opened"].as_u64().is_some_and(|count| count > 200),
        "{opened}"
    );
    let own = opening.own_effects.iter().map(|text| {
        let effect = mirror_model::effect::Formula::parse("own", text).expect("an effect");
        std::sync::Arc::new(effect) as std::sync::Arc<dyn mirror_model::effect::Effect>
    });
    let entries = catalogue(&own.collect::<Vec<_>>());
    assert!(entries.len() > 22, "{} effects and forms", entries.len());
    let show = |effects| Request::Show {
        model: opening.model.clone(),
        effects,
    };
    let plain = both(&show(vec![]));
    let step = if long_runs::are_asked_for() { 1 } else { 4 };
    let mut moved = 0;
    for entry in entries.iter().step_by(step) {
        let chosen = lab_view::Chosen {
            id: entry.info.id.to_string(),
            form: entry.form.clone(),
            values: entry.info.parameters.iter().map(|p| p.start).collect(),
        };
        moved += usize::from(both(&show(vec![chosen]))["view"]["error"] != plain["view"]["error"]);
    }
    // Some need other experiments, as an oven, to show.
    assert!(
        moved * step > 15,
        "{moved} of {} effects change the error",
        entries.len() / step
    );
    // What is no model, no effect or no number is an error in words, and the next request is answered.
    let unknown = lab_view::Chosen {
        id: "warp".into(),
        form: String::new(),
        values: vec![],
    };
    assert!(both(&show(vec![unknown]))["error"].is_string());
    assert_eq!(both(&show(vec![])), plain);
    let said = in_page.answer("rubbish");
    assert!(said.starts_with("{\"error\":"), "{said}");
}

use super::*;
use crate::Preset;
use proptest::prelude::*;

const HEAD: &str = "format = 1\npreset = \"paper\"\n";
const LEADS: &str =
    "leads = { value = 6.5, unit = \"ohm\", tolerance = 0.5, source = \"four wires\" }\n";

/// A segment with these films, and what else is said of it.
fn segment(films: &str, more: &str) -> String {
    let fact = |value: f64| {
        format!("{{ value = {value}, unit = \"um\", tolerance = 1.0, source = \"drawing\" }}")
    };
    let (length, width) = (fact(250.0), fact(100.0));
    format!(
        "[[device.segments]]\nname = \"NI\"\nlength = {length}\nwidth = {width}\nfilms = [{films}]\n{more}\n"
    )
}

/// A film of a micrometre.
fn film(name: &str) -> String {
    format!(
        "{{ film = \"{name}\", thickness = {{ value = 1.0, unit = \"um\", tolerance = 0.05, source = \"ellipsometer\" }} }}"
    )
}

fn parsed(device: &str) -> Model {
    Model::parse("m.toml", &format!("{HEAD}[device]\n{device}")).unwrap()
}

/// What is said of a device, and the place that it points at.
fn error(device: &str) -> (String, String) {
    let text = format!("{HEAD}[device]\n{device}");
    match Model::parse("m.toml", &text) {
        Err(ModelFileError::Content { message, place, .. }) => {
            let place = text[place.offset()..place.offset() + place.len()].to_owned();
            (message, place)
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn what_is_stated_is_known_and_the_rest_is_not() {
    let known = parsed(LEADS).device;
    let leads = Fact {
        value: 6.5,
        tolerance: 0.5,
        source: "four wires".into(),
    };
    assert_eq!(leads.interval(), (6.0, 7.0));
    assert_eq!(
        known.facts.into_iter().collect::<Vec<_>>(),
        [(Quantity::Leads, leads)]
    );
    assert!(known.segments.is_empty());
    assert_eq!(parsed("").device, Device::default());
    let films = [film("sio2"), film("al")].join(", ");
    let beam = &parsed(&segment(&films, "heated = true")).device.segments[0];
    let stack: Vec<Film> = beam.films.iter().map(|(film, _)| *film).collect();
    assert_eq!(stack, [Film::Oxide, Film::Aluminium]);
    assert!(beam.heated && !beam.turned && beam.loss.is_none());
}

#[test]
fn what_cannot_be_is_pointed_at() {
    let leads = |key: &str, value: &str| {
        let mut keys = [
            ("value", "6.5"),
            ("unit", "\"ohm\""),
            ("tolerance", "0.5"),
            ("source", "\"drawing\""),
        ];
        keys.iter_mut()
            .filter(|known| known.0 == key)
            .for_each(|known| known.1 = value);
        let keys: Vec<_> = keys.iter().map(|(k, v)| format!("{k} = {v}")).collect();
        format!("leads = {{ {} }}\n", keys.join(", "))
    };
    for (key, value, message) in [
        ("value", "-1.0", "leads = -1 ohm is impossible"),
        ("value", "nan", "impossible"),
        ("value", "inf", "impossible"),
        ("unit", "\"kohm\"", "leads is in ohm"),
        ("tolerance", "0.0", "above 0"),
        ("tolerance", "-1.0", "above 0"),
        ("tolerance", "nan", "above 0"),
        ("tolerance", "inf", "above 0"),
        ("tolerance", "7.0", "may not be -0.5 to 13.5 ohm"),
        ("tolerance", "1e300", "it lies between 0 and 1000 ohm"),
        ("source", "\" \"", "nothing says how leads is known"),
        ("value", "360.0", "no part of R0 = 360 ohm"),
    ] {
        let (said, at) = error(&leads(key, value));
        assert!(said.contains(message), "{said}");
        assert_eq!(at, value, "{said}");
    }
    assert!(error("height = 3").0.contains("height"));
    let (said, at) = error("leads = 3");
    assert!(said.contains("expected a fact") && at == "3", "{said}");
    let known = film("al");
    for (text, message) in [
        (segment(&known, ""), "no segment is heated"),
        (segment("", "heated = true"), "1 to 8 films"),
        (
            segment(&film("tin"), "heated = true"),
            "no film called 'tin'",
        ),
        (
            segment(&[&known[..]; 9].join(", "), "heated = true"),
            "films",
        ),
        (
            segment(&known, "heated = true").repeat(17),
            "1 to 16 segments",
        ),
        (segment(&known, "heated = true\nturn = true"), "turn"),
        ("segments = []".into(), "1 to 16 segments"),
    ] {
        let (said, _) = error(&text);
        assert!(said.contains(message), "{said}");
    }
}

#[test]
fn a_device_of_which_nothing_is_known_is_not_written() {
    assert!(!Model::from(Preset::Paper).to_toml().contains("[device]"));
}

/// A fact that its quantity can have.
fn fact_of(quantity: Quantity) -> impl Strategy<Value = Fact> {
    let (low, high) = quantity.range();
    // Leads stay below the preset's cold resistance.
    let high = high.min(300.0);
    (0.1..0.9_f64, 0.01..0.1_f64, ".*[a-z]").prop_map(move |(at, part, source)| Fact {
        value: low + at * (high - low),
        tolerance: part * (high - low),
        source,
    })
}

fn segments() -> impl Strategy<Value = Vec<Segment>> {
    let films = (
        prop::sample::select(&Film::ALL[..]),
        fact_of(Quantity::Thickness),
    );
    let segment = (
        ".*",
        fact_of(Quantity::Length),
        fact_of(Quantity::Width),
        prop::collection::vec(films, 1..=Segment::MOST_FILMS),
        prop::option::of(fact_of(Quantity::Loss)),
        any::<bool>(),
    );
    let segment = segment.prop_map(|(name, length, width, films, loss, turned)| Segment {
        name,
        length,
        width,
        films,
        loss,
        heated: true,
        turned,
    });
    prop::collection::vec(segment, 0..4)
}

proptest! {
    #[test]
    fn what_is_written_of_a_device_is_read_back(
        facts in Quantity::OF_THE_MIRROR.map(|quantity| prop::option::of(fact_of(quantity))),
        segments in segments(),
    ) {
        let stated = Quantity::OF_THE_MIRROR.into_iter().zip(facts);
        let mut model = Model::from(Preset::Reconciled);
        model.device = Device {
            facts: stated.filter_map(|(quantity, fact)| Some((quantity, fact?))).collect(),
            segments,
        };
        prop_assert_eq!(Model::parse("m.toml", &model.to_toml()).unwrap(), model);
    }
}

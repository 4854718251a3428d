use super::*;
use proptest::prelude::*;

#[test]
fn reads_what_people_write() {
    for text in [
        "120um", "120 um", "120 µm", "120μm", " 0.12mm ", "1.2e2um", "120000nm",
    ] {
        let length: Length = text.parse().unwrap();
        assert!((length.um - 120.0).abs() < 1e-9, "{text}");
    }
    for (text, deg) in [
        ("0.05deg", 0.05),
        ("-0.02 °", -0.02),
        ("-20mdeg", -0.02),
        ("1mrad", 1e-3_f64.to_degrees()),
        ("5urad", 5e-6_f64.to_degrees()),
        ("5 µrad", 5e-6_f64.to_degrees()),
        ("5μrad", 5e-6_f64.to_degrees()),
    ] {
        let angle: Angle = text.parse().unwrap();
        assert!((angle.deg - deg).abs() < 1e-12, "{text}");
    }
    assert!("0.05".parse::<Angle>().is_err());
    for text in ["1.9V", "1.9 V", "1900mV", "1.9v"] {
        assert!(
            (text.parse::<Voltage>().unwrap().v - 1.9).abs() < 1e-12,
            "{text}"
        );
    }
    assert_eq!("−1.5um".parse::<Length>().unwrap().um, -1.5);
    assert!("-0um".parse::<Length>().unwrap().um.is_sign_positive());
    for (text, hz) in [
        ("20Hz", 20.0),
        ("0.01 Hz", 0.01),
        ("10kHz", 1e4),
        ("100mHz", 0.1),
    ] {
        assert!((text.parse::<Frequency>().unwrap().hz - hz).abs() < 1e-12);
    }
    assert!("0Hz".parse::<Frequency>().is_err());
    for text in ["499ohm", "499 Ω", "0.499kohm"] {
        assert!((text.parse::<Resistance>().unwrap().ohm - 499.0).abs() < 1e-9);
    }
    assert!("0ohm".parse::<Resistance>().is_err());
    for text in ["22.5degC", "22.5 °C"] {
        assert_eq!(text.parse(), Ok(Temperature { celsius: 22.5 }));
    }
    assert_eq!("-10 K".parse(), Ok(TemperatureRise { k: -10.0 }));
    assert_eq!("1min".parse::<Span>().unwrap().s, 60.0);
    assert_eq!("forever".parse(), Ok(Hold::Forever));
    assert_eq!("2s".parse(), Ok(Hold::For(Span { s: 2.0 })));
    assert!("for ever".parse::<Hold>().is_err());
}

#[test]
fn a_number_alone_is_in_the_unit_that_is_usual_there() {
    assert_eq!(in_unit("120", "um"), Ok(Length { um: 120.0 }));
    assert_eq!(in_unit(" 1e-4", "m"), Ok(Length { um: 100.0 }));
    assert_eq!(in_unit("120 nm", "um"), Ok(Length { um: 0.12 }));
    for text in ["1,5", "1V", "nan", "inf", "", "um"] {
        assert!(in_unit::<Length>(text, "um").is_err(), "{text}");
    }
}

#[test]
fn every_unit_is_known_and_no_other_word() {
    for unit in ["um", "μm", "°", "V", "kΩ", "kHz", "degC", "K", "µs", "h"] {
        assert!(is_unit(unit), "{unit}");
    }
    for word in ["", "120um", "UM", "sine"] {
        assert!(!is_unit(word), "{word}");
    }
    for number in ["120", "-0.5", "−2", "1e3"] {
        assert!(is_unit_of(number, "um"), "{number}");
    }
    for number in ["", "set-z", "120um", "--cycles"] {
        assert!(!is_unit_of(number, "um"), "{number}");
    }
}

#[test]
fn says_what_is_wrong_and_what_would_be_right() {
    let say = |text: &str| text.parse::<Length>().unwrap_err().to_string();
    assert_eq!(say("1,5um"), "`1,5um` has a decimal comma; write 1.5um");
    for (written, point) in [
        ("1.000,0um", "1000.0um"),
        ("-12.345.678,9 nm", "-12345678.9 nm"),
    ] {
        let told = format!("`{written}` has a decimal comma; write {point}");
        assert_eq!(say(written), told);
    }
    assert!(say("1,000.5um").starts_with("`,000.5um` is not a unit"));
    assert_eq!(say("120"), "`120` has no unit; write for example 120um");
    assert_eq!(
        say("up"),
        "`up` does not start with a number; write for example 120um"
    );
    assert_eq!(
        say("nan"),
        "`nan` does not start with a number; write for example 120um"
    );
    assert_eq!(
        say("1.9V"),
        "`V` is not a unit of a position; use one of um, µm, μm, nm, mm, m"
    );
    assert_eq!(
        say("1e999um"),
        "`1e999um` is not a position that can be used; write for example 120um"
    );
    assert_eq!(
        "-1s".parse::<Span>().unwrap_err().to_string(),
        "`-1s` is not a time span up to 100 h that can be used; write for example 500ms"
    );
}

proptest! {
    #[test]
    fn what_is_printed_is_read_again(um in proptest::num::f64::NORMAL) {
        let length = Length { um };
        prop_assert_eq!(length.to_string().parse::<Length>().unwrap(), length);
    }

    #[test]
    fn any_text_gives_a_number_or_a_sentence(text in "\\PC{0,20}") {
        if let Ok(length) = text.parse::<Length>() {
            prop_assert!(length.um.is_finite());
        }
    }
}

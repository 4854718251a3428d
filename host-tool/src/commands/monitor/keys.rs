//! What the keys of the live view mean.

use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyEventKind, KeyModifiers};

/// A nudge (um), and one with shift.
const STEP_UM: f64 = 1.0;
const LONG_STEP_UM: f64 = 10.0;

/// The keys, in a line for people, those that nobody should have to look for first.
pub(super) const HELP: &str =
    "space stop  q quit  arrows 1 um, shift 10  60 Enter  h hold  r record  c clear";

/// What is meant by a key.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Key {
    /// Move by so much (um).
    Nudge(f64),
    /// Type a position, or with a sign a step.
    Character(char),
    Backspace,
    Escape,
    Enter,
    /// Stay at the position of this moment.
    Hold,
    Stop,
    Clear,
    Record,
    Quit,
    Interrupt,
}

/// What is meant by a key, if anything is. While a position `is_typed`, a zero is a digit, and there are units.
pub(super) fn read(event: &KeyEvent, is_typed: bool) -> Option<Key> {
    if event.kind == KeyEventKind::Release {
        return None;
    }
    let has = |modifier| event.modifiers.contains(modifier);
    let step_um = if has(KeyModifiers::SHIFT) {
        LONG_STEP_UM
    } else {
        STEP_UM
    };
    Some(match event.code {
        KeyCode::Char('c') if has(KeyModifiers::CONTROL) => Key::Interrupt,
        KeyCode::Char(_) if has(KeyModifiers::CONTROL) || has(KeyModifiers::ALT) => return None,
        KeyCode::Up | KeyCode::Right => Key::Nudge(step_um),
        KeyCode::Down | KeyCode::Left => Key::Nudge(-step_um),
        KeyCode::PageUp => Key::Nudge(LONG_STEP_UM),
        KeyCode::PageDown => Key::Nudge(-LONG_STEP_UM),
        KeyCode::Char(' ') => Key::Stop,
        KeyCode::Char('0') if !is_typed => Key::Stop,
        KeyCode::Char(of_number @ ('0'..='9' | '.' | '+' | '-')) => Key::Character(of_number),
        KeyCode::Char(unit @ ('u' | 'µ' | 'n' | 'm')) if is_typed => Key::Character(unit),
        KeyCode::Enter => Key::Enter,
        KeyCode::Backspace => Key::Backspace,
        KeyCode::Esc => Key::Escape,
        KeyCode::Char('h') => Key::Hold,
        KeyCode::Char('c') => Key::Clear,
        KeyCode::Char('r') => Key::Record,
        KeyCode::Char('q') => Key::Quit,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plain(code: KeyCode, is_typed: bool) -> Option<Key> {
        read(&KeyEvent::new(code, KeyModifiers::NONE), is_typed)
    }

    #[test]
    fn a_zero_stops_unless_it_is_a_digit_and_space_always_stops() {
        assert_eq!(plain(KeyCode::Char('0'), false), Some(Key::Stop));
        assert_eq!(plain(KeyCode::Char('0'), true), Some(Key::Character('0')));
        for is_typed in [false, true] {
            assert_eq!(plain(KeyCode::Char(' '), is_typed), Some(Key::Stop));
            assert_eq!(plain(KeyCode::Char('q'), is_typed), Some(Key::Quit));
        }
    }

    #[test]
    fn shift_makes_a_long_step_and_a_released_key_none() {
        let up = |modifiers| read(&KeyEvent::new(KeyCode::Up, modifiers), false);
        assert_eq!(up(KeyModifiers::NONE), Some(Key::Nudge(1.0)));
        assert_eq!(up(KeyModifiers::SHIFT), Some(Key::Nudge(10.0)));
        let released = KeyEvent {
            kind: KeyEventKind::Release,
            ..KeyEvent::from(KeyCode::Char(' '))
        };
        assert_eq!(read(&released, false), None);
    }

    #[test]
    fn control_is_no_letter() {
        let control = |c| {
            read(
                &KeyEvent::new(KeyCode::Char(c), KeyModifiers::CONTROL),
                false,
            )
        };
        assert_eq!(control('c'), Some(Key::Interrupt));
        assert_eq!(control('h'), None);
        assert_eq!(plain(KeyCode::Char('c'), false), Some(Key::Clear));
        assert_eq!(
            plain(KeyCode::Char('m'), false),
            None,
            "no unit without a number"
        );
    }
}

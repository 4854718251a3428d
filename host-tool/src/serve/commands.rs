//! The commands of the instrument: one table, which the parser goes by and the reference page is made of.

use crate::scpi::{Error, Kind, Unit, matches};
use crate::serve::action::{Action, Question, Reading, Registers};
use crate::serve::takes::Takes;

/// A line of the table.
pub(super) struct ScpiCommand {
    /// The header with its optional parts in brackets; what must be typed in capitals.
    pub(super) header: &'static str,
    /// What it takes, and does with it.
    pub(super) takes: Takes,
    /// What it does or answers, for the reference.
    pub(super) help: &'static str,
}

const fn command(header: &'static str, takes: Takes, help: &'static str) -> ScpiCommand {
    ScpiCommand {
        header,
        takes,
        help,
    }
}

const fn query(header: &'static str, question: Question, help: &'static str) -> ScpiCommand {
    command(header, Takes::Nothing(Action::Ask(question)), help)
}

const fn reading(header: &'static str, reading: Reading, help: &'static str) -> ScpiCommand {
    query(header, Question::Read(reading), help)
}

/// A chapter of the reference, and its commands.
pub(super) type Chapter = (&'static str, &'static [ScpiCommand]);

const MOVING: &[ScpiCommand] = &[
    command(
        "[SOURce:]POSition",
        Takes::Length(Action::SetPosition),
        "Moves the mirror, from rest and towards the substrate, and holds it for as long as this client is connected.",
    ),
    query(
        "[SOURce:]POSition?",
        Question::Position,
        "The position that was asked for, in metres, or the piston of a pose; not a number where neither was.",
    ),
    reading(
        "[SOURce:]POSition:MINimum?",
        Reading::LeastPosition,
        "Where the range begins in the present room, in metres: 0, or where the mirror rests in one that is warmer than at calibration.",
    ),
    reading(
        "[SOURce:]POSition:MAXimum?",
        Reading::MostPosition,
        "The top of the calibrated range, in metres.",
    ),
    command(
        "[SOURce:]POSE",
        Takes::Pose(Action::SetPose),
        "Moves the plate to a piston and its tilts about x and y, and holds it likewise. Tilts without a unit are in radians; they take a calibration that knows the plate's levers.",
    ),
    query(
        "[SOURce:]POSE?",
        Question::Pose,
        "The pose that was asked for, in metres and radians; not numbers where none was. A position is one without tilts.",
    ),
    command(
        "[SOURce:]VOLTage",
        Takes::Voltages(Action::SetDrives),
        "Drives the actuators with these voltages, and holds them likewise. One voltage is for all four.",
    ),
    query(
        "[SOURce:]VOLTage?",
        Question::Drives,
        "The four voltages that were asked for, in volts; not numbers where none were. What is driven is `MEASure:VOLTage?`.",
    ),
    reading(
        "[SOURce:]VOLTage:MAXimum?",
        Reading::MostDrive,
        "The highest voltage that the board drives.",
    ),
    command(
        "[SOURce:]SETTling",
        Takes::Span(Action::SetSettling),
        "How long the mirror takes to settle, in the board's time: what `*OPC?` and `*WAI` wait for after a command that drives. Until it is set, and after `*RST`, as long as the board foresees (`MEASure:SETTling?`), or 1 s, as `set-z --settle`, where it does not.",
    ),
    query(
        "[SOURce:]SETTling?",
        Question::Settling,
        "That, in seconds; not a number where it is left to the board.",
    ),
    command(
        "OUTPut[:STATe]",
        Takes::Boolean(Action::SetOutput),
        "OFF turns all channels off, whoever drives. They are turned on by a position or voltages.",
    ),
    reading(
        "OUTPut[:STATe]?",
        Reading::IsDriven,
        "1 where anything is driven.",
    ),
    reading(
        "OUTPut:PROTection:TRIPped?",
        Reading::HasTripped,
        "1 where a fault has turned the channels off.",
    ),
    command(
        "OUTPut:PROTection:CLEar",
        Takes::Nothing(Action::ClearFaults),
        "Lets the board forget its faults, so that it can be driven again.",
    ),
];

const READING: &[ScpiCommand] = &[
    reading(
        "MEASure:POSition?",
        Reading::Position,
        "The board's position sensor, in metres, where it has one.",
    ),
    reading(
        "MEASure:POSE?",
        Reading::Pose,
        "Where the board has taken the plate, as it counts: the piston in metres, the tilts about x and y in radians; these are not numbers where the calibration does not know the plate's levers.",
    ),
    reading(
        "MEASure:VOLTage?",
        Reading::Drives,
        "The four voltages that were driven in the last control tick.",
    ),
    reading(
        "MEASure:CURRent?",
        Reading::Currents,
        "The four currents of the last control tick, in amperes.",
    ),
    reading(
        "MEASure:RESistance?",
        Reading::Resistances,
        "The four heaters' resistances, in ohms, where they are driven enough to tell.",
    ),
    reading(
        "MEASure:TEMPerature?",
        Reading::Temperatures,
        "The four heaters' temperatures above ambient, in kelvins, likewise.",
    ),
    reading(
        "MEASure:ROOM?",
        Reading::Room,
        "How much warmer the surroundings are than at calibration, in kelvins, and its standard deviation; not numbers where the calibration does not tell.",
    ),
    reading(
        "MEASure:UNCertainty?",
        Reading::Uncertainty,
        "How far the plate may be from where it is asked to be, half the width of an interval that holds it in 95 of 100 cases: of the piston in metres, of either tilt in radians; not numbers where the calibration does not say what it leaves, and where a limit holds the mirror elsewhere, be it until it has cooled.",
    ),
    reading(
        "MEASure:SETTling?",
        Reading::SettlesIn,
        "Seconds until the plate has settled, 0 when it has; not a number where no position is asked for, where a limit keeps it away, and under a calibration that was never tried on the mirror.",
    ),
    reading(
        "MEASure:VOLTage:SUPPly?",
        Reading::Supply,
        "The supply of the output stages, in volts.",
    ),
    command(
        "TRACe[:DATA]?",
        Takes::CountAndSpan(Action::Trace),
        "So many samples, at most 65536, one in each period: a block of rows of little-endian 32-bit floats. The period is whole ticks of the board, of 0.1 ms. A sample that was lost on the way is missing, which the time tells.",
    ),
    query(
        "TRACe:COLumns?",
        Question::TraceColumns,
        "What a row consists of, as a string: names with their units.",
    ),
    query(
        "CALibration?",
        Question::Calibration,
        "Three strings: the mirror that the board is calibrated for, the day, and whether that is kept.",
    ),
];

const SHARING: &[ScpiCommand] = &[
    command(
        "SYSTem:BOARd",
        Takes::Text(Action::SelectBoard),
        "Speaks to this board from now on: a serial number, or an emulated board's name.",
    ),
    query(
        "SYSTem:BOARd?",
        Question::Board,
        "The board that is spoken to. Without a choice it is that of `--board`, or the only one there is.",
    ),
    query(
        "SYSTem:BOARd:CATalog?",
        Question::Boards,
        "The boards that are there, as strings.",
    ),
    query(
        "SYSTem:LOCK:REQuest?",
        Question::RequestLock,
        "1 where this client may drive, and no other from now on; 0 where another does. A command that drives asks for it by itself, but not once the board was stopped beside this client, by `host-tool off` or a reset: then this is how to say that it shall be driven again.",
    ),
    command(
        "SYSTem:LOCK:RELease",
        Takes::Nothing(Action::ReleaseLock),
        "Turns the channels off, and lets others drive. The end of the connection does the same.",
    ),
    query(
        "SYSTem:LOCK:OWNer?",
        Question::LockOwner,
        "Who drives, as a string: `127.0.0.1:53412 since 2026-11-21T14:05:00Z`; `NONE` where nobody does.",
    ),
    query(
        "SYSTem:ERRor[:NEXT]?",
        Question::NextError,
        "The oldest error of this client, which is forgotten then: its number, and what happened.",
    ),
    query(
        "SYSTem:ERRor:COUNt?",
        Question::ErrorCount,
        "How many errors wait.",
    ),
    query(
        "SYSTem:VERSion?",
        Question::Version,
        "The edition of SCPI that this follows.",
    ),
];

const STATUS: &[ScpiCommand] = &[
    reading(
        "STATus:CHANnels?",
        Reading::Channels,
        "What each channel is doing, as four strings; a fault by its name.",
    ),
    reading(
        "STATus:LIMits?",
        Reading::Limits,
        "The limits that have acted since the last command that drives, as a string of names between blanks.",
    ),
    query(
        "STATus:QUEStionable[:EVENt]?",
        Question::TakeStates(Registers::Questionable),
        "The questionable states that have come since this was asked before.",
    ),
    query(
        "STATus:QUEStionable:CONDition?",
        Question::States(Registers::Questionable),
        "The questionable states that are.",
    ),
    command(
        "STATus:QUEStionable:ENABle",
        Takes::Register(|mask| Action::SetEnable(Registers::Questionable, mask)),
        "Which of them count in the status byte.",
    ),
    query(
        "STATus:QUEStionable:ENABle?",
        Question::Enable(Registers::Questionable),
        "That.",
    ),
    query(
        "STATus:OPERation[:EVENt]?",
        Question::TakeStates(Registers::Operation),
        "The states of operation that have come since this was asked before.",
    ),
    query(
        "STATus:OPERation:CONDition?",
        Question::States(Registers::Operation),
        "The states of operation that are.",
    ),
    command(
        "STATus:OPERation:ENABle",
        Takes::Register(|mask| Action::SetEnable(Registers::Operation, mask)),
        "Which of them count in the status byte.",
    ),
    query(
        "STATus:OPERation:ENABle?",
        Question::Enable(Registers::Operation),
        "That.",
    ),
    command(
        "STATus:PRESet",
        Takes::Nothing(Action::Preset),
        "None of both counts.",
    ),
];

const COMMON: &[ScpiCommand] = &[
    query(
        "*IDN?",
        Question::Identify,
        "Maker, board, name or serial number, and firmware.",
    ),
    command(
        "*RST",
        Takes::Nothing(Action::Reset),
        "Turns the channels off where this client drives, and leaves the settling time to the board.",
    ),
    query(
        "*TST?",
        Question::SelfTest,
        "0 where no channel has tripped and the board's own calibration is in use, as each start finds; otherwise 1.",
    ),
    command(
        "*OPC",
        Takes::Nothing(Action::Complete),
        "Sets bit 0 of the standard event register once the mirror has settled.",
    ),
    query(
        "*OPC?",
        Question::AwaitComplete,
        "Answers 1 once the mirror has settled after what this client asked for last, or after the time of `SOURce:SETTling` where that says it. Where a limit keeps the mirror away for good, the error -365 with the limit's name is in the queue then; where the board cannot tell when it has settled, bit 12 of `STATus:QUEStionable` is set.",
    ),
    command(
        "*WAI",
        Takes::Nothing(Action::Wait),
        "Carries out nothing more before that.",
    ),
    command(
        "*CLS",
        Takes::Nothing(Action::ClearStatus),
        "Forgets errors and events.",
    ),
    command(
        "*ESE",
        Takes::StandardRegister(Action::SetEventEnable),
        "Which standard events count in the status byte.",
    ),
    query("*ESE?", Question::EventEnable, "That."),
    query(
        "*ESR?",
        Question::TakeEvent,
        "The standard events since this was asked before.",
    ),
    command(
        "*SRE",
        Takes::StandardRegister(Action::SetServiceEnable),
        "Which bits of the status byte ask for service.",
    ),
    query("*SRE?", Question::ServiceEnable, "That."),
    query(
        "*STB?",
        Question::StatusByte,
        "The status byte: 4 an error waits, 8 questionable, 32 a standard event, 64 asks for service, 128 operation.",
    ),
];

/// All commands, by chapter.
pub(super) const CHAPTERS: &[Chapter] = &[
    ("Moving", MOVING),
    ("Reading", READING),
    ("Boards, and who drives", SHARING),
    ("Faults, limits and states", STATUS),
    ("Common commands", COMMON),
];

/// What a unit says.
///
/// # Errors
/// Where it is none, or its parameters are not its.
pub(super) fn read(unit: &Unit) -> Result<Action, Error> {
    let all = CHAPTERS.iter().flat_map(|(_, commands)| *commands);
    let Some(command) = all.clone().find(|one| matches(one.header, &unit.header)) else {
        let header = &unit.header;
        let other = match header.strip_suffix('?') {
            Some(setting) => setting.to_owned(),
            None => format!("{header}?"),
        };
        let mut all = all;
        let advice = match all.any(|one| matches(one.header, &other)) {
            true => format!("; there is {other}"),
            false => String::new(),
        };
        let said = format!("`{header}`{advice}");
        return Err(Error::new(Kind::UndefinedHeader, said));
    };
    command.takes.read(command.header, &unit.parameters)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scpi::units;

    fn action(line: &str) -> Result<Action, Error> {
        read(units(line).remove(0).as_ref().expect("a unit"))
    }

    /// The forms in which a pattern may be typed: long and short, with its optional parts and without.
    fn forms(pattern: &str) -> Vec<String> {
        let whole = pattern.replace(['[', ']'], "");
        let mut without = String::new();
        let mut is_optional = false;
        for character in pattern.chars() {
            match character {
                '[' => is_optional = true,
                ']' => is_optional = false,
                other if !is_optional => without.push(other),
                _ => {}
            }
        }
        let short = |form: &str| form.replace(|c: char| c.is_ascii_lowercase(), "");
        vec![short(&whole), short(&without), whole, without]
    }

    #[test]
    fn every_form_of_every_header_is_its_command_s_and_no_other_s() {
        for command in CHAPTERS.iter().flat_map(|(_, commands)| *commands) {
            for form in forms(command.header) {
                let found = CHAPTERS.iter().flat_map(|(_, commands)| *commands);
                let found: Vec<&str> = found
                    .filter(|one| matches(one.header, &form))
                    .map(|one| one.header)
                    .collect();
                assert_eq!(found, [command.header], "{form}");
            }
        }
    }

    #[test]
    fn what_is_no_command_is_said_and_what_it_might_be() {
        let error = action("SOUR:POSITON 1um").expect_err("none");
        assert_eq!(error.kind, Kind::UndefinedHeader);
        let error = action("MEAS:CURR").expect_err("none");
        assert_eq!(error.detail, "`MEAS:CURR`; there is MEAS:CURR?");
    }

    #[test]
    fn parameters_are_counted() {
        for (line, kind) in [
            ("SOUR:POS", Kind::MissingParameter),
            ("SOUR:POS 1um,2um", Kind::ParameterNotAllowed),
            ("*IDN? 1", Kind::ParameterNotAllowed),
            ("VOLT 1V,2V", Kind::MissingParameter),
            ("VOLT 1,2,3,4,5", Kind::ParameterNotAllowed),
            ("TRAC? 10", Kind::MissingParameter),
        ] {
            assert_eq!(action(line).expect_err("wrong").kind, kind, "{line}");
        }
        assert_eq!(
            action("volt 1V, 2, 300mV ,0"),
            Ok(Action::SetDrives([1.0, 2.0, 0.3, 0.0]))
        );
    }
}

//! Status reporting: the error queue, the registers of IEEE 488.2 (11) and those of SCPI-1999 (9).

use std::collections::VecDeque;

use super::error::{Error, Kind};

/// Bits of the standard event status register (IEEE 488.2, 11.5.1.1).
pub(crate) mod event {
    /// What *OPC waited for is over.
    pub(crate) const OPERATION_COMPLETE: u8 = 1 << 0;
    /// An error of the device itself.
    pub(crate) const DEVICE: u8 = 1 << 3;
    /// A command could not be carried out.
    pub(crate) const EXECUTION: u8 = 1 << 4;
    /// A command was not understood.
    pub(crate) const COMMAND: u8 = 1 << 5;
}

/// Errors that are kept.
pub(crate) const MOST_ERRORS: usize = 32;

/// A condition register with its events and their mask.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Group {
    condition: u16,
    event: u16,
    /// Events that count in the summary.
    pub(crate) enable: u16,
}

impl Group {
    /// Takes the conditions as they are now: those that have come are events.
    pub(crate) fn update(&mut self, condition: u16) {
        self.event |= condition & !self.condition;
        self.condition = condition;
    }

    pub(crate) fn condition(self) -> u16 {
        self.condition
    }

    /// The events since this was asked before.
    pub(crate) fn take_event(&mut self) -> u16 {
        std::mem::take(&mut self.event)
    }

    fn summary(self) -> bool {
        self.event & self.enable != 0
    }
}

/// What one client is told of errors and states.
#[derive(Debug, Default)]
pub(crate) struct Status {
    errors: VecDeque<Error>,
    event: u8,
    /// Standard events that count in the summary.
    pub(crate) event_enable: u8,
    /// Summaries that ask for service.
    service_enable: u8,
    pub(crate) questionable: Group,
    pub(crate) operation: Group,
}

impl Status {
    /// Keeps an error; of those that find no room the last that is kept tells.
    pub(crate) fn push(&mut self, error: Error) {
        self.event |= match error.kind.told().0 {
            -199..=-100 => event::COMMAND,
            -299..=-200 => event::EXECUTION,
            _ => event::DEVICE,
        };
        if self.errors.len() < MOST_ERRORS {
            self.errors.push_back(error);
        } else if let Some(last) = self.errors.back_mut() {
            *last = Error::new(Kind::QueueOverflow, "");
        }
    }

    /// The oldest error, as `SYSTem:ERRor?` answers it.
    pub(crate) fn next_error(&mut self) -> String {
        let error = self.errors.pop_front();
        error.map_or("0,\"No error\"".to_owned(), |error| error.to_string())
    }

    pub(crate) fn error_count(&self) -> usize {
        self.errors.len()
    }

    /// Sets bits of the standard event status register.
    pub(crate) fn raise(&mut self, events: u8) {
        self.event |= events;
    }

    /// The standard events since this was asked before.
    pub(crate) fn take_event(&mut self) -> u8 {
        std::mem::take(&mut self.event)
    }

    /// The mask of the service request; its own bit counts for nothing (IEEE 488.2, 11.3.2).
    pub(crate) fn set_service_enable(&mut self, mask: u8) {
        self.service_enable = mask & !(1 << 6);
    }

    pub(crate) fn service_enable(&self) -> u8 {
        self.service_enable
    }

    /// The status byte. Answers are sent at once, so none waits to be fetched.
    pub(crate) fn byte(&self) -> u8 {
        let summaries = u8::from(!self.errors.is_empty()) << 2
            | u8::from(self.questionable.summary()) << 3
            | u8::from(self.event & self.event_enable != 0) << 5
            | u8::from(self.operation.summary()) << 7;
        summaries | u8::from(summaries & self.service_enable != 0) << 6
    }

    /// *CLS: errors and events are forgotten, masks stay.
    pub(crate) fn clear(&mut self) {
        self.errors.clear();
        self.event = 0;
        self.questionable.event = 0;
        self.operation.event = 0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flood_of_errors_is_bounded_and_said() {
        let mut status = Status::default();
        for number in 0..1000 {
            status.push(Error::new(Kind::Syntax, number.to_string()));
        }
        assert_eq!(status.error_count(), MOST_ERRORS);
        assert_eq!(status.next_error(), "-102,\"Syntax error;0\"");
        for _ in 2..MOST_ERRORS {
            status.next_error();
        }
        assert_eq!(status.next_error(), "-350,\"Queue overflow\"");
        assert_eq!(status.next_error(), "0,\"No error\"");
    }

    #[test]
    fn summaries_come_through_their_masks() {
        let mut status = Status::default();
        status.push(Error::new(Kind::DataOutOfRange, ""));
        assert_eq!(status.byte(), 1 << 2);
        status.event_enable = event::EXECUTION;
        status.set_service_enable(0xff);
        assert_eq!(status.service_enable(), 0xbf);
        assert_eq!(status.byte(), 1 << 2 | 1 << 5 | 1 << 6);
        assert_eq!(status.take_event(), event::EXECUTION);
        assert_eq!(status.take_event(), 0);
        status.questionable.enable = 1 << 9;
        status.questionable.update(1 << 9 | 1 << 8);
        assert_eq!(status.byte(), 1 << 2 | 1 << 3 | 1 << 6);
        assert_eq!(status.questionable.take_event(), 1 << 9 | 1 << 8);
        status.questionable.update(1 << 9);
        assert_eq!(status.questionable.take_event(), 0, "it has not come anew");
        assert_eq!(status.questionable.condition(), 1 << 9);
        status.clear();
        assert_eq!(status.byte(), 0);
    }
}

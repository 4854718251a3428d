//! How units are written in print.

use charts::escaped;

/// A unit as it is written in print.
pub(super) fn in_print(unit: &str) -> String {
    escaped(unit).replace("um", "µm").replace("ohm", "Ω")
}

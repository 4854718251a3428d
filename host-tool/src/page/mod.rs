//! One page for a browser that holds a session, what it says, and what that is computed from.
//!
//! - [`Run`]: a session diagnosed and fitted; [`Run::to_html`] makes the page of it;
//! - [`Inside`]: what the page carries besides what it shows, from which the run can be repeated;
//! - [`differences`]: what came out otherwise the second time;
//! - [`shown_otherwise`]: where a page shows something else.
//!
//! The page's script hands the session and the reader's switches to the lab's own code (`lab-view.wasm`, which `cargo xtask
//! build-page` builds of the crate `lab-view-wasm`) and puts what it answers in place; it computes nothing itself.

mod board;
mod controls;
mod differences;
mod html;
mod inside;
mod print;
mod run;
mod shown;

pub(crate) use differences::{Difference, differences};
pub(crate) use inside::Inside;
pub(crate) use run::Run;
pub(crate) use shown::shown_otherwise;

//! Flash in memory: pages and words of the STM32G474, and its power can be cut.

pub use simulated_flash::SharedFlash as BoardFlash;

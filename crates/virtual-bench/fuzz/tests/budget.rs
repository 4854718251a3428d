//! A fixed budget of cases in every test run; `cargo xtask fuzz` runs more, and others.

use fuzz::Target;

const CASES: u64 = 1000;

#[test]
fn nothing_that_reads_input_panics() {
    for target in Target::ALL {
        assert_eq!(target.run(0, CASES), [0; 0], "{target:?}");
    }
}

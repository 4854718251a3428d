//! The drift check as it is played, first and last.

use experiments::calibration::{self as played, CHECKED_REST_S};
use measurement::Session;

use crate::bench::{Bench, Part};
use crate::drift::{Drift, DriftCheck, RESTS};
use crate::travel;

/// The first: displacements count from where the mirror rests, once it comes back there.
pub(crate) async fn first<B: Bench>(
    bench: &mut B,
    max_v: f64,
    reach_um: f64,
) -> Result<DriftCheck, B::Error> {
    let mut before: Option<DriftCheck> = None;
    for _ in 0..RESTS {
        bench.count_from_rest().await?;
        let check = checked(bench, max_v, reach_um).await?;
        if check.may_relax() {
            let again = checked(bench, max_v, reach_um).await?;
            again.comes_back_as(&check)?;
            return Ok(again);
        }
        check.holds_still()?;
        if let Some(before) = &before {
            check.is_in_the_room_of(before)?;
        }
        if check.comes_back() {
            return Ok(check);
        }
        before = Some(check);
    }
    let apart_um = before.and_then(|last| last.apart_um()).unwrap_or_default();
    Err(Drift::NoRest { apart_um }.into())
}

async fn checked<B: Bench>(
    bench: &mut B,
    max_v: f64,
    reach_um: f64,
) -> Result<DriftCheck, B::Error> {
    let check = played::drift_check(max_v);
    let file = bench.measure(Part::DriftCheck, &check).await?;
    let session = Session {
        files: vec![(check.name, file)],
    };
    travel::check(&session, reach_um)?;
    Ok(DriftCheck::of(&session.files[0].1))
}

/// The last: by how much the mirror has moved since the first (um), 0 where it is no more than any mirror moves.
pub(crate) async fn moved_since<B: Bench>(
    first: &DriftCheck,
    bench: &mut B,
    max_v: f64,
) -> Result<f64, B::Error> {
    let check = played::drift_check(max_v).after(CHECKED_REST_S);
    let last = bench.measure(Part::DriftCheck, &check).await?;
    Ok(DriftCheck::of(&last).against(first)?)
}

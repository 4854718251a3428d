//! Words of a diagnosis, and what they say: pages of the docs.

/// The page of this name.
macro_rules! page {
    ($name:literal) => {
        (
            $name,
            include_str!(concat!("../../docs/terms/", $name, ".md")),
        )
    };
}

/// Name and page, in the order of the diagnosis's table, and then of the lines above it.
pub(crate) const TERMS: [(&str, &str); 7] = [
    page!("score"),
    page!("threshold"),
    page!("weight"),
    page!("held-out"),
    page!("size"),
    page!("misfit"),
    page!("discrepancy"),
];

/// Their names.
pub(crate) fn terms() -> impl Iterator<Item = &'static str> {
    TERMS.iter().map(|(name, _)| *name)
}

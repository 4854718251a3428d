//! What a user knows of a mirror apart from any session: its structure, each number with the tolerance within which it holds.
//!
//! Eqs. 1-9 use none of it. A diagnosis asks it which mirrors this one could be: what is not stated stays open.

use std::collections::BTreeMap;

/// A number that is known apart from any session.
#[derive(Clone, Debug, PartialEq)]
pub struct Fact {
    /// The middle of the interval that it lies in, in its quantity's unit.
    pub value: f64,
    /// Half the width of that interval; above 0. Any value inside is as likely as another: a rectangular distribution (JCGM
    /// 100:2008, "Guide to the expression of uncertainty in measurement", 4.3.7).
    pub tolerance: f64,
    /// How it is known, in words: a drawing, a microscope, an ohmmeter.
    pub source: String,
}

impl Fact {
    /// The lowest and the highest value that it may have.
    pub fn interval(&self) -> (f64, f64) {
        (self.value - self.tolerance, self.value + self.tolerance)
    }
}

/// What a fact is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Quantity {
    /// Resistance of leads and contacts in series with each heater.
    Leads,
    /// Height of the cold plate above the anchors of its beams.
    RestHeight,
    /// Edge length of the plate.
    PlateSide,
    /// Thickness of the plate's silicon.
    PlateThickness,
    /// Heat that the plate loses to the air.
    PlateLoss,
    /// Length of a segment along the beam.
    Length,
    /// Width of a segment: of all parallel beams of the actuator together.
    Width,
    /// Thickness of a film.
    Thickness,
    /// Heat that a segment loses to the air, per length.
    Loss,
}

impl Quantity {
    /// Those of the whole mirror, which `[device]` has keys for; the others are a segment's.
    pub const OF_THE_MIRROR: [Self; 5] = [
        Self::Leads,
        Self::RestHeight,
        Self::PlateSide,
        Self::PlateThickness,
        Self::PlateLoss,
    ];

    /// Its key in model files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Leads => "leads",
            Self::RestHeight => "rest_height",
            Self::PlateSide => "plate_side",
            Self::PlateThickness => "plate_thickness",
            Self::PlateLoss => "plate_loss",
            Self::Length => "length",
            Self::Width => "width",
            Self::Thickness => "thickness",
            Self::Loss => "loss",
        }
    }

    /// The unit of its facts.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Leads => "ohm",
            Self::PlateLoss => "uW/K",
            Self::Loss => "W/(m K)",
            _ => "um",
        }
    }

    /// Lowest and highest value that any such mirror could have, in its unit.
    pub fn range(self) -> (f64, f64) {
        match self {
            Self::Leads => (0.0, 1e3),
            Self::RestHeight => (0.0, 400.0),
            Self::PlateSide => (50.0, 5e3),
            Self::PlateThickness => (1.0, 500.0),
            Self::PlateLoss => (0.0, 1e5),
            Self::Length => (1.0, 5e3),
            Self::Width => (1.0, 1e3),
            Self::Thickness => (0.01, 20.0),
            Self::Loss => (0.0, 10.0),
        }
    }
}

/// The material of a film.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Film {
    /// Aluminium.
    Aluminium,
    /// Silicon dioxide.
    Oxide,
    /// Platinum.
    Platinum,
}

impl Film {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Aluminium, Self::Oxide, Self::Platinum];

    /// Its name in model files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Aluminium => "al",
            Self::Oxide => "sio2",
            Self::Platinum => "pt",
        }
    }
}

/// A piece of an actuator's beam with one stack of films.
#[derive(Clone, Debug, PartialEq)]
pub struct Segment {
    /// What it is called.
    pub name: String,
    /// [`Quantity::Length`].
    pub length: Fact,
    /// [`Quantity::Width`].
    pub width: Fact,
    /// The films from the substrate's side up, each with its [`Quantity::Thickness`].
    pub films: Vec<(Film, Fact)>,
    /// [`Quantity::Loss`], where it is known.
    pub loss: Option<Fact>,
    /// Whether the heater runs here.
    pub heated: bool,
    /// Whether it lies behind the fold, where the same bending counts the other way along the beam.
    pub turned: bool,
}

impl Segment {
    /// The most segments of a beam: twice those of the paper's fold.
    pub const MOST: usize = 16;
    /// The most films of a segment: twice those of the paper's bimorphs.
    pub const MOST_FILMS: usize = 8;
}

/// What is known of a mirror.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Device {
    /// What is stated of quantities of the whole mirror ([`Quantity::OF_THE_MIRROR`]).
    pub facts: BTreeMap<Quantity, Fact>,
    /// The beam of an actuator from its anchor to the plate; empty where it is not known.
    pub segments: Vec<Segment>,
}

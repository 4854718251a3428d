//! A session on which models are tried: requests and answers in JSON.

use crate::catalogue::{Entry, catalogue};
use crate::view::View;
use identification::Dataset;
use measurement::{Device, MeasurementFile, Session};
use mirror_model::Model;
use mirror_model::effect::{Active, Effect, Formula};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// A measurement file as text.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MeasuredText {
    /// Its name.
    pub name: String,
    /// What is in it.
    pub text: String,
}

/// What a desk is opened with.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Opening {
    /// The model that the session was read with, as TOML: what it says of the device tells which readings are possible.
    pub model: String,
    /// The session's files in its order.
    pub files: Vec<MeasuredText>,
    /// A user's own effects, as TOML.
    pub own_effects: Vec<String>,
}

/// An effect that is switched on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Chosen {
    /// Its id.
    pub id: String,
    /// Its form; empty where there is one.
    pub form: String,
    /// The values of its parameters, in its order and units.
    pub values: Vec<f64>,
}

/// What is asked of a desk.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Request {
    /// Take this session.
    Open(Opening),
    /// Show this model on it: that of the TOML text with these effects, and no others.
    Show {
        /// The model.
        model: String,
        /// Its effects, in the order in which they act.
        effects: Vec<Chosen>,
    },
}

/// A session on which models are tried.
#[derive(Default)]
pub struct Desk {
    data: Dataset,
    effects: Vec<Entry>,
}

impl Desk {
    /// A desk with a session on it.
    ///
    /// # Errors
    /// A sentence on what cannot be read.
    pub fn open(opening: &Opening) -> Result<Self, String> {
        let own = opening.own_effects.iter().map(|text| {
            let effect = Formula::parse("own effect", text).map_err(|error| error.to_string())?;
            Ok(Arc::new(effect) as Arc<dyn Effect>)
        });
        Ok(Self {
            data: Dataset::new(&opening.session()?),
            effects: catalogue(&own.collect::<Result<Vec<_>, String>>()?),
        })
    }

    /// What a model with these effects, and no others, makes of the session.
    ///
    /// # Errors
    /// A sentence on what is no model, or has no finite answer.
    pub fn show(&self, model: &str, effects: &[Chosen]) -> Result<View, String> {
        let mut model = Model::parse("model", model).map_err(|error| error.to_string())?;
        model.effects.clear();
        for chosen in effects {
            let is_it = |entry: &&Entry| entry.info.id == chosen.id && entry.form == chosen.form;
            let entry = self.effects.iter().find(is_it);
            let entry = entry.ok_or_else(|| format!("there is no effect {}", chosen.id))?;
            let mut active = Active::usual(entry.effect.clone());
            let is_whole = chosen.values.len() == active.values.len();
            if !is_whole || !chosen.values.iter().all(|value| value.is_finite()) {
                return Err(format!("the values of {} are not whole", chosen.id));
            }
            active.values.clone_from(&chosen.values);
            model.effects.push(active);
        }
        View::new(&model, &self.data).map_err(|runaway| runaway.to_string())
    }

    /// Answers a request in JSON: `{"view": ..}`, `{"opened": rows}`, or `{"error": sentence}`.
    pub fn answer(&mut self, request: &str) -> String {
        let answer = serde_json::from_str(request)
            .map_err(|error| error.to_string())
            .and_then(|request| self.answer_to(&request));
        let answer = answer.unwrap_or_else(|error| serde_json::json!({ "error": error }));
        answer.to_string()
    }

    fn answer_to(&mut self, request: &Request) -> Result<serde_json::Value, String> {
        match request {
            Request::Open(opening) => {
                *self = Self::open(opening)?;
                Ok(serde_json::json!({ "opened": self.data.observations.len() }))
            }
            Request::Show { model, effects } => {
                Ok(serde_json::json!({ "view": self.show(model, effects)? }))
            }
        }
    }
}

impl Opening {
    /// The session that it holds.
    ///
    /// # Errors
    /// A sentence on what cannot be read.
    pub fn session(&self) -> Result<Session, String> {
        let model = Model::parse("model", &self.model).map_err(|error| error.to_string())?;
        let device = Device {
            highest_v: model.parameters.drive_limit_v,
            cold_ohm: model.parameters.cold_resistance_ohm,
        };
        let read = |file: &MeasuredText| {
            let read = MeasurementFile::parse_of(&file.name, &file.text, &device);
            Ok((file.name.clone(), read.map_err(|error| error.to_string())?))
        };
        let files = self.files.iter().map(read).collect::<Result<_, String>>()?;
        Ok(Session { files })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use identification::compare;

    fn opening() -> Opening {
        let text = "# experiment=sweep\nt_s,V_V,z_um,I_A\n1,0,0,0\n2,1,25,2.6e-3\n3,2,90,4.6e-3\n4,3,170,6.2e-3\n";
        Opening {
            model: Model::load("reconciled").unwrap().to_toml(),
            files: vec![MeasuredText {
                name: "sweep.csv".into(),
                text: text.into(),
            }],
            own_effects: vec![],
        }
    }

    #[test]
    fn a_view_says_what_a_comparison_says() {
        let opening = opening();
        let desk = Desk::open(&opening).unwrap();
        let creep = Chosen {
            id: "creep".into(),
            form: "lags".into(),
            values: vec![0.15, 5.0],
        };
        let views = [vec![], vec![creep]].map(|on| desk.show(&opening.model, &on).unwrap());
        let model = Model::parse("model", &opening.model).unwrap();
        let data = Dataset::new(&opening.session().unwrap());
        let compared = compare(&model, &data).unwrap();
        assert_eq!(views[0].error, format!("{:.3} µm", compared.rms));
        assert_eq!(
            views[0].experiments[0].rms,
            format!("{:.3}", compared.experiments[0].rms)
        );
        assert_ne!(views[0].error, views[1].error);
        assert_ne!(
            views[0].experiments[0].charts[0],
            views[1].experiments[0].charts[0]
        );
    }

    #[test]
    fn what_cannot_be_answered_is_told_in_words() {
        let mut desk = Desk::default();
        let mut said = |request: &str| desk.answer(request);
        for rubbish in [
            "",
            "{}",
            "[1]",
            "{\"show\":{\"model\":\"\",\"effects\":[]}}",
        ] {
            assert!(said(rubbish).starts_with("{\"error\":"), "{rubbish}");
        }
        let mut broken = opening();
        broken.files[0].text = "t_s,V_V\n1,x\n".into();
        let request = serde_json::to_string(&Request::Open(broken)).unwrap();
        assert!(said(&request).contains("sweep.csv"));
    }
}

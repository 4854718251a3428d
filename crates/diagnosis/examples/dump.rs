//! dump
use diagnosis::{Plan, fit::{fit, trust, predict, jacobian}, plan::Channel};
use mirror_model::{Model, Preset, effect::{built_in, Active, Effect as _}};
use rayon::prelude::*;
use std::io::Write;
use virtual_mirror::{Effect, Family, MirrorConfig, Plan as Drives};
use virtual_sessions::{Instruments, measure};
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let out = &args[1];
    if args[2] == "file" {
        let session = if args[3] == "standard" { measure(&MirrorConfig::bench(), &Drives::standard(3.5), Instruments::PositionAndCurrents).unwrap() } else { measurement::Session::load(&[&args[3]]).unwrap() };
        one(&session, &args[4], out, true);
        if args[5] == "0" { return; }
        let plan = Plan::new(&session);
        let mut jobs = vec![];
        for family in Family::ALL { for seed in 0..args[5].parse().unwrap() { jobs.push((family, 100 + seed)); } }
        jobs.into_par_iter().for_each(|(family, seed)| {
            let a = |i: usize| args[i].parse::<f64>().unwrap();
            let Some(mut config) = (0..20).map(|d| diagnosis::family::draw2(family, seed + d * 100_000, a(6), a(7), a(8))).find(|c| virtual_mirror::VirtualMirror::new(c).is_ok()) else { return };
            config.sensor.position_noise_nm = 0.0; config.sensor.current_noise_ua = 0.0; config.sensor.current_noise_ratio = 0.0;
            let mut plan = plan.clone();
            let values = diagnosis::family::observe_config(&plan, config);
            for (o, v) in plan.observations.iter_mut().zip(values) { o.value = v; }
            dump(&plan, &format!("{out}/{family:?}_{seed}_none_1"), out, false);
        });
        return;
    }
    let seeds: u64 = args[2].parse().unwrap();
    let first: u64 = args[3].parse().unwrap();
    let strengths: Vec<f64> = args[4].split(',').map(|s| s.parse().unwrap()).collect();
    std::fs::create_dir_all(out).unwrap();
    let quiet = args.get(5).is_some();
    let hidden: Vec<Option<Effect>> = if quiet { vec![None] } else { std::iter::once(None).chain(Effect::ALL.iter().copied().map(Some)).collect() };
    let mut jobs = vec![];
    for family in Family::ALL { for seed in 0..seeds { for e in &hidden { for s in &strengths {
        if e.is_none() && *s != strengths[0] { continue; }
        jobs.push((family, first + seed, *e, *s));
    }}}}
    let meta_written = std::sync::Once::new();
    jobs.into_par_iter().for_each(|(family, seed, e, s)| {
        let mut config = MirrorConfig::draw(family, seed);
        if quiet { config.sensor.position_noise_nm = 0.0; config.sensor.current_noise_ua = 0.0; config.sensor.current_noise_ratio = 0.0; }
        if let Some(e) = e { config.effects.set(e, s); }
        let Ok(session) = measure(&config, &Drives::standard(3.5), Instruments::PositionAndCurrents) else { println!("impossible {family:?} {seed} {e:?}"); return; };
        let name = format!("{out}/{family:?}_{seed}_{}_{s}", e.map_or("none", Effect::id));
        let mut f = false; meta_written.call_once(|| f = true);
        one(&session, &name, out, f);
    });
}
fn forms(effect: &std::sync::Arc<dyn mirror_model::effect::Effect>) -> Vec<Active> {
    let parameters = effect.info().parameters.clone();
    let mut forms = vec![Active::usual(effect.clone())];
    const STARTS: usize = 5;
    for (index, parameter) in parameters.iter().enumerate().skip(1) {
        let spread = |step: usize| {
            let share = (step as f64 + 0.5) / STARTS as f64;
            if parameter.low > 0.0 { parameter.low * (parameter.high / parameter.low).powf(share) }
            else { parameter.low + share * (parameter.high - parameter.low) }
        };
        let starts = if index == 1 { STARTS } else { 1 };
        forms = forms.iter().flat_map(|form| (0..starts).map(move |step| {
            let mut form = form.clone();
            form.values[index] = if starts == 1 { parameter.start } else { spread(step) };
            form
        })).collect();
    }
    forms
}
fn one(session: &measurement::Session, name: &str, out: &str, meta: bool) {
    dump(&Plan::new(session), name, out, meta);
}
fn dump(plan: &Plan, name: &str, out: &str, meta: bool) {
        let fitted = fit(&Model::from(Preset::Paper), &plan).unwrap();
        let base = predict(&fitted.model, &plan).unwrap();
        let j = jacobian(&fitted.model, &plan, &fitted.knobs).unwrap();
        if meta {
            let mut f = std::fs::File::create(format!("{out}/meta.csv")).unwrap();
            for o in &plan.observations {
                let ch = match o.channel { Channel::Displacement => -1, Channel::Current(a) => a as i64 };
                let v = plan.drive(o);
                writeln!(f, "{},{},{},{},{},{},{},{},{}", plan.experiments[o.experiment], ch, o.t_s, o.noise / trust(o), v[0], v[1], v[2], v[3], o.interval).unwrap();
            }
            let mut f = std::fs::File::create(format!("{out}/dirs.csv")).unwrap();
            for effect in built_in() { for (i, a) in forms(&effect).iter().enumerate() { writeln!(f, "{},{i},{:?},{:?}/{:?}", a.id(), a.values, effect.info().parameters[0].low / a.values[0], effect.info().parameters[0].high / a.values[0]).unwrap(); } }
        }
        let mut bytes: Vec<u8> = vec![];
        let mut push = |v: f64| bytes.extend((v as f32).to_le_bytes());
        for (r, o) in fitted.residuals.iter().zip(&plan.observations) { push(r / trust(o)); }
        for (b, o) in base.iter().zip(&plan.observations) { push(b / trust(o)); }
        for c in j.column_iter() { for v in c.iter() { push(*v); } }
        for effect in built_in() { for a in forms(&effect) {
            let mut with = fitted.model.clone();
            with.effects.push(a);
            match predict(&with, &plan) {
                Ok(p) => for ((p, b), o) in p.iter().zip(&base).zip(&plan.observations) { push((p - b) / trust(o)); },
                Err(_) => for _ in &base { push(0.0); },
            }
        }}
    std::fs::write(name, bytes).unwrap();
}

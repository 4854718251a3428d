// Hands the session and the reader's switches to the lab's own code, and puts what it answers in place.
const $ = (selector, within = document) => [...within.querySelectorAll(selector)];
const byId = (id) => document.getElementById(id);
const began = performance.now();

/** A number as it stands in print: −5.80×10⁻⁷. */
const inPrint = (digits) => digits
  .replace(/e(-?)\+?(\d+)$/, (_, sign, power) => `×10${sign && '⁻'}${[...power].map((digit) => '⁰¹²³⁴⁵⁶⁷⁸⁹'[digit]).join('')}`)
  .replace('-', '\u2212');

async function unpacked(id) {
  const bytes = Uint8Array.from(atob(byId(id).textContent), (c) => c.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('gzip'));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** The lab: a function from a request to its answer. */
function lab({ memory, room, answer, answer_at }) {
  return (request) => {
    const bytes = new TextEncoder().encode(JSON.stringify(request));
    const at = room(bytes.length);
    new Uint8Array(memory.buffer).set(bytes, at);
    const length = answer();
    // The memory may have grown, and then has another buffer.
    const answered = JSON.parse(new TextDecoder().decode(new Uint8Array(memory.buffer, answer_at(), length)));
    if (answered.error) throw new Error(answered.error);
    return answered;
  };
}

/** A slider's parameter: its value is exact until it is moved. */
class Slider {
  constructor(input) {
    this.input = input;
    this.output = input.nextElementSibling;
    [this.low, this.high, this.usual] = ['low', 'high', 'value'].map((name) => Number(input.dataset[name]));
    this.byFactors = 'factors' in input.dataset;
    this.value = this.usual;
  }
  get value() { return this.exact; }
  set value(value) {
    this.exact = value;
    const part = this.byFactors
      ? Math.log(value / this.low) / Math.log(this.high / this.low)
      : (value - this.low) / (this.high - this.low);
    this.input.value = Math.round(1000 * Math.min(1, Math.max(0, part)));
    this.say();
  }
  moved() {
    const part = this.input.value / 1000;
    this.exact = this.byFactors
      ? this.low * (this.high / this.low) ** part
      : this.low + part * (this.high - this.low);
    this.say();
  }
  say() {
    const size = Math.abs(this.exact);
    const digits = size !== 0 && (size < 1e-3 || size >= 1e5) ? this.exact.toExponential(2) : Number(this.exact.toPrecision(3)).toString();
    this.output.textContent = `${inPrint(digits)} ${this.input.dataset.unit}`.trim();
    this.input.setAttribute('aria-valuetext', this.output.textContent);
  }
}

class Effect {
  constructor(element) {
    this.element = element;
    ({ effect: this.id, form: this.form } = element.dataset);
    this.check = element.querySelector('[role=switch]');
    this.sliders = $('input[type=range]', element).map((input) => new Slider(input));
  }
  get on() { return this.check.checked; }
  set on(on) {
    this.check.checked = on;
    this.element.classList.toggle('on', on);
  }
  get chosen() { return { id: this.id, form: this.form, values: this.sliders.map((slider) => slider.value) }; }
}

function put(view) {
  byId('error').textContent = view.error;
  if (byId('current-error')) byId('current-error').textContent = view.current_error;
  for (const figure of $('[data-experiment]')) {
    const { charts, rms } = view.experiments[figure.dataset.experiment];
    $('.chart-box', figure).forEach((box, index) => { box.innerHTML = charts[index]; });
    figure.querySelector('output').textContent = rms;
  }
  $('#experiments tbody tr').forEach((row, index) => {
    const { rms, largest, percent_of_span, current_rms } = view.experiments[index];
    $('td', row).forEach((cell, column) => { cell.textContent = [rms, largest, percent_of_span, current_rms][column] ?? '–'; });
  });
  for (const figure of $('[data-stage]')) {
    const stage = view.stages[figure.dataset.stage];
    figure.querySelector('.chart-box').innerHTML = stage?.chart ?? '';
    figure.querySelector('output').textContent = stage?.error ?? '–';
  }
  byId('sentences').replaceChildren(...view.sentences.map((sentence) => {
    const item = document.createElement('li');
    item.textContent = sentence;
    return item;
  }));
}

/** All that is shown of a model, as text: to see whether two views are the same. */
const shown = () => $('#error, #current-error, #experiments td, [data-stage] output, #sentences li').map((e) => e.textContent).join('|');

function say(sentence, isWrong = false) {
  byId('state').textContent = sentence;
  byId('state').classList.toggle('wrong', isWrong);
}

async function begin() {
  const [wasm, packed] = await Promise.all([unpacked('lab-view'), unpacked('inside')]);
  const { instance } = await WebAssembly.instantiate(wasm, {});
  const ask = lab(instance.exports);
  const { opening, models } = JSON.parse(new TextDecoder().decode(packed));
  ask({ open: opening });
  const effects = $('.effect').map((element) => new Effect(element));
  let model;

  function start(index) {
    model = models[index];
    for (const effect of effects) {
      const fitted = model.effects.find(({ id, form }) => id === effect.id && form === effect.form);
      effect.on = Boolean(fitted);
      effect.sliders.forEach((slider, at) => { slider.value = fitted ? fitted.values[at] : slider.usual; });
    }
  }

  /** The effects that are on: the model's own in its order, then the others in the chain's. */
  function chosen() {
    const place = ({ id }) => { const at = model.effects.findIndex((own) => own.id === id); return at < 0 ? Infinity : at; };
    return effects.filter((effect) => effect.on).map((effect) => effect.chosen).sort((a, b) => place(a) - place(b) || 0);
  }

  function compute() {
    const from = performance.now();
    try {
      put(ask({ show: { model: model.toml, effects: chosen() } }).view);
      document.body.dataset.milliseconds = (performance.now() - from).toFixed(1);
      say(' computed here, by the tool\u2019s own code');
    } catch (error) {
      byId('error').textContent = '–';
      say(` ${error.message}; the curves are those before`, true);
    }
  }

  let waiting = false;
  function soon() {
    if (waiting) return;
    waiting = true;
    setTimeout(() => { waiting = false; compute(); });
  }

  for (const radio of $('[name=model]')) radio.addEventListener('change', () => { start(Number(radio.value)); soon(); });
  for (const effect of effects) {
    const turn = (on) => {
      // A model has an effect in one of its forms.
      if (on) for (const other of effects) if (other.id === effect.id) other.on = false;
      effect.on = on;
      soon();
    };
    effect.check.addEventListener('change', () => turn(effect.check.checked));
    effect.sliders.forEach((slider) => slider.input.addEventListener('input', () => { slider.moved(); turn(true); }));
  }

  start(Number($('[name=model]:checked')[0].value));
  const told = shown();
  compute();
  const isSame = told === shown();
  say(isSame ? ' computed again here: the tool\u2019s numbers, to the last digit' : ' this browser computes other numbers than the tool did', !isSame);
  for (const fieldset of $('.controls fieldset')) fieldset.disabled = false;
  document.body.dataset.same = isSame;
  document.body.dataset.ready = (performance.now() - began).toFixed(0);
}

begin().catch((error) => say(` the switches need a newer browser (${error.message}); what is shown is the tool\u2019s`, true));

// Plays a reader of the page, and posts what came of it to the test.
const wrong = [];
addEventListener('error', (event) => wrong.push(event.message));
addEventListener('unhandledrejection', (event) => wrong.push(String(event.reason)));
for (const level of ['error', 'warn']) console[level] = (...words) => wrong.push(words.join(' '));

const until = async (holds) => { while (!holds()) await new Promise((go) => setTimeout(go, 5)); };
const error = () => document.getElementById('error').textContent;

addEventListener('load', async () => {
  const { dataset } = document.body;
  await until(() => dataset.ready);
  const first = error();
  const steps = [];
  async function step(what, act) {
    const before = document.querySelector('.pair').innerHTML;
    delete dataset.milliseconds;
    act();
    await until(() => dataset.milliseconds);
    const isRedrawn = document.querySelector('.pair').innerHTML !== before;
    steps.push({ what, error: error(), isRedrawn, milliseconds: Number(dataset.milliseconds) });
  }
  const effect = (id) => document.querySelector(`[data-effect=${id}]`);
  const [without] = document.querySelectorAll('[name=model]');
  await step('hysteresis off', () => effect('hysteresis').querySelector('[role=switch]').click());
  await step('the model fitted without it', () => without.click());
  await step('creep by its slider', () => {
    const slider = effect('creep').querySelector('input[type=range]');
    slider.value = 900;
    slider.dispatchEvent(new Event('input', { bubbles: true }));
  });
  await step('creep off', () => effect('creep').querySelector('[role=switch]').click());
  const isUnnamed = (control) => !control.labels.length && !control.ariaLabel;
  const unnamed = [...document.querySelectorAll('input')].filter(isUnnamed).length;
  const overflows = document.documentElement.scrollWidth > innerWidth;
  const told = without.parentElement.querySelector('small').textContent;
  const said = { isSame: dataset.same, ready: Number(dataset.ready), first, told, steps, wrong, unnamed, overflows };
  await fetch('/said', { method: 'POST', body: JSON.stringify(said) });
});

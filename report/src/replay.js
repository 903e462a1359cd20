// The search over its steps: which is shown, and the player that goes through them.
import {$} from './dom.js';
import {called} from './models.js';

const icons = {
  play: '<svg viewBox="0 0 16 16" aria-hidden="true"><path d="M4 2.5v11l9.5-5.5z"/></svg>',
  pause: '<svg viewBox="0 0 16 16" aria-hidden="true"><path d="M3.5 2.5h3v11h-3zM9.5 2.5h3v11h-3z"/></svg>',
};

export class Replay {
  /** `onMoment` is called whenever another step is shown; steps.length stands for the result. */
  constructor(search, summary, onMoment) {
    Object.assign(this, {search, summary, onMoment});
    this.end = search.steps.length;
    this.now = this.end;
    this.swarms = [...new Set(search.steps.map((s) => s.swarm))];
    const time = $('time');
    time.max = String(this.end);
    time.value = time.max;
    time.addEventListener('input', () => {
      this.pause();
      this.go(Number(time.value));
    });
    $('play').addEventListener('click', () => (this.playing ? this.pause() : this.play()));
    $('to-result').addEventListener('click', () => {
      this.pause();
      this.go(this.end);
    });
    if (this.end === 0) $('replay').hidden = true;
    this.pause();
    this.tell();
  }

  go(moment) {
    this.now = Math.max(0, Math.min(this.end, moment));
    $('time').value = String(this.now);
    this.tell();
    this.onMoment(this.now);
  }

  get atEnd() {
    return this.now >= this.end;
  }

  /** Numbers of the result's models that are known by now. */
  get known() {
    return new Set(this.search.found.filter((f) => f.after <= this.now && f.model > 0).map((f) => f.model));
  }

  play() {
    this.playing = true;
    $('play').innerHTML = icons.pause;
    $('play').setAttribute('aria-label', 'Pause');
    if (this.atEnd) this.go(0);
    // Some twenty seconds for a long search, and never so fast that steps cannot be told apart.
    const stepsPerSecond = Math.min(30, Math.max(8, this.end / 20));
    let at = this.now, last = performance.now();
    const tick = (time) => {
      if (!this.playing) return;
      // A slow device takes longer rather than leaving steps out.
      at += Math.min(1, ((time - last) / 1000) * stepsPerSecond);
      last = time;
      if (Math.floor(at) !== this.now) this.go(Math.floor(at));
      if (this.atEnd) this.pause();
      else requestAnimationFrame(tick);
    };
    requestAnimationFrame(tick);
  }

  pause() {
    this.playing = false;
    $('play').innerHTML = icons.play;
    $('play').setAttribute('aria-label', 'Play the search');
  }

  tell() {
    $('to-result').disabled = this.atEnd;
    if (this.atEnd) {
      $('moment').textContent = `Result: ${this.summary}.`;
      return;
    }
    const step = this.search.steps[this.now], swarm = this.swarms.indexOf(step.swarm) + 1;
    const saved = step.nothing > 0 ? Math.max(0, (step.nothing - step.fitness) / step.nothing) : 0;
    const found = this.search.found.filter((f) => f.after <= this.now).length;
    $('moment').textContent = `Swarm ${swarm} of ${this.swarms.length} looks for a ${called(step.type)}, step ${step.step}: its best saves ${(100 * saved).toFixed(1)} % of what is left to explain. ${found} found so far.`;
  }
}

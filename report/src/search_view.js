// The two charts under the view, drawn for the replay's step.
import {FitnessChart, ParameterMap} from './charts.js';
import {$} from './dom.js';
import {across} from './hulls.js';

export class Charts {
  constructor(page, replay) {
    this.replay = replay;
    const [u, v] = across(page.about.up ?? [0, 0, 1]);
    const up = {u, v, w: page.about.up ?? [0, 0, 1]};
    this.fitness = new FitnessChart($('fitness'), page.search, (moment) => {
      replay.pause();
      replay.go(moment);
    });
    this.map = new ParameterMap($('map'), $('map-caption'), page.search, page.layout.radius, up);
    $('fitness-caption').textContent = 'What the best particle of each swarm saves of what is left to explain; a dot above for each model found. Tap to go there.';
    if (!this.map.possible) $('map-figure').hidden = true;
    new ResizeObserver(() => this.draw()).observe($('replay'));
    this.draw();
  }

  draw() {
    if (this.replay.end === 0) return;
    this.fitness.draw(this.replay.now);
    if (this.map.possible) this.map.draw(this.replay.now);
  }
}

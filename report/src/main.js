// Puts the page together.
import {Charts} from './search_view.js';
import {dark, setColours} from './colours.js';
import {load} from './data.js';
import {$} from './dom.js';
import {lay} from './layout.js';
import {counted} from './models.js';
import {residuals} from './paint.js';
import {Picture} from './picture.js';
import {Replay} from './replay.js';
import {SpaceView} from './space_view.js';
import {head, lists, reproduction, smallPrint, timing} from './tables.js';

const page = load();
setColours(page.about.colours, page.about.sticking_out);
page.layout = lay(page.cloud);

let known;
const distances = () => (known ??= residuals(page.cloud, page.result.models, page.about.centre));

head(page);
timing(page);
reproduction(page);
smallPrint(page);

let charts, picture;
const things = page.about.kind === 'perceive' ? ` and ${page.result.sois.length} ${page.result.sois.length === 1 ? 'thing' : 'things'}` : '';
const replay = new Replay(page.search, counted(page.result.models) + things, () => {
  space?.update();
  charts?.draw();
});
const showSelected = lists(page, (kind, k) => {
  const same = selected?.kind === kind && selected.k === k;
  selected = same ? undefined : {kind, k};
  showSelected(selected);
  space?.select(selected);
});
let selected, space;
try {
  space = new SpaceView(page, replay, distances, (point) => picture?.mark(point));
} catch (error) {
  $('no-webgl').hidden = false;
  $('toolbar').hidden = true;
  console.warn(error.message);
}
charts = new Charts(page, replay);
if (page.image) picture = new Picture(page, distances, (i) => space?.describe(i) ?? [], (i) => space?.highlight(i));
dark.addEventListener('change', () => {
  space?.update();
  charts.draw();
  picture?.draw();
});
document.documentElement.dataset.ready = 'yes';

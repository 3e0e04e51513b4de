/** The desk: connects address, survey, map and panel. */

import { ActionsPanel } from './actions.js';
import { get, surveyPath } from './api.js';
import { button, debounce, el } from './dom.js';
import { station, time } from './format.js';
import { downloadsPanel } from './downloads.js';
import { DrawPanel } from './draw.js';
import { notesPanel, showLimits } from './limits.js';
import { heldStretches, removeOthers } from './held.js';
import { Lining } from './lining.js';
import { Network } from './network.js';
import { Panel } from './panel.js';
import { RatingPanel } from './rating.js';
import { Review } from './review.js';
import { Ribbon } from './ribbon.js';
import { findingOf, Outbox, textOf } from './outbox.js';
import { OutboxBox } from './outbox_box.js';
import { format, parse, replace } from './router.js';
import { SectionPanel } from './section.js';
import { Session } from './session.js';
import { signOut } from './sign_out.js';
import { showSurveys } from './surveys.js';
import { Space } from './space.js';
import { fillToolbar } from './toolbar.js';
import { tunnelMap } from './tunnels.js';

const meta = (name) => document.querySelector(`meta[name=${name}]`)?.content ?? '';
const node = (id) => document.getElementById(id);
const user = meta('user');
const canWrite = ['inspector', 'operator'].includes(meta('role'));

const app = { surveys: [], survey: null, summary: null, finding: null, element: null, routing: false, turn: 0, hash: '' };

function say(text, wrong = false) {
  const state = node('state');
  state.className = wrong ? 'state wrong' : 'state';
  state.textContent = text;
  clearTimeout(say.timer);
  if (!wrong) say.timer = setTimeout(() => { state.textContent = ''; }, 8000);
}

/** State what becomes of a record: saved only when the server has said so. */
function showState({ state, record, text }) {
  if (state === 'saving') say('Saving …');
  else if (state === 'failed') say(`Not saved. ${text}`, true);
  else if (state === 'waiting') say(`Recorded on this device. ${textOf(record)}.`);
  else say(`Saved. ${textOf(record)}.`);
}

/** Show what the database does not have yet, on the lining and in its list. */
function showRecords() {
  outboxBox.refresh();
  review.photos.refresh();
  const own = outbox.records.filter(({ survey, stopped }) => survey === app.survey?.name && !stopped);
  const waits = new Map();
  for (const { type, finding, values } of own) if (type === 'review') waits.set(finding, { ...waits.get(finding), ...values });
  lining.showRecorded(waits, own.filter(({ type }) => type === 'draw').map((record) => ({ id: findingOf(record), geometry: record.body.geometry })));
}

/** Show what the server wrote of a record that had waited. */
function sent(record, answer) {
  const id = record.type === 'draw' ? answer.id : record.finding;
  review.renew(findingOf(record), id);
  app.renew = [...(app.renew ?? []), id];
  renewHeld();
  changed();
}

/** Renew what is held offline of findings that were changed, once writes pause. */
const renewHeld = debounce(async () => {
  const ids = app.renew;
  app.renew = [];
  if ((await heldStretches(user)).length) (await import('./offline.js')).renewFindings(user, ids).catch((error) => say(error.message, true));
}, 3000);

const outbox = new Outbox(user, { changed: () => showRecords(), state: showState, sent });
const outboxBox = new OutboxBox(node('alerts'), outbox);
const session = new Session(user, outbox);
const panel = new Panel(node('panel'), (tab) => showTab(tab));
const ribbon = new Ribbon(node('ribbon'), (x) => (space.open ? space.go(x) : lining.goTo(x)));
const lining = new Lining(node('lining'), { moved, picked, failed: (text) => say(text, true) });
const review = new Review(session, {
  canWrite, say, outbox,
  extent: stretch,
  shown: (finding, fit) => show(finding, fit),
  marked: (finding) => mark(finding),
  changed: () => changed(),
  actions: (wanted) => openActions(wanted),
  outlined: () => lining.shown.findings,
  outlines: (on) => {
    lining.shown.findings = on;
    space.restyle();
    const box = node('show-findings');
    if (box) box.checked = on;
    lining.restyle();
    say(on ? 'Outlines on.' : 'Outlines off.');
  },
});
const space = new Space(node('space'), { picked, closed, shown: () => lining.shown });
const network = new Network(meta('held') || null, { away: showNetwork, back: reconnected });
const section = new SectionPanel(() => lining.view.x, () => session.facts);
const rating = new RatingPanel({
  shown: (found) => {
    ribbon.setRating(found);
    showElements();
  },
  on: () => showElements(),
  go: (element) => {
    if (space.open) {
      space.go((element.chainage_from + element.chainage_to) / 2);
      return;
    }
    lining.showElement(element);
    app.element = element;
  },
});
const actions = new ActionsPanel({ canWrite, say, current: () => session.facts, changed: (found) => review.takeActions(found) });
const draw = new DrawPanel(lining, {
  canWrite, say, outbox,
  current: () => session.facts,
  open: (id) => review.open(id, false),
  changed: () => changed(0),
  closed: () => {
    session.facts = null;
    app.finding = null;
    lining.mark(null);
    review.refresh();
    address();
  },
});

/** Return the stretch in view, within the survey. */
function stretch() {
  const [from, , to] = lining.extent;
  const { survey } = app;
  return [Math.min(Math.max(from, survey.from), survey.to), Math.min(Math.max(to, survey.from), survey.to)];
}

function moved(view, [from, , to]) {
  ribbon.mark(from, to);
  app.view = view;
  address();
}

const address = debounce(() => {
  // While the page follows an address, or is about to, it does not write one.
  if (!app.survey || app.routing || location.hash !== app.hash) return;
  replace({ survey: app.survey.name, finding: app.finding > 0 ? app.finding : null, ...app.view, kind: lining.kind, tab: panel.tab === 'finding' ? null : panel.tab });
  app.hash = location.hash;
}, 200);

/** Show the lining in 3D, in place of the unrolled one. */
function openSpace() {
  draw.cancel();
  node('lining').hidden = true;
  space.show(lining.view.x);
}

function closed(chainage) {
  node('lining').hidden = false;
  lining.map.updateSize();
  if (chainage !== null) lining.goTo(chainage);
}

function picked(id) {
  if (draw.pick(id)) return;
  if (!['finding', 'review'].includes(panel.tab)) panel.choose('finding');
  panel.fold(false);
  review.open(id, false);
}

function show(finding, fit) {
  if (!finding) return;
  if (finding.survey !== app.survey.name) {
    location.hash = format({ survey: finding.survey, finding: finding.id });
    return;
  }
  mark(finding);
  if (fit) follow(finding, app.turn);
  address();
}

function mark(finding) {
  app.finding = finding.id;
  lining.mark(finding);
  space.mark(finding);
  draw.refresh();
}

// Drawing the map takes longer than a verdict: it follows when the reviewer pauses.
const follow = debounce((finding, turn) => {
  if (turn !== app.turn) return; // The address leads elsewhere by now.
  if (space.open) space.follow(finding);
  else lining.fitFinding(finding);
}, 250);

const reread = debounce(async () => {
  lining.refresh();
  space.refresh();
  await readRibbon(app.survey);
}, 1500);

/** Read findings and ribbon again after a write, once writes pause. */
function changed(wait = null) {
  if (wait === 0) lining.refresh();
  else reread();
}

/** Show the results of elements on the lining while the rating is open. */
function showElements() {
  const open = panel.tab === 'rating';
  lining.showRating(open && rating.coloured ? rating.rating : null);
  if (open || !app.element) return;
  app.element = null;
  lining.mark(session.facts);
}

/** Show an action, or the form of a new one for the finding that is shown. */
function openActions(wanted) {
  panel.choose('actions', true);
  showTab('actions', wanted);
}

function showTab(tab, wanted = {}) {
  review.setReviewing(tab === 'review');
  if (tab !== 'draw') draw.cancel();
  else if (space.open) space.close();
  const content = {
    finding: () => review.root, review: () => review.root, draw: () => draw.root, section: () => section.root, rating: () => rating.root, actions: () => actions.root,
    offline: () => offlineRoot, downloads: () => downloadsPanel(app.survey, stretch, meta('role') === 'operator'), notes: () => notesPanel(app.summary),
  }[tab]();
  panel.fill(content);
  if (tab === 'section') section.open();
  if (tab === 'rating') rating.open();
  if (tab === 'actions') actions.open(wanted);
  showElements();
  if (tab === 'draw') draw.refresh();
  if (tab === 'offline') openOffline();
  address();
  lining.map.updateSize();
}

const offlineRoot = el('div', {});

/** Show what can be taken offline; the module comes when it is first needed. */
async function openOffline() {
  try {
    const { OfflinePanel } = await import('./offline.js');
    app.offline ??= new OfflinePanel(user, { extent: stretch, kind: () => lining.kind, changed: showNetwork });
    offlineRoot.replaceChildren(app.offline.root);
    app.offline.open(app.survey);
  } catch {
    offlineRoot.replaceChildren(el('p', { class: 'pad warn-text', text: 'The server cannot be reached, and this part of the page was not taken offline.' }));
  }
}

/** State whether the page shows the database, or what was taken offline, and from when that is. */
async function showNetwork() {
  const box = node('network');
  box.hidden = !network.away;
  if (!network.away) return;
  const held = await heldStretches(user);
  const places = held.map(({ survey, from, to }) => `${survey}, ${station(from)} to ${station(to)}`).join('; ');
  const since = network.since ?? (held.length ? new Date(Math.min(...held.map(({ at }) => at))).toISOString() : null);
  box.textContent = `Offline: as of ${time(since)}. ${places ? `Held on this device: ${places}. Elsewhere: not taken offline.` : 'Nothing is held on this device.'}`;
}

/** Read again what the page shows, after the network was away. */
function reconnected() {
  showNetwork();
  say('The server can be reached again.');
  if (!app.survey) {
    route();
    return;
  }
  outbox.send();
  lining.refresh();
  readRibbon(app.survey);
  readSummary(app.survey);
  if (app.finding !== null) review.open(app.finding, false);
}

/** Read what was not inspected; it takes longer than the picture of a long survey. */
async function readSummary(survey) {
  try {
    const summary = await get(surveyPath(survey.name, '/summary'));
    if (survey !== app.survey) return;
    app.summary = summary;
    showLimits(node('limits'), summary);
    if (panel.tab === 'notes') showTab('notes');
  } catch (error) {
    if (survey === app.survey && !app.summary) showLimits(node('limits'), null, error.message);
  }
}

async function readRibbon(survey) {
  try {
    const data = await get(surveyPath(survey.name, '/ribbon'));
    if (survey !== app.survey) return;
    ribbon.show(data, survey);
    lining.setRibbon(data);
  } catch (error) {
    if (!error.away) say(`Overview: ${error.message}`, true);
  }
}

async function openSurvey(name, state, latest) {
  const survey = await get(surveyPath(name));
  if (!latest()) return;
  app.survey = survey;
  app.finding = null;
  node('surveys').hidden = true;
  node('desk').hidden = false;
  document.title = `${survey.name} – tunneldb desk`;
  node('desk-title').textContent = survey.name;
  node('survey-facts').textContent = [survey.tunnel, survey.date, `${station(survey.from, 0)} to ${station(survey.to, 0)}`].filter(Boolean).join(' · ');
  node('survey-choice').value = name;
  ribbon.show(null, survey);
  const tab = state.finding === null ? state.tab ?? panel.tab ?? 'finding' : 'finding';
  // On a narrow screen an empty panel would cover the lining.
  const empty = state.finding === null && tab === 'finding' && matchMedia('(max-width: 820px)').matches;
  panel.fold(empty);
  lining.map.updateSize();
  lining.mark(null);
  lining.setSurvey(survey, state.kind, state.x !== null && state.y !== null && state.z !== null ? state : null);
  fillToolbar(lining, (text) => say(text, true));
  lining.tools.append(button('3D', openSpace));
  review.setSurvey(survey);
  section.setSurvey(survey);
  rating.setSurvey(survey);
  actions.setSurvey(survey);
  space.setSurvey(survey);
  draw.setSurvey(survey);
  showRecords();
  panel.choose(tab);
  panel.fold(empty);
  app.summary = null;
  showLimits(node('limits'), null);
  lining.drawn.then(() => {
    readRibbon(survey);
    readSummary(survey);
  });
}

async function showTable(latest) {
  app.survey = null;
  app.surveys = await get('/api/surveys');
  if (!latest()) return;
  fillChoice();
  node('desk').hidden = true;
  node('surveys').hidden = false;
  node('survey-facts').textContent = '';
  node('survey-choice').value = '';
  document.title = 'tunneldb desk';
  const filter = showSurveys(node('surveys'), app.surveys, tunnelMap((name) => filter(name)));
}

/** Read the list of surveys beside the survey that is shown. */
async function readChoice() {
  try {
    app.surveys = await get('/api/surveys');
    fillChoice();
    node('survey-choice').value = app.survey?.name ?? '';
  } catch (error) {
    say(`List of surveys: ${error.message}`, true);
  }
}

function fillChoice() {
  const options = app.surveys.map(({ name, tunnel }) => el('option', { value: name, text: name === tunnel ? name : `${name} (${tunnel})` }));
  node('survey-choice').replaceChildren(el('option', { value: '', text: 'All surveys' }), ...options);
}

/** Show what the address says; an answer that comes after the next change of the address is dropped. */
async function route() {
  app.hash = location.hash;
  const state = parse();
  const turn = (app.turn += 1);
  const latest = () => turn === app.turn;
  app.routing = true;
  try {
    if (!state.survey) {
      await showTable(latest);
      return;
    }
    if (!app.surveys.length) readChoice();
    const other = app.survey?.name !== state.survey;
    if (other) await openSurvey(state.survey, state, latest);
    if (!latest()) return;
    if (state.finding !== null && state.finding !== app.finding) {
      if (!['finding', 'review'].includes(panel.tab)) panel.choose('finding');
      panel.fold(false);
      await review.open(state.finding, !other || state.x === null);
    } else if (!other && state.x !== null && state.y !== null && state.z !== null) {
      lining.goTo(state.x, state.y, state.z);
    }
  } catch (error) {
    say(error.message, true);
  } finally {
    if (latest()) {
      app.routing = false;
      address();
    }
  }
}

node('survey-choice').addEventListener('change', (event) => { location.hash = format({ survey: event.target.value || null }); });
node('skip').addEventListener('click', (event) => {
  event.preventDefault();
  node('map')?.focus();
});
node('sign-out').addEventListener('click', async () => {
  try {
    await signOut(outbox);
  } catch (error) {
    say(`Not signed out. ${error.message}`, true);
  }
});
window.addEventListener('hashchange', route);

/** Begin, once nothing of another user is left on the device. */
async function begin() {
  await removeOthers(user);
  showNetwork();
  route();
  if (!network.away && (await heldStretches(user)).length) import('./offline.js').then(({ renewShell }) => renewShell(user)).catch((error) => say(`Copy of the page: ${error.message}`, true));
}
begin();

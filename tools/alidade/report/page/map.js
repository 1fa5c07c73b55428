// SPDX-License-Identifier: Apache-2.0
// Map: trajectories and landmarks at the time of the slider.

/** One view of the map. `first`: another view whose options this view shares. */
class MapView {
  constructor(mode, first) {
    this.load();
    const path = samplePath(this.truth || this.tracks[0]);
    const places = this.maps.slice(0, 1).flatMap(landmarkPlaces);
    const plane = fitPlane(path, places);
    this.planeName = plane.name;
    this.view = new Projection(path.concat(places), plane.basis);
    this.view.look(mode);
    this.options = first ? first.options : {paintBy: this.defaultColour(), ellipses: true};
    const name = mode === 'top' ? 'top view of trajectory and landmarks' : 'oblique view';
    this.spec = {label: '', name, height: 470, y: {}};
    this.addElements();
    followMap(this);
  }

  /** Reads the data. */
  load() {
    this.tracks = mapTracks();
    this.truth = mapTruth(this.tracks[0]);
    this.maps = this.tracks
      .filter(({e}) => e.landmarks)
      .map(({e}) => ({name: e.name, ...mapColumns(e)}));
    this.dirty = true;
  }

  defaultColour() {
    if (this.tracks.length > 1) return 'estimator';
    return this.truth ? 'error' : this.tracks[0].sigma.length ? 'sigma' : 'time';
  }

  addElements() {
    this.base = element('canvas', {class: 'base', 'aria-hidden': 'true'});
    this.over = element('canvas', {
      class: 'over',
      tabindex: 0,
      role: 'img',
      'aria-label': 'Map. Arrow keys turn or move it, plus and minus zoom, 0 fits it.',
    });
    const height = Math.min(470, Math.max(330, innerWidth * 0.8));
    const props = {class: 'plot map', style: `height:${height}px`};
    this.el = element('div', props, this.base, this.over);
    this.el.plot = this;
    plots.add(this);
    observer.observe(this.el);
    resizer.observe(this.el);
  }

  /** The time of the map: that of the cursor, of a kept cursor, or the end. */
  time() {
    return HAS_TIMES ? (page.cursor ?? page.time ?? page.full[1]) : Infinity;
  }

  /** The quantity that colours a trajectory, in row i. */
  valueAt(track, i) {
    const {paintBy} = this.options;
    if (paintBy === 'time') return track.t[i];
    const columns = track[paintBy];
    return columns.length ? Math.hypot(...columns.map((column) => column[i])) : NaN;
  }

  /** The range of the colours; null if the trajectories have the colours of their estimators. */
  colourRange(tracks) {
    if (this.options.paintBy === 'estimator') return null;
    const values = tracks.flatMap((track) => {
      const step = Math.max(1, Math.floor(track.t.length / 500));
      const rows = Array.from({length: Math.ceil(track.t.length / step)}, (_, i) => i * step);
      return rows.map((i) => this.valueAt(track, i));
    });
    const range = quantiles(values, [0.02, 0.98]);
    return range[1] > range[0] ? range : [0, range[1] || 1];
  }

  draw() {
    Plot.prototype.draw.call(this);
  }

  paint(surface, width, height) {
    const {view} = this;
    this.f = {l: 0, r: width, t: 0, b: height};
    view.resize(width, height, this.truth ? 0 : 0.005);
    const time = this.time();
    const tracks = this.tracks.filter(({name}) => shown(name));
    const range = this.colourRange(tracks);
    this.spots = [];
    if (view.mode !== 'side') paintFloor(surface, view, (p) => view.project(p));
    for (const map of this.maps.filter(({name}) => shown(name)))
      paintLandmarks(surface, view, map, time, this.options, this.spots);
    if (this.truth) {
      const points = pathBetween(view, this.truth, 0, this.truth.t.length - 1);
      const style = {stroke: colours.ink, width: 1.3, dash: [5, 3], alpha: 0.75};
      surface.path(points, style);
    }
    for (const track of tracks) this.paintTrack(surface, track, time, range);
    paintScaleBar(surface, view);
    paintWorldAxes(surface, view);
    if (range) paintRamp(surface, view, this.options.paintBy, range);
    if (this.onTime && !(surface instanceof SvgSurface)) this.onTime(time);
  }

  paintTrack(surface, track, time, range) {
    if (!track.t.length) return;
    const {view} = this;
    const color = colorOf(track.name);
    const alpha = dim(track.name);
    const end = nearest(track.t, time);
    const last = track.t.length - 1;
    const placeAt = (i) => view.project(positionAt(track, i));
    const outlineAt = (i) => view.ellipse(placeAt(i), positionCovariance(track, i));
    const hasSigma = track.sigma.length > 0;
    for (let j = 0; hasSigma && this.options.ellipses && j <= 24; j++) {
      const i = Math.round((j * last) / 24);
      if (i <= end) surface.path(outlineAt(i), {stroke: color, width: 0.8, alpha: 0.45 * alpha});
    }
    if (end < last) {
      const style = {stroke: color, width: 1, alpha: 0.25 * alpha};
      surface.path(pathBetween(view, track, end, last), style);
    }
    const style = {stroke: color, width: 2.2, dash: dashOf(track.name), alpha};
    if (!HAS_TIMES) paintPlaces(surface, view, track);
    else if (!range) surface.path(pathBetween(view, track, 0, end), style);
    else
      paintColouredPath(surface, view, track, end, (q, i) => this.valueAt(q, i), range);
    if (!HAS_TIMES) return;
    const start = {stroke: color, fill: colours.panel, width: 2, alpha};
    surface.marks(placeAt(0), 'dot', 4, start);
    const map = this.maps.find(({name}) => name === track.name);
    const place = placeAt(end);
    if (map) paintRays(surface, view, track, map, track.t[end], place);
    const ellipse = {stroke: color, fill: color, alpha: 0.22 * alpha, width: 1.2};
    if (hasSigma) surface.path(outlineAt(end), ellipse);
    paintTriad(surface, view, track, end, place);
    surface.marks(place, 'square', 3.5, {fill: color, alpha});
  }

  /** Draws the map again if the time has changed. */
  paintOver() {
    if (!this.seen || this.lastTime === this.time()) return;
    this.lastTime = this.time();
    this.dirty = true;
    requestAnimationFrame(() => {
      if (this.dirty && this.seen) this.draw();
    });
  }

  /** The rows of a CSV file: the elements of the positions over time. */
  csv() {
    const rowsOf = ({name, t, p}, k) =>
      Array.from(t, (time, i) =>
        [`map ${'xyz'[k]}`, name, time + T0, p[k][i], '', HAS_TIMES ? 's' : '', 'm']
          .map((value) => csvCell(String(value)))
          .join(','),
      );
    const tracks = this.tracks.filter(({name}) => shown(name));
    return tracks.flatMap((track) => [0, 1, 2].flatMap((k) => rowsOf(track, k)));
  }
}

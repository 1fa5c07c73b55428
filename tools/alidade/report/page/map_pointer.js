// SPDX-License-Identifier: Apache-2.0
// Pointer and keys on a map: turn, move, zoom, tips of landmarks.

function landmarkTip({map, i}) {
  const error = Math.hypot(map.x[i] - map.tx[i], map.y[i] - map.ty[i], map.z[i] - map.tz[i]);
  const sigma = Math.hypot(map.sx[i], map.sy[i], map.sz[i]);
  const isKnown = (v) => !Number.isNaN(v);
  return [
    element('b', {}, `landmark ${map.id[i]}`),
    map.name,
    isKnown(sigma) ? `: σ ${withUnit(sigma, 'm')}` : '',
    isKnown(error) ? `, error ${withUnit(error, 'm')} (${numberText(error / sigma, 2)} σ)` : '',
    element('br'),
    isKnown(map.first_s[i]) ? `seen from ${numberText(map.first_s[i] + T0, 4)} s` : '',
    isKnown(map.tried[i]) ? `, used ${map.accepted[i]} of ${map.tried[i]}` : '',
    isKnown(map.removed_s[i]) ? `, removed ${numberText(map.removed_s[i] + T0, 4)} s` : '',
  ];
}

/** The landmark within 10 pixels of the pointer, or undefined. */
function landmarkBelow({over, spots}, event) {
  const box = over.getBoundingClientRect();
  const distance = ({place}) =>
    Math.hypot(place[0] - event.clientX + box.left, place[1] - event.clientY + box.top);
  const near = (spots || []).filter((spot) => distance(spot) < 10);
  return near.sort((a, b) => distance(a) - distance(b))[0];
}

/** A drag turns the oblique view. With shift, and in other views, it moves the map. */
function followMapDrag(map) {
  const {over, view} = map;
  let last = null;
  over.addEventListener('pointerdown', (event) => {
    last = [event.clientX, event.clientY];
    map.isActive = true;
    over.setPointerCapture(event.pointerId);
  });
  over.addEventListener('pointerup', () => {
    last = null;
  });
  over.addEventListener('pointerleave', () => {
    hideTip();
    if (!last) map.isActive = false;
  });
  over.addEventListener('pointermove', (event) => {
    if (!last) {
      const spot = landmarkBelow(map, event);
      if (spot) showTip(event, landmarkTip(spot));
      else hideTip();
      return;
    }
    const [dx, dy] = [event.clientX - last[0], event.clientY - last[1]];
    last = [event.clientX, event.clientY];
    if (view.mode !== '3d' || event.shiftKey || event.buttons === 2) view.move(dx, dy);
    else view.turn(-dx * 0.008, -dy * 0.008);
    redraw();
    hideTip();
  });
}

const MAP_ARROWS = {
  ArrowLeft: [-1, 0],
  ArrowRight: [1, 0],
  ArrowUp: [0, -1],
  ArrowDown: [0, 1],
};

function mapKey(view, event) {
  const arrow = MAP_ARROWS[event.key];
  if (arrow && view.mode === '3d') view.turn(arrow[0] * 0.1, arrow[1] * 0.1);
  else if (arrow) view.move(-arrow[0] * 30, -arrow[1] * 30);
  else if (event.key === '+') view.scale *= 1.2;
  else if (event.key === '-') view.scale /= 1.2;
  else if (event.key === '0') view.scale = 0;
  else return;
  event.preventDefault();
  redraw();
}

function followMap(map) {
  const {over, view} = map;
  followMapDrag(map);
  const onwheel = (event) => {
    if (!map.isActive && !event.ctrlKey) return;
    event.preventDefault();
    view.scale *= Math.exp(-event.deltaY * 0.0015);
    redraw();
  };
  over.addEventListener('wheel', onwheel, {passive: false});
  over.addEventListener('contextmenu', (event) => event.preventDefault());
  over.addEventListener('keydown', (event) => mapKey(view, event));
}

// SPDX-License-Identifier: Apache-2.0
// Drawing of a model: streams, sensors, blocks and motion models, from left to right.

const BOX = {width: 230, gap: 58, line: 16, pad: 8, between: 14, top: 30};

/** Dashes of an effect on a block. */
const EFFECT_DASHES = {corrects: '', moves: '', considers: '6 4', knows: '2 3'};

/** A text that fits into a box; its tip is the whole text. */
function fittedText(text, props) {
  const most = 34;
  const shown = text.length > most ? text.slice(0, most - 1) + '…' : text;
  return element('text', props, element('title', {}, text), shown);
}

/** Places boxes in a column: adds x, y and height to each. Returns the height of the column. */
function placeColumn(boxes, column) {
  let y = BOX.top;
  for (const box of boxes) {
    box.x = 1 + column * (BOX.width + BOX.gap);
    box.y = y;
    box.height = 2 * BOX.pad + BOX.line * box.lines.length;
    y += box.height + BOX.between;
  }
  return y;
}

function drawnBox({x, y, height, lines, dashes}) {
  const frame = {x, y, width: BOX.width, height, rx: 7, class: 'box', 'stroke-dasharray': dashes};
  const texts = lines.map((line, i) => {
    const baseline = y + BOX.pad + BOX.line * (i + 0.75);
    return fittedText(line, {x: x + 10, y: baseline, class: i ? 'detail' : 'name'});
  });
  return [element('rect', frame), texts];
}

/** A line from the right side of a box to the left side of another. */
function drawnLink(from, to, effect) {
  const [x1, y1] = [from.x + BOX.width, from.y + from.height / 2];
  const [x2, y2] = [to.x, to.y + to.height / 2];
  const middle = (x1 + x2) / 2;
  const d = `M${x1} ${y1}C${middle} ${y1} ${middle} ${y2} ${x2} ${y2}`;
  return element('path', {d, class: 'link', 'stroke-dasharray': EFFECT_DASHES[effect] || ''});
}

const statusText = ({status, unit}) => [status, unit && `[${unit}]`].filter(Boolean).join(' ');

/** The boxes of each column. `item` is the object that a box represents. */
function boxesOf(problem, streams) {
  const used = new Set(problem.sensors.map(({stream}) => stream));
  for (const {input} of problem.motions) used.add(input);
  return [
    streams
      .filter(({name}) => used.has(name))
      .map((item) => ({item, lines: [item.name, plural(item.size, 'number')]})),
    problem.sensors.map((item) => ({item, lines: [item.name, item.model, `σ ${item.noise}`]})),
    problem.blocks.map((item) => ({
      item,
      lines: [item.name, statusText(item), item.prior && item.prior.replace('+-', '±')].filter(
        Boolean,
      ),
      dashes: item.status === 'constant' ? '2 3' : '',
    })),
    problem.motions.map((item) => {
      const input = item.input ? [`input ${item.input}`] : [];
      const noise = item.noise.map((text) => 'σ ' + text.replace(item.name + '.', ''));
      return {item, lines: [item.name, item.model, ...input, ...noise]};
    }),
  ];
}

function modelDrawing(problem, streams) {
  const columns = boxesOf(problem, streams);
  const heights = columns.map(placeColumn);
  const height = Math.max(...heights);
  columns.forEach((boxes, i) => {
    for (const box of boxes) box.y += (height - heights[i]) / 2;
  });
  const [streamBoxes, sensorBoxes, blockBoxes, motionBoxes] = columns;
  const boxOf = (boxes, name) => boxes.find(({item}) => item.name === name);
  const links = sensorBoxes.flatMap((box) => {
    const stream = boxOf(streamBoxes, box.item.stream);
    const effects = box.item.effects.map(([block, effect]) =>
      drawnLink(box, boxOf(blockBoxes, block), effect),
    );
    return [stream && drawnLink(stream, box), effects];
  });
  for (const box of motionBoxes)
    for (const [block, effect] of box.item.effects)
      links.push(drawnLink(boxOf(blockBoxes, block), box, effect));
  const titles = ['streams', 'sensors', 'blocks', 'motion models'].map((title, i) =>
    element('text', {x: 1 + i * (BOX.width + BOX.gap), y: 14, class: 'detail'}, title),
  );
  const width = 4 * BOX.width + 3 * BOX.gap + 2;
  const label = 'streams, sensors, blocks and motion models';
  const props = {class: 'drawing', width, height, role: 'img', 'aria-label': label};
  return element('svg', props, titles, links, columns.flat().map(drawnBox));
}

// SPDX-License-Identifier: Apache-2.0
// Tip: the readout beside the pointer.

const tip = element('div', {class: 'tip', hidden: true});

function showTip(e, ...content) {
  setContent(tip, content);
  tip.hidden = false;
  const w = tip.offsetWidth;
  const hh = tip.offsetHeight;
  tip.style.left =
    (e.clientX + 16 + w > innerWidth ? Math.max(4, e.clientX - w - 14) : e.clientX + 16) + 'px';
  tip.style.top = clamp(e.clientY - hh / 2, 4, innerHeight - hh - 4) + 'px';
}

const hideTip = () => {
  tip.hidden = true;
};

// SPDX-License-Identifier: MIT
// Gestures on the charts that change their common time range.
// Mouse: drag zooms in, upward or downward the values of a chart; Shift-drag moves, Ctrl-wheel zooms, double-click returns to now.
// Touch: drag moves, two fingers zoom.
import { el } from "./dom.js";

const kMinMove_px = 6;

/**
 * `timeAt(clientX)` returns seconds; `view`: {range(): [from, to], zoom(from, to), live(), touch(time), values(plot, heights_px)}. Returns a function that removes
 * the listeners of the window.
 */
export function listenToGestures(parent, timeAt, view) {
  const selection = el("div", { class: "selection", hidden: true });
  parent.append(selection);
  const pointers = new Map();
  let drag = null;

  const x = (event) => event.clientX - parent.getBoundingClientRect().left;
  const begin = (event) => {
    if (event.button !== 0 || event.target.closest("button, select")) return;
    pointers.set(event.pointerId, event.clientX);
    const range = view.range();
    drag = { range, pans: event.pointerType !== "mouse" || event.shiftKey, from_px: x(event), clientX: event.clientX, clientY: event.clientY,
      plot: event.pointerType === "mouse" && event.target.closest(".plot"), moved: false, times: [...pointers.values()].map(timeAt) };
    if (event.pointerType === "mouse") event.preventDefault(); // prevents selection of text
  };
  const pan = (event) => {
    const perPixel = timeAt(1) - timeAt(0), shift_s = (drag.clientX - event.clientX) * perPixel;
    view.zoom(drag.range[0] + shift_s, drag.range[1] + shift_s);
  };
  /** Each finger stays at the time at which it touched the chart. */
  const pinch = () => {
    const [a, b] = [...pointers.values()], [ta, tb] = drag.times;
    if (Math.abs(a - b) < kMinMove_px) return;
    const perPixel = (tb - ta) / (b - a), [from, to] = view.range(), now = (to - from) / ((timeAt(1) - timeAt(0)) || 1);
    if (!(perPixel > 0)) return;
    const left = a - (timeAt(a) - from) / (timeAt(1) - timeAt(0));
    view.zoom(ta - (a - left) * perPixel, ta - (a - left) * perPixel + now * perPixel);
  };
  const move = (event) => {
    if (!drag || !pointers.has(event.pointerId)) return;
    pointers.set(event.pointerId, event.clientX);
    const [dx, dy] = [Math.abs(event.clientX - drag.clientX), Math.abs(event.clientY - drag.clientY)];
    if (!drag.moved && dy > dx && dy > kMinMove_px && drag.plot && !drag.pans) drag.isVertical = drag.moved = true;
    if (dx > kMinMove_px) drag.moved = true;
    if (pointers.size === 2) return pinch();
    if (!drag.moved) return;
    if (drag.pans) return pan(event);
    const to_px = x(event);
    selection.hidden = false;
    const top = parent.getBoundingClientRect().top, { isVertical, clientY } = drag;
    Object.assign(selection.style, isVertical ? { left: 0, width: "100%", top: `${Math.min(clientY, event.clientY) - top}px`, height: `${dy}px` }
      : { left: `${Math.min(drag.from_px, to_px)}px`, width: `${Math.abs(to_px - drag.from_px)}px`, top: "", height: "" });
  };
  const end = (event) => {
    const wasDown = pointers.delete(event.pointerId);
    selection.hidden = true;
    if (!drag || !wasDown) return;
    const ended = drag;
    drag = null;
    if (event.type === "pointercancel") return;
    if (!ended.moved) { if (ended.pans) view.touch(timeAt(event.clientX)); return; }
    if (ended.pans) return;
    if (ended.isVertical) {
      const top = ended.plot.getBoundingClientRect().top;
      return view.values(ended.plot, [ended.clientY - top, event.clientY - top]);
    }
    const times = [timeAt(ended.clientX), timeAt(event.clientX)].sort((a, b) => a - b);
    view.zoom(times[0], times[1]);
  };
  const wheel = (event) => {
    const [from, to] = view.range(), at = timeAt(event.clientX);
    if (event.ctrlKey) {
      const factor = Math.exp(Math.max(-60, Math.min(60, event.deltaY)) / 120);
      view.zoom(at - (at - from) * factor, at + (to - at) * factor);
    } else if (event.shiftKey || Math.abs(event.deltaX) > Math.abs(event.deltaY)) {
      const shift_s = ((event.deltaX || event.deltaY) / 800) * (to - from);
      view.zoom(from + shift_s, to + shift_s);
    } else return;
    event.preventDefault();
  };
  parent.addEventListener("pointerdown", begin);
  addEventListener("pointermove", move);
  addEventListener("pointerup", end);
  addEventListener("pointercancel", end);
  parent.addEventListener("wheel", wheel, { passive: false });
  parent.addEventListener("dblclick", () => view.live());
  return () => {
    removeEventListener("pointermove", move);
    removeEventListener("pointerup", end);
    removeEventListener("pointercancel", end);
  };
}

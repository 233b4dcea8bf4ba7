// SPDX-License-Identifier: MIT
// Draws the band between minimum and maximum as one area per contiguous block. The band of dygraphs has four corners for each pair of
// points, which took half of a chart's time.

/* global Dygraph */
function drawBand({ drawingContext: context, points, color, dygraph, plotArea }) {
  context.save();
  context.globalAlpha = dygraph.getNumericOption("fillAlpha");
  context.fillStyle = color;
  for (let begin = 0; begin < points.length; ) {
    if (!Number.isFinite(points[begin].yval)) { begin++; continue; }
    let end = begin, wide = false;
    for (; end < points.length && Number.isFinite(points[end].yval); end++) wide ||= points[end].y_top !== points[end].y_bottom;
    if (wide) fillBlock(context, points, begin, end, plotArea);
    begin = end;
  }
  context.restore();
}

function fillBlock(context, points, begin, end, area) {
  context.beginPath();
  for (let i = begin; i < end; i++) context.lineTo(points[i].canvasx, area.y + area.h * points[i].y_top);
  for (let i = end - 1; i >= begin; i--) context.lineTo(points[i].canvasx, area.y + area.h * points[i].y_bottom);
  context.fill();
}

export const plotters = () => [drawBand, Dygraph.Plotters.linePlotter];

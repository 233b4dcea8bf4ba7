// SPDX-License-Identifier: MIT
// Contrasts of the style sheet's colours, with the limits of WCAG 2, AA: 4.5 for text, 3 for lines.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";

const style = readFileSync(new URL("../../tools/prismweb/page/style.css", import.meta.url), "utf8");
const rule = (selector) => style.split("\n").join(" ").match(new RegExp(`(?:^|[}/,] *)${selector.replace(/[.[\]"*()]/g, "\\$&")} *\\{([^}]*)\\}`))?.[1] ?? "";
const coloursOf = (text) => Object.fromEntries([...text.matchAll(/--([a-z-]+): #([0-9a-f]{3,6});/g)].map(([, name, hex]) => [name, hex]));
const light = coloursOf(rule(":root")), themes = { light, dark: { ...light, ...coloursOf(rule(':root[data-theme="dark"]')) } };

const channels = (hex) => (hex.length === 3 ? [...hex].map((digit) => digit + digit) : hex.match(/../g)).map((two) => parseInt(two, 16) / 255);
const luminance = (rgb) => rgb.map((c) => (c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4)).reduce((sum, c, i) => sum + c * [0.2126, 0.7152, 0.0722][i], 0);
/** Contrast of a colour with this opacity on a background. */
function contrast(fore, ground, opacity = 1) {
  const back = channels(ground), seen = channels(fore).map((c, i) => c * opacity + back[i] * (1 - opacity));
  const [a, b] = [luminance(seen), luminance(back)].sort((x, y) => y - x);
  return (a + 0.05) / (b + 0.05);
}
const opacityOf = (selector) => Number(rule(selector).match(/opacity: *([.0-9]+)/)?.[1] ?? 1);

test("all texts have enough contrast, in the light and the dark theme", () => {
  const texts = [["ink", "paper"], ["ink", "card"], ["ink", "press"], ["ink", "bad-paper"], ["faint", "paper"], ["faint", "card"], ["faint", "bad-paper"], ["good", "card"],
    ["care", "card"], ["care", "paper"], ["bad", "card"], ["bad", "bad-paper"], ["bad", "paper"], ["good", "paper"]];
  const poor = Object.entries(themes).flatMap(([theme, of]) => texts.filter(([fore, ground]) => contrast(of[fore], of[ground]) < 4.5)
    .map(([fore, ground]) => `${theme}: ${fore} on ${ground} ${contrast(of[fore], of[ground]).toFixed(2)}`));
  assert.deepEqual(poor, []);
  assert.ok(contrast("fff", light.bad) >= 4.5 && contrast(themes.dark.ink ? "14191e" : "", themes.dark.bad) >= 4.5, "the alarm");
});

test("all lines have enough contrast, also when dimmed as stale or loading; the numbers of the scales are never dimmed", () => {
  const opacity = Math.min(opacityOf(".old .plot canvas"), opacityOf('.strips[aria-busy="true"] .plot canvas'));
  const lines = ["raw", "corrected", "bias", "temperature", "slope", "uhfo", "samples", "mark", "bad", "second", "third", "fourth"];
  const poor = Object.entries(themes).flatMap(([theme, of]) => lines.filter((name) => contrast(of[name], of.card, opacity) < 3)
    .map((name) => `${theme}: ${name} ${contrast(of[name], of.card, opacity).toFixed(2)}`));
  assert.deepEqual(poor, []);
  assert.deepEqual([opacityOf(".old .plot"), opacityOf('.strips[aria-busy="true"] .plot')], [1, 1]);
});

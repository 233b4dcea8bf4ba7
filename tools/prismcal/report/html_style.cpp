// SPDX-License-Identifier: MIT
#include "tools/prismcal/report/html.hpp"

namespace prism::report {

const char* const kStyle = R"css(
:root { color-scheme: light dark; --page: #fff; --ink: #1b2733; --soft: #5b6875; --line: #d9dfe6; --pale: #f4f6f8; --blue: #12385f; --warm: #c2410c; --good: #14613f; --bad: #a11212; --doubt: #8a5a00; --best: #eaf1f8; }
* { box-sizing: border-box; }
html { font: 15px/1.5 "Helvetica Neue", Helvetica, Arial, "Liberation Sans", sans-serif; color: var(--ink); }
body { max-width: 68rem; margin: 0 auto; padding: 2.5rem 1.5rem 4rem; background: var(--page); }
header { border-bottom: 3px solid var(--blue); padding-bottom: 1rem; margin-bottom: 1.5rem; }
h1 { font-size: 1.75rem; line-height: 1.2; margin: 0 0 .3rem; color: var(--blue); letter-spacing: -.01em; }
h2 { font-size: 1.25rem; margin: 2.8rem 0 .6rem; color: var(--blue); border-bottom: 1px solid var(--line); padding-bottom: .25rem; }
p { margin: .5rem 0 .8rem; max-width: 52rem; }
.subtitle { color: var(--soft); font-size: 1.05rem; margin: 0; }
.warning { margin: .7rem 0 0; padding: .4rem .7rem; border-left: 4px solid var(--warm); background: var(--pale); font-weight: 600; }
.simulated { display: inline-block; margin-top: .7rem; padding: .15rem .6rem; border: 1.5px solid var(--warm); color: var(--warm);
  font-weight: 600; letter-spacing: .04em; font-size: .85rem; border-radius: 3px; }
nav { columns: 2; font-size: .92rem; margin: 1rem 0 0; } nav a { color: var(--blue); text-decoration: none; display: block; padding: .08rem 0; }
.facts { width: 100%; border-collapse: collapse; font-size: .9rem; margin: 0 0 1rem; }
.facts th { text-align: left; font-weight: 600; color: var(--soft); white-space: nowrap; padding: .2rem 1.2rem .2rem 0; vertical-align: top; width: 1%; }
.facts td { padding: .2rem 0; overflow-wrap: anywhere; }
figure { max-width: 62rem; margin: 1.6rem 0 2.2rem; break-inside: avoid; }
figure svg { display: block; width: 100%; height: auto; }
figure svg text { font-family: inherit !important; }
figcaption, caption { font-size: .9rem; color: var(--ink); text-align: left; }
figcaption { margin-top: .4rem; max-width: 52rem; } caption { margin-bottom: .4rem; caption-side: top; }
figcaption b, caption b { color: var(--blue); } .note { color: var(--soft); }
.wide { overflow-x: auto; margin: 1.4rem 0 2rem; break-inside: avoid; }
table.data { border-collapse: collapse; font-size: .9rem; font-variant-numeric: tabular-nums; min-width: 50%; }
table.data th { font-weight: 600; text-align: left; padding: .35rem .5rem; border-top: 2px solid var(--ink); border-bottom: 1px solid var(--ink); vertical-align: bottom; }
table.data td { padding: .26rem .5rem; border-bottom: 1px solid var(--line); white-space: nowrap; }
table.data .long { white-space: normal; }
table.data tr:last-child td { border-bottom: 2px solid var(--ink); }
table.data .number { text-align: right; } table.data .unit { display: block; font-weight: 400; color: var(--soft); font-size: .82rem; }
.meaning { font-weight: 600; } p.meaning { font-size: .9rem; margin: .4rem 0 0; } figcaption .meaning { display: block; margin-top: .2rem; }
tr.group td { font-weight: 600; background: var(--pale); }
.good { color: var(--good); font-weight: 600; } .bad { color: var(--bad); font-weight: 700; } .warn { color: var(--doubt); font-weight: 600; }
.muted { color: var(--soft); } .best { font-weight: 700; background: var(--best); }
p.warn, p.bad, p.good { border-left: 3px solid; padding-left: .8rem; font-weight: 400; }
footer { margin-top: 3rem; padding-top: .6rem; border-top: 1px solid var(--line); color: var(--soft); font-size: .85rem; }
/* On a dark screen the page is dark; a figure keeps its white paper, on which its inks were chosen. */
@media screen and (prefers-color-scheme: dark) {
  :root { --page: #14191f; --ink: #e3e8ee; --soft: #a3b0bd; --line: #33404d; --pale: #1d252e; --blue: #8fbbe8; --warm: #f59e6c; --good: #6fce9f; --bad: #ff9a94;
    --doubt: #e8b75c; --best: #22344a; }
  figure svg { background: #fff; border-radius: 4px; }
}
@media print {
  @page { size: A4; margin: 16mm 14mm; }
  html { font-size: 9.6pt; } body { max-width: none; padding: 0; } nav { display: none; }
  h2 { break-after: avoid; } .wide { overflow: visible; } table.data { font-size: .82rem; } table.data td, table.data th { padding: .2rem .42rem; } a { color: inherit; }
  * { print-color-adjust: exact; -webkit-print-color-adjust: exact; }
}
@media (max-width: 45rem) { body { padding: 1.2rem .8rem; } nav { columns: 1; } table.data td, table.data th { padding: .22rem .45rem; } }
)css";

}  // namespace prism::report

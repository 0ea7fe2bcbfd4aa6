// How the report looks: light or dark as the reader's device asks, from a phone's width up.
#pragma once

namespace htvm::lab {

inline constexpr const char* report_style = R"css(
:root{--page:#fbfaf8;--ink:#1f2328;--soft:#5b636d;--line:#dcdad5;--card:#fff;--accent:#0072b2;--yes:#00704f;--no:#a04000}
@media (prefers-color-scheme:dark){:root{--page:#16181c;--ink:#e6e6e3;--soft:#a3a9b2;--line:#373b42;--card:#1e2126;
--accent:#6cb8e6;--yes:#5fcf9f;--no:#f0a467}}
*{box-sizing:border-box}
html{-webkit-text-size-adjust:100%}
body{margin:0;background:var(--page);color:var(--ink);font:17px/1.55 system-ui,-apple-system,"Segoe UI",Roboto,sans-serif}
header,main{max-width:60rem;margin:0 auto;padding:0 1.1rem}
header{padding-top:2.2rem}
header p{color:var(--soft);margin:.2rem 0 0}
h1{font-size:1.9rem;line-height:1.2;margin:0}
h2{font-size:1.4rem;margin:3rem 0 .8rem;padding-top:1rem;border-top:1px solid var(--line)}
h3{font-size:1.08rem;margin:0 0 .7rem}
.summary{font-size:1.12rem;max-width:46rem;margin-top:1.4rem}
.summary p{margin:.7rem 0}
figure{margin:0 0 1.8rem;padding:1.1rem;background:var(--card);border:1px solid var(--line);border-radius:10px}
figure:target{border-color:var(--accent)}
figcaption p{margin:.55rem 0 0;font-size:.95rem;max-width:48rem}
figcaption b{color:var(--accent);font-weight:600}
.charts{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(100%,23rem),1fr));gap:.8rem}
.plate{background:#fff;color:#222;border-radius:6px;overflow-x:auto}
.chart svg{display:block;width:100%;min-width:24rem;max-width:46rem;height:auto;margin:0 auto}
.tiles{display:flex;gap:.5rem;padding:.5rem;margin-bottom:.5rem}
.tile{flex:1 0 8rem;min-width:0;max-width:24rem;text-align:center;margin:0 auto}
.tile img{max-width:100%;max-height:30rem;display:block;margin:0 auto;object-fit:contain}
.tile span{display:block;font-size:.82rem;line-height:1.35;color:#333;padding:.3rem}
nav{margin:0 0 1.2rem}
nav a{display:inline-block;min-width:2rem;text-align:center;padding:.15rem .4rem;margin:.1rem;border:1px solid var(--line);
border-radius:6px;color:var(--accent);text-decoration:none}
.scroll{overflow-x:auto}
table{border-collapse:collapse;font-size:.9rem;font-variant-numeric:tabular-nums;min-width:100%}
th,td{padding:.32rem .6rem;text-align:right;border-bottom:1px solid var(--line);white-space:nowrap}
th{color:var(--soft);font-weight:600}
th:first-child,td:first-child{text-align:left}
.claims td,.claims th{text-align:left;white-space:normal;min-width:7rem;vertical-align:top}
.yes{color:var(--yes);font-weight:600}.no{color:var(--no);font-weight:600}
.note{color:var(--soft);font-size:.88rem}
.scroll+h3,.note+h3,dl+h3{margin-top:1.8rem}
dl{display:grid;grid-template-columns:max-content 1fr;gap:.25rem 1rem;margin:0;font-size:.95rem}
dt{color:var(--soft)}dd{margin:0;overflow-wrap:anywhere}
pre{overflow-x:auto;background:var(--card);border:1px solid var(--line);border-radius:8px;padding:.8rem;font-size:.85rem}
@media (max-width:34rem){body{font-size:16px}figure{padding:.7rem}dl{grid-template-columns:1fr}dd{margin-bottom:.4rem}}
)css";

}  // namespace htvm::lab

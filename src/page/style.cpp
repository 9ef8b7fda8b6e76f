#include "page/view.hpp"

namespace spindle::page {
namespace {

// Letters are large enough to be read from two metres; every pair of colours has a contrast of 4.5
// to 1 at least, and a shape or a word beside it.
constexpr std::string_view style =
    R"CSS(:root{color-scheme:light;--ink:#16202b;--quiet:#4a5866;--paper:#eef1f4;--card:#fff;--line:#d3dae1;
--good:#14653a;--good-paper:#e6f4ec;--bad:#a3161b;--bad-paper:#fdeceb;--warn:#7a4a00;--warn-paper:#fff4dc;--deep:#1d4868}
*{box-sizing:border-box}
html{font-size:clamp(16px,.6vw + 13px,22px);-webkit-text-size-adjust:100%}
body{margin:0;background:var(--paper);color:var(--ink);font:1rem/1.4 system-ui,"Segoe UI",Roboto,"Helvetica Neue",Arial,sans-serif;font-variant-numeric:tabular-nums}
p,h1,h2,dl,dd,ul{margin:0}
a{color:var(--deep)}
:focus-visible{outline:4px solid var(--deep);outline-offset:3px;border-radius:4px}
main:focus{outline:none}
.skip{position:absolute;left:-999px;top:0;padding:.7rem 1rem;background:var(--card);z-index:2}
.skip:focus{left:.5rem;top:.5rem}
.unseen{position:absolute;width:1px;height:1px;overflow:hidden;clip-path:inset(50%);white-space:nowrap}
.top{padding:1.1rem clamp(.8rem,2vw,2rem) .4rem;display:grid;grid-template-columns:1fr auto;gap:.5rem 1.5rem;align-items:baseline}
.top>*{grid-column:1/-1;min-width:0}
.top>h1{grid-column:1;font-size:1.5rem;line-height:1.2;font-weight:650}
.top>.asof{grid-column:2;color:var(--quiet)}
#live{color:var(--good);font-weight:600}
#connection:empty{display:none}
.lost #connection{position:sticky;top:0;z-index:1}
.banner{display:flex;gap:.7rem;align-items:center;padding:.8rem 1.1rem;border-radius:.6rem;font-size:1.1rem;border:2px solid;margin:.2rem 0;overflow-wrap:anywhere}
.banner.bad{background:var(--bad-paper);color:var(--bad)}
.banner.calm{background:var(--card);color:var(--ink);border-color:var(--line)}
.shape{width:1.15em;height:1.15em;flex:none;fill:currentColor;stroke:#fff;stroke-width:2.6;stroke-linecap:round;stroke-linejoin:round}
.shape circle,.shape .body{stroke:none}
.shape path:not(.body){fill:none}
.shape.ring circle{fill:none;stroke:currentColor;stroke-width:3}
.sum{display:flex;flex-wrap:wrap;gap:.4rem 2rem;align-items:baseline;font-size:1.1rem}
.tools span+span::before,.meta span+span::before,.when span+span::before{content:"· ";color:var(--quiet)}
.sum .up,.link.up{color:var(--good)}
.sum .down,.link.down{color:var(--bad)}
.sum .unknown,.link.unknown,.quiet,.meta,.when,.shift,.old,footer{color:var(--quiet)}
.sum .counts{margin:0}
.old{font-size:.9rem;margin-top:.3rem;overflow-wrap:anywhere}
main{display:grid;grid-template-columns:repeat(auto-fill,minmax(min(100%,21rem),1fr));gap:clamp(.7rem,1.2vw,1.3rem);padding:.8rem clamp(.8rem,2vw,2rem) 1.2rem;align-items:start}
.card{background:var(--card);border:1px solid var(--line);border-top:.5rem solid var(--line);border-radius:.8rem;padding:.9rem 1.1rem 1rem;min-width:0;display:grid;gap:.55rem;box-shadow:0 1px 3px rgba(22,32,43,.08);overflow-wrap:anywhere}
.card>*{min-width:0}
.card header>*,.result>*{min-width:0;max-width:100%}
.card.ok{border-top-color:var(--good)}
.card.ng{border-top-color:var(--bad)}
.card header{display:flex;flex-wrap:wrap;justify-content:space-between;gap:.2rem 1rem;align-items:baseline}
.card h2{font-size:1.5rem;line-height:1.2;font-weight:650}
.link{display:flex;flex-wrap:wrap;gap:.2rem .45rem;align-items:center;font-size:1.05rem}
.link .shape{width:.85em;height:.85em}
.link .detail{color:var(--quiet);font-size:.9rem}
.meta{font-size:1.05rem}
.result{display:flex;flex-wrap:wrap;justify-content:space-between;align-items:center;gap:.1rem 1rem;padding:.55rem .9rem;border-radius:.6rem;background:var(--paper)}
.result.ok{background:var(--good-paper);color:var(--good)}
.result.ng{background:var(--bad-paper);color:var(--bad)}
.verdict{display:flex;align-items:center;gap:.55rem;font-size:2.1rem;line-height:1.2}
.none .verdict{font-size:1.3rem;color:var(--quiet)}
.torque{font-size:2.9rem;line-height:1.1;font-weight:650;color:var(--ink)}
.torque small{font-size:1.15rem;font-weight:400}
.torque.quiet{font-size:1.1rem;font-weight:400;color:var(--quiet)}
.why{font-size:1.05rem}
.remedy{display:block;margin-top:.15rem}
.trouble{display:flex;gap:.7rem;padding:.7rem .9rem;border-radius:.6rem;border:2px solid;font-size:1.1rem}
.trouble .shape{width:1.6rem;height:1.6rem}
.trouble.alarm{background:var(--bad-paper);color:var(--bad)}
.trouble.warning{background:var(--warn-paper);color:var(--warn)}
.trouble .remedy,.why .remedy{color:var(--ink)}
.trouble .quiet{display:block;font-size:.9rem}
.counts{display:flex;flex-wrap:wrap;gap:.2rem 1.6rem}
.counts div{display:flex;align-items:baseline;gap:.45rem}
.counts dt{color:var(--quiet);font-size:1rem}
.counts dd{font-size:1.5rem;font-weight:650}
.sum .counts dd{font-size:1.2rem}
.counts .n-ng.some dd,.counts .n-ng.some dt,.counts .n-missed.some dd,.counts .n-missed.some dt{color:var(--bad)}
.counts .some dd::before{content:"\25B2";font-size:.6em;margin-right:.3em;vertical-align:.2em}
.run .chart{display:block;width:100%;height:auto;max-height:5.5rem}
.run p{font-size:.85rem}
summary{cursor:pointer;padding:.35rem 0;min-height:2.75rem;display:list-item;align-content:center;color:var(--bad);font-weight:600}
details ul{padding-left:1.2rem;font-size:.95rem}
footer{padding:.4rem clamp(.8rem,2vw,2rem) 1.4rem;font-size:.9rem;display:grid;gap:.2rem}
footer a{display:inline-block;padding:.4rem 0}
.lost .card{border-style:dashed;border-top-style:solid}
@media (min-width:60rem){.sum .counts{margin-left:auto}}
@media (forced-colors:active){.card,.result{border:2px solid}.shape{forced-color-adjust:auto}}
)CSS";

}  // namespace

std::string_view style_css() { return style; }

}  // namespace spindle::page

#include <fmt/format.h>

#include "page/view.hpp"
#include "spindle/chart/escape.hpp"

namespace spindle::page {
namespace {

constexpr std::string_view script = R"JS('use strict';
(() => {
  const element = id => document.getElementById(id);
  const tools = element('tools'), asOf = element('as-of'), connection = element('connection');
  const silence = 25000, pause = 3000;
  let last = document.documentElement.dataset.id, known = asOf.textContent;
  let source = null, watchdog = 0, retry = 0;

  // Makes one tree like another and leaves alone what is the same: focus, what is open, and what a
  // screen reader stands on stay.
  const liken = (here, there) => {
    if (here.nodeType !== there.nodeType || here.nodeName !== there.nodeName) {
      here.replaceWith(there);
      return;
    }
    if (here.nodeType !== Node.ELEMENT_NODE) {
      if (here.data !== there.data) here.data = there.data;
      return;
    }
    for (const {name} of [...here.attributes]) {
      const stays = name === 'open' && here.nodeName === 'DETAILS';
      if (!stays && !there.hasAttribute(name)) here.removeAttribute(name);
    }
    for (const {name, value} of [...there.attributes]) {
      if (here.getAttribute(name) !== value) here.setAttribute(name, value);
    }
    const old = [...here.childNodes], fresh = [...there.childNodes];
    fresh.forEach((child, at) => at < old.length ? liken(old[at], child) : here.append(child));
    old.slice(fresh.length).forEach(child => child.remove());
  };

  const tree = html => {
    const template = document.createElement('template');
    template.innerHTML = html;
    return template.content;
  };

  const show = view => {
    for (const [key, html] of Object.entries(view.cards)) {
      const fresh = tree(html).firstElementChild, here = element(key);
      if (here) liken(here, fresh); else tools.append(fresh);
    }
    if (view.order) {
      const wanted = new Set(view.order);
      [...tools.children].forEach(card => wanted.has(card.id) || card.remove());
      view.order.forEach((key, at) => {
        const card = element(key);
        if (card && tools.children[at] !== card) tools.insertBefore(card, tools.children[at]);
      });
    }
    if (view.overview !== undefined) {
      const fresh = element('overview').cloneNode(false);
      fresh.append(tree(view.overview));
      liken(element('overview'), fresh);
    }
    if (view.say.length) element('say').textContent = view.say.join('. ');
  };

  const broken = () => {
    document.body.classList.add('lost');
    element('live').hidden = true;
    const text = `Connection lost, showing what was known at ${known}. Trying again.`;
    if (connection.textContent !== text) {
      connection.replaceChildren(Object.assign(document.createElement('p'),
                                               {className: 'banner bad', textContent: text}));
    }
  };

  const alive = time => {
    known = asOf.textContent = time;
    document.body.classList.remove('lost');
    element('live').hidden = false;
    if (connection.firstChild) connection.replaceChildren();
    clearTimeout(watchdog);
    watchdog = setTimeout(again, silence);
  };

  const again = () => {
    broken();
    clearTimeout(watchdog);
    if (source) source.close();
    clearTimeout(retry);
    retry = setTimeout(connect, pause);
  };

  const connect = () => {
    source = new EventSource('/events?after=' + encodeURIComponent(last));
    source.addEventListener('view', event => {
      const view = JSON.parse(event.data);
      if (event.lastEventId) last = event.lastEventId;
      show(view);
      alive(view.as_of);
    });
    source.addEventListener('record', event => { last = event.lastEventId; });
    source.addEventListener('now', event => alive(JSON.parse(event.data)));
    source.onerror = again;
    clearTimeout(watchdog);
    watchdog = setTimeout(again, silence);
  };

  connect();
})();
)JS";

}  // namespace

std::string page_html(const PageParts& parts) {
  std::string html = fmt::format(
      R"(<!DOCTYPE html>
<html lang="en" data-id="{}">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light">
<title>Tools at the line</title>
<link rel="icon" href="/icon.svg" type="image/svg+xml">
<link rel="stylesheet" href="/style.css">
<noscript><meta http-equiv="refresh" content="60"></noscript>
<script src="/app.js" defer></script>
</head>
<body>
<a class="skip" href="#tools">To the tools</a>
<header class="top"><h1>Tools at the line</h1>
<p class="asof"><span id="live" hidden>live, </span>as of <time id="as-of">{}</time></p>
<noscript><p class="banner calm"><span>Without JavaScript this page shows what was known at {}. It is loaded again every minute.</span></p></noscript>
<div id="connection" role="status" aria-live="polite"></div>
<section id="overview" aria-label="All tools">{}</section>
</header>
<main id="tools" tabindex="-1" aria-label="Tools">
)",
      parts.id, parts.as_of, parts.as_of, parts.overview);
  for (const std::string& card : parts.cards) html += card + "\n";
  html += fmt::format(
      R"(</main>
<p id="say" class="unseen" role="status" aria-live="polite"></p>
<footer><p>For reading only: nothing on this page reaches a tool. Times are {}, by the clock of the computer that recorded.</p>
<p>spindle {} · <a href="/api/state">as JSON</a> · <a href="/metrics">metrics</a></p></footer>
</body>
</html>
)",
      chart::escape(parts.zone), chart::escape(parts.version));
  return html;
}

std::string sentence_html(std::string_view title, std::string_view sentence) {
  return fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
      "content=\"width=device-width, initial-scale=1\"><title>{}</title></head><body><main>"
      "<h1>{}</h1><p>{}</p></main></body></html>\n",
      chart::escape(title), chart::escape(title), chart::escape(sentence));
}

std::string_view icon_svg() {
  return R"(<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 32 32"><circle cx="16" cy="16" r="16" fill="#1d4868"/><path d="M16 5v14M10 19h12l-6 8z" fill="#fff" stroke="#fff" stroke-width="3" stroke-linejoin="round"/></svg>)";
}

std::string_view script_js() { return script; }

}  // namespace spindle::page

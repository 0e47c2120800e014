// The page of `labkit mark`. What is given is sent until the server says that it is kept, each act under a name of its
// own, so that what is sent twice counts once; until then the page stays where it is.
"use strict";

const $ = (one, within = document) => within.querySelector(one);
const $$ = (all, within = document) => [...within.querySelectorAll(all)];
const WAIT = 1000; // [ms] before it is tried again
let clean = ""; // the form as it was shown
let warned = false; // that something is filled in and not given
let refused = null; // {seen, what}: the marks that were told of when something was not given, and what that was
let sending = false; // something that is not known to be kept
let going = false; // to another page: keys are for what will be seen there, so that they do nothing yet
const open = {}; // which parts are unfolded, by id

function tell(id, words) {
  document.getElementById(id).textContent = words;
}

function entry() {
  const form = $("#give");
  return {
    points: form.points.value,
    comment: form.comment.value,
    ticks: $$(".tick[aria-pressed=true]").map(tick => Number(tick.dataset.number)),
    seen: Object.fromEntries($$(".slot:checked").map(slot => [slot.value, Number(slot.dataset.seen)])),
  };
}

function shown() {
  for (const part of $$("details[id]")) {
    if (part.id in open) part.open = open[part.id];
    part.addEventListener("toggle", () => { open[part.id] = part.open; });
  }
  clean = $("#give") ? JSON.stringify(entry()) : "";
  warned = false;
  refused = null;
}

// text: the page that is at the address, where that is known already.
async function go(address, push = true, text = "") {
  let answer = {ok: true, url: address};
  going = true;
  try {
    if (!text) {
      answer = await fetch(address);
      text = await answer.text();
    }
  } catch {
    return tell("trouble", "labkit mark does not answer: start it again with the same line, then try once more.");
  } finally {
    going = false;
  }
  const page = new DOMParser().parseFromString(text, "text/html");
  if (!answer.ok || !$("main", page)) return tell("trouble", page.body.textContent.trim());
  tell("trouble", "");
  $("main").replaceWith(document.adoptNode($("main", page)));
  document.title = page.title;
  if (push) history.pushState(null, "", answer.url);
  window.scrollTo(0, 0);
  shown();
  rest();
}

// The server's answer to `body`, whenever it comes.
async function send(address, body) {
  const text = JSON.stringify({...body, act: crypto.randomUUID()});
  const headers = {"Content-Type": "application/json"};
  sending = true;
  for (const field of $$("#give :is(button, input, textarea), .slot")) field.disabled = true;
  try {
    for (;;) {
      try {
        const answer = await fetch(address, {method: "POST", headers, body: text});
        const told = await answer.json();
        if (answer.status !== 503) return {...told, status: answer.status};
        tell("trouble", told.said);
      } catch {
        tell("trouble", "Not kept yet: labkit mark does not answer. Start it again with the same line and leave this " +
          "page open; it sends what you gave by itself.");
      }
      await new Promise(done => setTimeout(done, WAIT));
    }
  } finally {
    sending = false;
    for (const field of $$("#give :is(button, input, textarea), .slot")) field.disabled = false;
  }
}

// What decides whether a mark is the same one: not its comment.
function what(body) {
  return JSON.stringify([body.points.trim(), body.ticks, Object.keys(body.seen)]);
}

async function give() {
  const form = $("#give"), body = entry();
  if (!Object.keys(body.seen).length) return tell("trouble", "Nobody is chosen: tick a student under the answer.");
  if (!body.points.trim()) return tell("trouble", "There are no points yet: press a number, or fill them in.");
  if (refused && refused.what === what(body)) Object.assign(body.seen, refused.seen);
  const told = await send(location.href, body);
  tell("trouble", told.status === 200 ? "" : told.said);
  if (told.status === 200) {
    clean = JSON.stringify(entry());
    await go(told.go, true, told.page);
    tell("said", told.said);
  } else if (told.seen) {
    refused = {seen: {...body.seen, ...told.seen}, what: what(body)};
    $(".main", form).focus();
  }
}

async function undo() {
  const told = await send($("main").dataset.home + "undo", {});
  if (told.go) await go(told.go);
  tell("said", told.said);
}

function unsent() {
  return sending || clean && JSON.stringify(entry()) !== clean;
}

// The focus goes to what is to be read now.
function rest() {
  ($(".answer h2[tabindex]") || $("h1") || document.body).focus({preventScroll: true});
}

function leave(link) {
  if (unsent() && !warned && !refused) {
    warned = true;
    return tell("trouble", "What you filled in is not given yet: Enter gives it; the same key once more leaves it.");
  }
  tell("said", "");
  return go(link.href);
}

function press(tick) {
  tick.setAttribute("aria-pressed", tick.getAttribute("aria-pressed") !== "true");
  const sum = $$(".tick[aria-pressed=true]").reduce((all, one) => all + Number(one.dataset.points), 0);
  const most = Number($("#give").dataset.most);
  $("#points").value = String(Math.round(Math.min(sum, most) * 1e4) / 1e4);
}

function set(points) {
  for (const tick of $$(".tick")) tick.setAttribute("aria-pressed", points !== 0);
  $("#points").value = String(points);
}

function reuse(button) {
  const field = $("#comment"), line = $("span", button).textContent;
  const lines = field.value.split("\n").filter(one => one.trim());
  field.value = (lines.includes(line) ? lines.filter(one => one !== line) : [...lines, line]).join("\n");
}

// One student of the group, or all.
function only() {
  const slots = $$(".slot"), alone = slots.filter(slot => slot.checked).length > 1;
  slots.forEach((slot, place) => { slot.checked = alone ? place === 0 : true; });
  count();
}

function count() {
  const chosen = $$(".slot:checked").length;
  $(".main").firstChild.data = `Give${chosen > 1 ? ` to ${chosen} students` : ""}, go on `;
}

const KEYS = {
  "0": () => set(0), f: () => set(Number($("#give").dataset.most)), s: only, u: undo,
  c: () => $("#comment").focus(),
  q: () => { $("#question").open = !$("#question").open; },
  m: () => { $("#model").open = !$("#model").open; },
  r: () => {
    document.body.dataset.picking = "yes";
    const first = $(".comment");
    if (first) first.focus();
    else tell("said", "There is no comment to this question yet.");
  },
  Enter: give,
};

function keyed(key, digit) {
  const picking = "picking" in document.body.dataset;
  delete document.body.dataset.picking;
  if (picking && (digit || key === "0")) {
    rest();
    return $$(".comment")[digit - 1] && reuse($$(".comment")[digit - 1]);
  }
  if (digit && $$(".tick").length) return $$(".tick")[digit - 1] && press($$(".tick")[digit - 1]);
  if (digit && digit <= Number($("#give").dataset.most)) return set(digit);
  const link = $(`a[data-key="${key}"]`);
  return link ? leave(link) : KEYS[key] && KEYS[key]();
}

document.addEventListener("keydown", event => {
  const field = event.target.closest("textarea, input:not([type=checkbox])");
  if (sending || going || event.altKey || event.isComposing || !$("[data-home] :is(#give, [data-key])")) return;
  if (event.key === "Enter" && $("#give") && (event.ctrlKey || event.metaKey || event.target.id === "points")) {
    event.preventDefault();
    give();
  } else if (event.key === "Escape" && field) {
    field.blur();
  } else if (!field && !event.ctrlKey && !event.metaKey && (!$("#keys") || $("#keys").checked)) {
    if (event.key === "Enter" && event.target.closest("a, button, summary, input")) return;
    const digit = /^(Digit|Numpad)[1-9]$/.test(event.code) ? Number(event.code.slice(-1)) : 0;
    const key = /^(Digit|Numpad)0$/.test(event.code) ? "0" : event.key;
    if (!digit && !(key in KEYS && $("#give")) && !$(`[data-key="${CSS.escape(key)}"]`)) return;
    event.preventDefault();
    keyed(key, $("#give") ? digit : 0);
  }
});

document.addEventListener("submit", event => {
  if (event.target.id !== "give") return;
  event.preventDefault();
  if (!sending && !going) give();
});

document.addEventListener("click", event => {
  const target = event.target.closest("button, a[data-key]");
  if (!target || sending || going || event.ctrlKey || event.metaKey || event.shiftKey) return;
  if (target.matches(".tick")) press(target);
  else if (target.matches(".comment")) reuse(target);
  else if (target.matches("button[data-key]")) KEYS[target.dataset.key]();
  else if (target.matches("a[data-key]")) { event.preventDefault(); leave(target); }
  if (event.detail && target.matches("button[type=button]")) rest(); // a mouse's: Enter then gives, and presses no button
});

document.addEventListener("change", event => { if (event.target.matches(".slot")) count(); });
window.addEventListener("popstate", () => go(location.href, false));
window.addEventListener("beforeunload", event => { if (unsent()) event.preventDefault(); });
shown();

// What is told beside the picture: status, numbers, the list of poses, times.
import { angleBetween, fileName, kindText, milliseconds, number, percent, statusText } from "./text.js";

const $ = (id) => document.getElementById(id);

function element(tag, className, text) {
  const made = document.createElement(tag);
  if (className) made.className = className;
  if (text !== undefined) made.textContent = text;
  return made;
}

function cloudText({ given, shown, unusable }) {
  const parts = [`${given.toLocaleString("en")} points`];
  if (shown < given - unusable) parts.push(`${shown.toLocaleString("en")} of them shown`);
  if (unusable > 0) parts.push(`${unusable.toLocaleString("en")} not finite`);
  return parts.join(", ");
}

function facts(pair) {
  const { result } = pair;
  const list = [
    ["confidence", percent(result.confidence)],
    ["overlap", percent(result.pose === null ? null : result.overlap)],
    ["residual", result.pose === null ? "not known" : `${number(result.rmse)} r.m.s.`],
    ["rotation", result.rotation_error_deg === null ? "not known" : `± ${number(result.rotation_error_deg, 2)}°`],
    ["source", cloudText(pair.source)],
    ["target", cloudText(pair.target)],
  ];
  if (pair.model) list.push(["model", pair.mode ? `${pair.model}, mode ${pair.mode}` : pair.model]);
  return list;
}

export function showFacts(pair, frame) {
  const { status } = pair.result;
  const names = [pair.source.name, pair.target.name];
  $("names").textContent = names.map(fileName).join(" → ");
  $("names").title = names.join(" → ");
  document.title = `${$("names").textContent}: vnreg`;
  $("status").textContent = status;
  $("status").dataset.status = status;
  $("status-text").textContent = statusText[status] ?? "";
  for (const [name, value] of facts(pair)) {
    $("facts").append(element("dt", "", name), element("dd", "", value));
  }
  if (frame.startIsNearer) {
    $("note").textContent =
      `Before: drawn nearer. The clouds lie ${number(frame.startDistance)} apart, ` +
      `${number(frame.startDistance / frame.size, 2)} times their size.`;
  }
}

/// Buttons, one per pose; `choose(i)` is called for the i-th.
export function showPoses(pair, choose) {
  const scores = pair.poses.map((p) => p.score).filter((s) => s !== null);
  const least = Math.min(...scores);
  const range = Math.max(...scores) - least || 1;
  pair.poses.forEach((pose, i) => {
    const button = element("button", "pose");
    button.type = "button";
    button.append(element("span", "kind", kindText[pose.kind]));
    const away = angleBetween(pose.pose, pair.result.pose);
    button.append(element("span", "away", i === 0 ? "" : `${number(away, 3)}° off`));
    button.append(element("span", "score", pose.score === null ? "–" : number(pose.score)));
    const bar = element("span", "bar");
    bar.style.width = pose.score === null ? "0" : `${4 + (96 * (pose.score - least)) / range}%`;
    button.append(bar);
    button.addEventListener("click", () => choose(i));
    const item = element("li");
    item.append(button);
    $("poses").append(item);
  });
  $("poses-section").hidden = pair.poses.length === 0;
}

export function markPose(index) {
  document.querySelectorAll(".pose").forEach((button, i) => {
    button.setAttribute("aria-pressed", String(i === index));
    if (i === index) button.scrollIntoView?.({ block: "nearest" });
  });
}

export function showTimes(ms) {
  const stages = Object.entries(ms).filter(([name, value]) => name !== "total" && value > 0);
  const most = Math.max(...stages.map(([, value]) => value), 1e-9);
  for (const [name, value] of stages) {
    const row = element("div", "time");
    row.append(element("span", "", name));
    const track = element("span", "track");
    const bar = element("span", "bar");
    bar.style.width = `${(100 * value) / most}%`;
    track.append(bar);
    row.append(track, element("span", "ms", milliseconds(value)));
    $("times").append(row);
  }
  $("total").textContent = milliseconds(ms.total);
}

// What the colours mean.
import { number } from "./text.js";

const $ = (id) => document.getElementById(id);

/// colour: "plain", "residual" or "significance"; `most`: the residual of the last colour.
export function showLegend(colour, most) {
  $("legend-plain").hidden = colour !== "plain";
  $("legend-scale").hidden = colour === "plain";
  const residual = colour === "residual";
  $("scale").className = residual ? "residual" : "significance";
  $("scale-low").textContent = "0";
  $("scale-high").textContent = residual ? `≥ ${number(most)}` : "1";
  $("scale-name").textContent = residual
    ? "distance to the other cloud, at the chosen pose"
    : "significance: what the network expects of a point";
}
